/// The values that axes and scales are labelled with.
#pragma once

#include <string>
#include <vector>

namespace render {

/// The values that an axis from `low` to `high` is labelled with: 1, 2 or 5 times powers of ten; on a logarithmic axis
/// powers of ten, and 2 and 5 times them where they are few.
std::vector<double> axis_ticks(double low, double high, bool logarithmic, int most = 9);

/// A label: six digits at most, no -0.
std::string tick_text(double value);

}  // namespace render
