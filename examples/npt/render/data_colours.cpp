#include <render/data_colours.hpp>

#include <npt/base/error.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/normals.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace render {

using npt::Vec3d;

Vec3d to_oklab(Colour colour) {
  const Vec3d c = colour.as<double>();
  const double l = std::cbrt(0.4122214708 * c.x + 0.5363325363 * c.y + 0.0514459929 * c.z);
  const double m = std::cbrt(0.2119034982 * c.x + 0.6806995451 * c.y + 0.1073969566 * c.z);
  const double s = std::cbrt(0.0883024619 * c.x + 0.2817188376 * c.y + 0.6299787005 * c.z);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

Colour from_oklab(Vec3d lab) {
  const auto cube = [](double v) { return v * v * v; };
  const double l = cube(lab.x + 0.3963377774 * lab.y + 0.2158037573 * lab.z);
  const double m = cube(lab.x - 0.1055613458 * lab.y - 0.0638541728 * lab.z);
  const double s = cube(lab.x - 0.0894841775 * lab.y - 1.2914855480 * lab.z);
  return Vec3d{4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
               -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
               -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s}
      .as<float>();
}

namespace {

/// The next of 1, 2, 5, 10, 20, ... from `value` on.
double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= value * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

/// A path straight from colour to colour, to be walked at one speed for the eye.
class Path {
 public:
  explicit Path(std::span<const std::uint32_t> stops) {
    for (const std::uint32_t stop : stops) {
      const Vec3d p = to_oklab(from_hex(stop));
      lengths_.push_back(points_.empty() ? 0 : lengths_.back() + npt::length(p - points_.back()));
      points_.push_back(p);
    }
  }

  Vec3d at(double t) const {
    const double wanted = std::clamp(t, 0.0, 1.0) * lengths_.back();
    const auto next = std::upper_bound(lengths_.begin(), lengths_.end() - 1, wanted);
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, next - lengths_.begin()));
    const double share = (wanted - lengths_[i - 1]) / (lengths_[i] - lengths_[i - 1]);
    return points_[i - 1] + (points_[i] - points_[i - 1]) * share;
  }

 private:
  std::vector<Vec3d> points_;
  std::vector<double> lengths_;
};

}  // namespace

Colour heat_colour(float t) {
  static constexpr std::array<std::uint32_t, 6> stops = {0xE4E1DC, 0xF7DF8B, 0xF7AE4B, 0xE5692F, 0xB4262F, 0x611030};
  static const Path path(stops);
  return from_oklab(path.at(t == t ? static_cast<double>(t) : 1.0));
}

Colour hue_colour(float t) {
  const double angle = (20 + 310 * std::clamp(static_cast<double>(t), 0.0, 1.0)) * std::numbers::pi / 180;
  return from_oklab({0.74, 0.125 * std::cos(angle), 0.125 * std::sin(angle)});
}

std::vector<Colour> index_colours(std::size_t count) {
  std::vector<Colour> colours(count);
  for (std::size_t v = 0; v < count; ++v)
    colours[v] = hue_colour(count < 2 ? 0.0F : static_cast<float>(v) / static_cast<float>(count - 1));
  return colours;
}

std::vector<Colour> normal_colours(const npt::Mesh& mesh) {
  std::vector<Colour> colours;
  for (const npt::Vec3f n : npt::vertex_normals(mesh))
    colours.push_back(from_srgb(0.5F + 0.5F * n.x, 0.5F + 0.5F * n.y, 0.5F + 0.5F * n.z));
  return colours;
}

std::vector<Colour> heat_colours(std::span<const double> values, double low, double high) {
  std::vector<Colour> colours;
  const double range = high > low ? high - low : 1;
  for (const double v : values) colours.push_back(heat_colour(static_cast<float>((v - low) / range)));
  return colours;
}

ErrorScale error_scale(std::vector<double> values, double wanted) {
  if (values.empty()) throw npt::Error({"scale of errors", {}, "no values", "one at least"});
  // What isn't finite lies beyond every scale.
  for (double& v : values)
    if (!std::isfinite(v)) v = std::numeric_limits<double>::max();
  std::ranges::sort(values);
  const double most = values[values.size() - 1 - values.size() / 100];
  const double high = wanted > 0 ? wanted : round_up(std::clamp(most, 1e-3, 1e9));
  return {high, values.back() > high * (1 + 1e-9)};
}

std::vector<double> centred_distances(std::span<const float> xyz, std::span<const float> truth) {
  const auto centred = [](std::span<const float> points) {
    std::vector<float> moved(points.size());
    npt::normalising_transform(points, npt::Normalisation::centre).apply(points, moved);
    return moved;
  };
  return npt::vertex_distances(centred(xyz), centred(truth));
}

}  // namespace render
