#include <render/rasteriser.hpp>
#include <render/studio.hpp>

#include <npt/base/default_executor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace render {
namespace {

/// Steps that fill a disc or a sphere evenly: multiples of the golden angle.
const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));

/// The direction at `azimuth` degrees to the viewer's right and `elevation` degrees above the floor.
Vec3f direction_at(double viewer_yaw, double azimuth, double elevation) {
  return frame_of({viewer_yaw + azimuth, elevation}).towards;
}

/// `count` lamps that fill a disc of `half_angle` degrees around `towards` and together have `power`.
void add_disc(std::vector<Lamp>& lamps, Vec3f towards, double half_angle, int count, Colour power, float gloss) {
  const Frame frame = frame_towards(towards);
  const double spread = std::tan(half_angle * std::numbers::pi / 180);
  for (int i = 0; i < count; ++i) {
    const double radius = spread * std::sqrt((i + 0.5) / count), angle = i * golden_angle;
    const Vec3f offset = frame.right * static_cast<float>(radius * std::cos(angle)) +
                         frame.up * static_cast<float>(radius * std::sin(angle));
    lamps.push_back({normalised(towards + offset), power / static_cast<float>(count), gloss});
  }
}

/// `count` lamps over the half sphere above (side 1) or below (side -1); a surface that faces it gets `power` in all.
void add_dome(std::vector<Lamp>& lamps, float side, int count, Colour power) {
  for (int i = 0; i < count; ++i) {
    const double y = (i + 0.5) / count, ring = std::sqrt(1 - y * y), angle = i * golden_angle;
    lamps.push_back({{static_cast<float>(ring * std::cos(angle)), side * static_cast<float>(y),
                      static_cast<float>(ring * std::sin(angle))},
                     power * (2.0F / static_cast<float>(count)),
                     0});
  }
}

/// Nearest surfaces of a figure as seen from one lamp, in parallel projection.
class DepthMap {
 public:
  explicit DepthMap(int size) : size_(size), depth_(cell(0, size_)) {}

  void draw(const Figure& figure, Vec3f towards, Vec3f centre, float radius) {
    std::fill(depth_.begin(), depth_.end(), std::numeric_limits<float>::lowest());
    frame_ = frame_towards(towards);
    centre_ = centre;
    scale_ = 0.5F * static_cast<float>(size_ - 2) / radius;
    projected_.resize(figure.positions.size());
    for (std::size_t v = 0; v < figure.positions.size(); ++v) projected_[v] = project(figure.positions[v]);
    const auto keep_nearest = [this](int x, int y, float z) {
      float& depth = depth_[cell(x, y)];
      depth = std::max(depth, z);
    };
    for (const Triangle& t : figure.triangles)
      raster_triangle(projected_[t[0]], projected_[t[1]], projected_[t[2]], size_, size_, keep_nearest);
    if (figure.is_cloud())
      for (Vec3f p : projected_)
        raster_disc(p.x, p.y, figure.disc_radius * scale_, size_, size_,
                    [&](int x, int y, float, float) { keep_nearest(x, y, p.z); });
  }

  /// The part of the lamp that reaches p: 0, 1, or between along a shadow's border.
  float visible(Vec3f p) const {
    const Vec3f q = project(p);
    const float x = q.x - 0.5F, y = q.y - 0.5F;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(size_ - 1) && y < static_cast<float>(size_ - 1))) return 1;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float *here = &depth_[cell(column, row)], *below_it = here + size_;
    const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
    const auto lit = [z = q.z](float depth) { return z >= depth ? 1.0F : 0.0F; };
    const float above = lit(here[0]) * (1 - fx) + lit(here[1]) * fx;
    const float below = lit(below_it[0]) * (1 - fx) + lit(below_it[1]) * fx;
    return above * (1 - fy) + below * fy;
  }

 private:
  /// x and y in cells, z towards the lamp in world units.
  Vec3f project(Vec3f p) const {
    const Vec3f q = frame_.to_local(p - centre_);
    const float half = 0.5F * static_cast<float>(size_);
    return {half + q.x * scale_, half - q.y * scale_, q.z};
  }
  std::size_t cell(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) + static_cast<std::size_t>(x);
  }

  int size_;

  Frame frame_{};
  Vec3f centre_;
  float scale_ = 1;
  std::vector<Vec3f> projected_;
  std::vector<float> depth_;  ///< [size_ * size_]
};

struct Sphere {
  Vec3f centre;
  float radius = 1;
};

Sphere bounding_sphere(const Figure& figure) {
  Vec3f low = figure.outline.front(), high = low;
  for (Vec3f p : figure.outline) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Sphere sphere{(low + high) * 0.5F, 0};
  for (Vec3f p : figure.outline) sphere.radius = std::max(sphere.radius, length(p - sphere.centre));
  sphere.radius += figure.disc_radius;
  if (!(sphere.radius > 0)) sphere.radius = 1;
  return sphere;
}

