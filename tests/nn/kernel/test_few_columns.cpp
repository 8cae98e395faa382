#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/few_columns.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace kernel = npt::kernel;

TEST_CASE("a few columns are added to what a tile holds") {
  constexpr int width = kernel::panel_width<float>, rows = 5;
  const auto index = [](int i) { return static_cast<std::size_t>(i); };
  npt::Random random(6);
  for (int columns = 1; columns <= kernel::most_few_columns; ++columns) {
    CAPTURE(columns);
    std::vector<float> weights(index(rows * columns));
    npt::AlignedBuffer<float> values(index(columns * width)), tile(index((rows + 1) * width));
    for (float& x : weights) x = static_cast<float>(random.uniform(-1, 1));
    for (float& x : values.span()) x = static_cast<float>(random.uniform(-1, 1));
    for (float& x : tile.span()) x = static_cast<float>(random.uniform(-1, 1));
    const std::vector<float> before(tile.data(), tile.data() + tile.size());
    kernel::add_few_columns(columns, rows, weights.data(), values.data(), tile.data());
    double worst = 0;
    for (int r = 0; r <= rows; ++r)
      for (int v = 0; v < width; ++v) {
        double expected = double{before[index(r * width + v)]};
        for (int c = 0; r < rows && c < columns; ++c)
          expected += double{weights[index(r * columns + c)]} * double{values.data()[c * width + v]};
        const double error = std::abs(double{tile.data()[r * width + v]} - expected);
        if (!(error <= worst)) worst = error;  // NaN counts
      }
    CHECK(worst < 1e-5);
  }
}
