/// Another template of the same surface: the four-legged one with proportions of its own.
/// Shapes    as BodyModel; stands on its lowest vertex, y = 0
/// Errors    npt::Error for a proportion that the plan doesn't have, or a factor that isn't above 0
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_plan.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/plan_proportions.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace sculpt::quadruped {

/// factors: of the plan's proportions, by their names; those without one stay as they are.
inline npt::BodyModel grown(const npt::BodyModel& body, const npt::BodyPlan& plan,
                            const std::map<std::string, double>& factors) {
  npt::BodyPlan changes = plan;  // a deviation is how far the shape direction goes
  for (npt::ProportionPlan& p : changes.proportions)
    p.deviation = factors.contains(p.name) ? factors.at(p.name) - 1 : 0;
  for (const auto& [name, factor] : factors)
    if (std::ranges::find(plan.proportions, name, &npt::ProportionPlan::name) == plan.proportions.end() ||
        !(factor > 0))
      throw npt::Error({.file = "plan " + plan.name,
                        .found = "proportion '" + name + "' with the factor " + std::to_string(factor),
                        .expected = "one of the plan, and a factor above 0"});
  const npt::BodyModel with = npt::with_proportions(body, changes);
  npt::BodyTables tables = body.tables();
  const std::size_t old = body.shape_count(), all = with.shape_count();
  float lowest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < tables.v_template.size(); ++i) {
    for (std::size_t k = old; k < all; ++k) tables.v_template[i] += with.tables().shapedirs[i * all + k];
    if (i % 3 == 1) lowest = std::min(lowest, tables.v_template[i]);
  }
  for (std::size_t i = 1; i < tables.v_template.size(); i += 3) tables.v_template[i] -= lowest;
  return npt::BodyModel(std::move(tables), plan.name);
}

}  // namespace sculpt::quadruped