constexpr float highlight_exponent = 28;

void add_lamp(const Lamp& lamp, const DepthMap& map, float offset, std::span<const ShadePoint> points,
              std::span<Light> light) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ShadePoint& point = points[i];
    const float cosine = dot(point.normal, lamp.direction);
    if (cosine <= 0) continue;
    const float reach = map.visible(point.position + point.normal * offset + lamp.direction * (0.5F * offset));
    if (reach <= 0) continue;
    light[i].diffuse += lamp.power * (cosine * reach);
    if (lamp.gloss > 0) {
      const float shine = std::max(0.0F, dot(point.normal, normalised(lamp.direction + point.to_eye)));
      light[i].specular += lamp.power * (lamp.gloss * cosine * reach * std::pow(shine, highlight_exponent));
    }
  }
}

}  // namespace

std::vector<Lamp> studio_lamps(double viewer_yaw) {
  std::vector<Lamp> lamps;
  add_disc(lamps, direction_at(viewer_yaw, -42, 46), 11, 28, Colour{1.0F, 0.965F, 0.91F} * 0.80F, 0.20F);
  add_disc(lamps, direction_at(viewer_yaw, 58, 18), 24, 14, Colour{0.88F, 0.94F, 1.0F} * 0.16F, 0.05F);
  add_disc(lamps, direction_at(viewer_yaw, 152, 38), 10, 10, Colour{0.95F, 0.98F, 1.0F} * 0.55F, 0.25F);
  add_dome(lamps, 1, 72, Colour{0.94F, 0.97F, 1.0F} * 0.38F);
  add_dome(lamps, -1, 20, Colour{1.0F, 0.98F, 0.95F} * 0.13F);
  return lamps;
}

std::vector<Light> gather_light(const Figure& figure, std::span<const Lamp> lamps, std::span<const ShadePoint> points,
                                int shadow_cells) {
  // Lamps one after another, so that one map (0.8 MB) is in the cache while all points ask it; a fixed number of
  // groups, whose sums are merged in order.
  constexpr std::size_t groups = 8;
  std::array<std::vector<Light>, groups> partial;
  const Sphere sphere = bounding_sphere(figure);
  const float offset = 3.0F * sphere.radius / static_cast<float>(shadow_cells);  // 1.5 cells
  npt::DefaultExecutor().for_each(static_cast<int>(groups), [&](int group, int) {
    const auto g = static_cast<std::size_t>(group);
    partial[g].resize(points.size());
    DepthMap map(shadow_cells);
    for (std::size_t l = g; l < lamps.size(); l += groups) {
      map.draw(figure, lamps[l].direction, sphere.centre, sphere.radius);
      add_lamp(lamps[l], map, offset, points, partial[g]);
    }
  });
  std::vector<Light> light(points.size());
  for (const auto& group : partial)
    for (std::size_t i = 0; i < points.size(); ++i) {
      light[i].diffuse += group[i].diffuse;
      light[i].specular += group[i].specular;
    }
  return light;
}

FloorShadow::FloorShadow(const Figure& figure) : extent_(2.6F * bounding_sphere(figure).radius) {}

std::vector<ShadePoint> FloorShadow::points() const {
  const auto place = [this](int i) {
    return extent_ * (2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(size_) - 1);
  };
  std::vector<ShadePoint> points;
  points.reserve(static_cast<std::size_t>(size_) * size_);
  for (int row = 0; row < size_; ++row)
    for (int column = 0; column < size_; ++column)
      points.push_back({{place(column), 0, place(row)}, {0, 1, 0}, {0, 1, 0}});
  return points;
}

void FloorShadow::set_light(std::span<const Light> light, std::span<const Lamp> lamps) {
  float open = 0;
  for (const Lamp& lamp : lamps) open += luminance(lamp.power) * std::max(0.0F, lamp.direction.y);
  brightness_.clear();
  for (const Light& l : light) brightness_.push_back(std::min(1.0F, luminance(l.diffuse) / open));
}

float FloorShadow::at(float x, float z) const {
  const auto place = [this](float v) { return (v / extent_ + 1) * 0.5F * static_cast<float>(size_) - 0.5F; };
  const float column = place(x), row = place(z);
  if (!(column >= 0 && row >= 0 && column < size_ - 1 && row < size_ - 1)) return 1;
  const int c = static_cast<int>(column), r = static_cast<int>(row);
  const float* cell = &brightness_[static_cast<std::size_t>(r) * size_ + static_cast<std::size_t>(c)];
  const float fx = column - static_cast<float>(c), fy = row - static_cast<float>(r);
  const float here =
      (cell[0] * (1 - fx) + cell[1] * fx) * (1 - fy) + (cell[size_] * (1 - fx) + cell[size_ + 1] * fx) * fy;
  const float fade = std::max(0.0F, 1 - (x * x + z * z) / (0.5F * extent_ * extent_));
  return 1 - (1 - here) * fade * fade;
}

}  // namespace render
