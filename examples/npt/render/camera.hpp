/// Where the viewer stands, and the fit of a row of figures into panels of one size at one scale.
///
/// World: y up, a mesh stands on y = 0 at x = z = 0 and looks along +z; see Figure in surface.hpp.
#pragma once

#include <npt/base/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace render {

using npt::Vec3f;

/// Degrees. Yaw 0 sees the figure's front, 90 its left side, 180 its back; positive pitch looks down on it.
struct View {
  double yaw = 35;
  double pitch = 12;
};

inline constexpr View front_view{0, 6};
inline constexpr View side_view{90, 6};
inline constexpr View back_view{180, 6};
inline constexpr View three_quarter_view{35, 12};

/// An orthonormal frame: `towards` points from the scene to the viewer or the light.
struct Frame {
  Vec3f right, up, towards;

  Vec3f to_local(Vec3f p) const { return {dot(p, right), dot(p, up), dot(p, towards)}; }
  Vec3f to_world(Vec3f p) const { return right * p.x + up * p.y + towards * p.z; }
};

/// The frame that looks against `towards` (length 1), upright where that is possible.
inline Frame frame_towards(Vec3f towards) {
  const Vec3f pole = std::abs(towards.y) < 0.999F ? Vec3f{0, 1, 0} : Vec3f{0, 0, towards.y > 0 ? -1.0F : 1.0F};
  const Vec3f right = normalised(cross(pole, towards));
  return {right, cross(towards, right), towards};
}

inline Frame frame_of(View view) {
  const auto radians = [](double degrees) { return degrees * std::numbers::pi / 180; };
  const double yaw = radians(view.yaw), pitch = radians(std::clamp(view.pitch, -90.0, 90.0));
  // The right vector comes from the yaw alone, so that looking straight down keeps its heading.
  const Vec3f right{static_cast<float>(std::cos(yaw)), 0, static_cast<float>(-std::sin(yaw))};
  const Vec3f towards{static_cast<float>(std::sin(yaw) * std::cos(pitch)), static_cast<float>(std::sin(pitch)),
                      static_cast<float>(std::cos(yaw) * std::cos(pitch))};
  return {right, cross(towards, right), towards};
}

/// A perspective camera: world to picture, x to the right and y down, in pixels.
struct Camera {
  Frame frame;
  Vec3f target;        ///< what the frame turns around
  float distance = 1;  ///< of the eye from the target
  float focal = 1;     ///< pixels at distance 1
  float centre_x = 0, centre_y = 0;

  Vec3f eye() const { return target + frame.towards * distance; }
  /// (x, y, nearness); nearness is 1 / depth, positive for everything before the eye, linear over the picture.
  Vec3f project(Vec3f p) const {
    const Vec3f q = frame.to_local(p - target);
    const float nearness = 1.0F / (distance - q.z);
    return {centre_x + focal * q.x * nearness, centre_y - focal * q.y * nearness, nearness};
  }
  /// The direction (not of length 1) in which the point (x, y) of the picture is seen.
  Vec3f ray(float x, float y) const { return frame.to_world({(x - centre_x) / focal, (centre_y - y) / focal, -1.0F}); }
};

/// The share of a panel's width and height that the figures fill.
inline constexpr float filled_share = 0.86F;

/// From where to where something reaches. Nothing so far: middle and size 0.
struct Range {
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();

  void add(float v) { low = std::min(low, v), high = std::max(high, v); }
  void add(Range r) { low = std::min(low, r.low), high = std::max(high, r.high); }
  float size() const { return high > low ? high - low : 0; }
  float middle() const { return high >= low ? 0.5F * (low + high) : 0; }
};

/// Figures as one camera sees them at focal length 1: all from the same place and direction, so that sizes compare. The
/// eye stands at 4.5 radii: as a portrait lens sees.
/// figures[i] are the points that panel i has to show; none for an empty panel.
struct Silhouettes {
  Camera camera;
  std::vector<Range> across, down;  ///< [figures]

  Silhouettes(std::span<const std::vector<Vec3f>> figures, View view) : across(figures.size()), down(figures.size()) {
    float top = 0, radius = 0;
    for (const auto& points : figures)
      for (Vec3f p : points) top = std::max(top, p.y);
    const Vec3f target{0, top / 2, 0};
    for (const auto& points : figures)
      for (Vec3f p : points) radius = std::max(radius, length(p - target));
    if (!(radius > 0)) radius = 1;
    camera = {frame_of(view), target, 4.5F * radius, 1, 0, 0};
    for (std::size_t i = 0; i < figures.size(); ++i)
      for (Vec3f p : figures[i]) {
        const Vec3f q = camera.project(p);
        across[i].add(q.x);
        down[i].add(q.y);
      }
  }

  /// The camera of panel i of this size, with a common ground line for all panels whose silhouettes lie in `row`.
  Camera of_panel(std::size_t i, float focal, Range row, int width, int height) const {
    Camera own = camera;
    own.focal = focal;
    own.centre_x = 0.5F * static_cast<float>(width) - focal * across[i].middle();
    own.centre_y = 0.5F * static_cast<float>(height) - focal * row.middle();
    return own;
  }
};

/// A figure of one point has no size; any focal length shows it.
inline float focal_for(float space, float size) { return space / std::max(size, 1e-6F); }

/// One camera for each panel: as large as fits in all of them.
inline std::vector<Camera> fit_cameras(std::span<const std::vector<Vec3f>> figures, View view, int width, int height) {
  const Silhouettes seen(figures, view);
  Range row;
  float widest = 0;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    row.add(seen.down[i]);
    widest = std::max(widest, seen.across[i].size());
  }
  // The border is the same all around.
  const float w = static_cast<float>(width), h = static_cast<float>(height),
              border = (1 - filled_share) * std::min(w, h);
  const float focal =
      std::min({focal_for(w - border, widest), focal_for(h - border, row.size()), 1e3F * std::max(w, h)});
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < figures.size(); ++i) cameras.push_back(seen.of_panel(i, focal, row, width, height));
  return cameras;
}

}  // namespace render
