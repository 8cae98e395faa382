/// One panel of a figure: visible surface, light, shadow on the floor.
#pragma once

#include <render/camera.hpp>
#include <render/image.hpp>
#include <render/render.hpp>
#include <render/surface.hpp>

namespace render {

inline constexpr int most_samples = 8;

/// panel_width x panel_height pixels. Requires a figure that isn't empty.
Image paint_panel(const Figure& figure, const Camera& camera, const FigureOptions& options);

}  // namespace render
