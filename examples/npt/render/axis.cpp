#include <render/axis.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

namespace render {

namespace {

std::vector<double> linear_ticks(double low, double high, int most) {
  const double raw = (high - low) / most;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= raw) step = factor * power;
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) ticks.push_back(k * step);
  return ticks;
}

}  // namespace

std::string tick_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", std::abs(value) < 1e-12 ? 0.0 : value);
  return text;
}

std::vector<double> axis_ticks(double low, double high, bool logarithmic, int most) {
  if (!logarithmic) return linear_ticks(low, high, most);
  const auto factors_within = [&](std::span<const double> factors, int every) {
    std::vector<double> ticks;
    for (int e = static_cast<int>(std::floor(std::log10(low))); std::pow(10.0, e) <= high; ++e)
      for (const double factor : factors)
        if (const double tick = factor * std::pow(10.0, e);
            tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9) && (e % every + every) % every == 0)
          ticks.push_back(tick);
    return ticks;
  };
  static constexpr std::array<double, 9> all{1, 2, 3, 4, 5, 6, 7, 8, 9};
  static constexpr std::array<double, 3> three{1, 2, 5};
  static constexpr std::array<double, 1> one{1};
  std::vector<double> ticks = factors_within(three, 1);
  if (ticks.size() < 3) ticks = factors_within(all, 1);
  if (ticks.size() < 2) return linear_ticks(low, high, most);  // less than the step from one digit to the next
  for (int every = 1; static_cast<int>(ticks.size()) > most; ++every) ticks = factors_within(one, every);
  return ticks;
}

}  // namespace render
