/// The lights of the picture, and how much of them reaches a point.
///
/// All light comes from a fixed set of distant lamps: a warm key as a disc of directions from the viewer's upper left,
/// a cool fill from the right, a rim from behind, a dome of sky and the light that the floor returns. Each lamp has a
/// depth map of the figure; the sum over the lamps of one disc is a soft shadow, over the dome ambient occlusion. The
/// lamps turn with the viewer, so a view from behind is lit as well as one from the front.
#pragma once

#include <render/camera.hpp>
#include <render/colour.hpp>
#include <render/surface.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace render {

struct Lamp {
  Vec3f direction;  ///< towards the lamp, length 1
  Colour power;     ///< what a white surface that faces it sends back
  float gloss = 0;  ///< share of the power that makes highlights
};

std::vector<Lamp> studio_lamps(double viewer_yaw);

/// A point that asks for light.
struct ShadePoint {
  Vec3f position;
  Vec3f normal;
  Vec3f to_eye;  ///< length 1
};

struct Light {
  Colour diffuse;   ///< to be multiplied by the surface's colour
  Colour specular;  ///< to be added
};

/// What arrives at each point, with the figure's shadows on itself and on what is around it, from shadow maps of
/// shadow_cells x shadow_cells. A fixed order of sums: the result does not depend on the number of threads.
std::vector<Light> gather_light(const Figure& figure, std::span<const Lamp> lamps, std::span<const ShadePoint> points,
                                int shadow_cells);

/// The floor's brightness around a figure, 0 .. 1 where 1 is no shadow, as a square map. Its points are to be lit
/// together with the figure's own, because the lamps' depth maps are the costly part.
class FloorShadow {
 public:
  explicit FloorShadow(const Figure& figure);
  std::vector<ShadePoint> points() const;
  void set_light(std::span<const Light> light, std::span<const Lamp> lamps);
  /// Fades with the distance from the figure, so that the shadow ends in the page.
  float at(float x, float z) const;

 private:
  static constexpr int size_ = 160;
  float extent_ = 1;
  std::vector<float> brightness_;  ///< [size_ * size_]
};

}  // namespace render
