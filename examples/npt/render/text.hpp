/// Captions: printable ASCII in DejaVu Sans, drawn smoothly at any size.
#pragma once

#include <render/image.hpp>

#include <string_view>

namespace render {

/// Width of the text in pixels when lines are `size` pixels high.
double text_width(std::string_view text, double size);

/// Draws one line of text over the picture; (x, baseline) is where its first letter stands. Bytes that are not
/// printable ASCII appear as '?', one for each character of UTF-8.
void draw_text(Image& image, std::string_view text, double x, double baseline, double size, Pixel colour);

}  // namespace render
