/// PNG files.
#pragma once

#include <render/image.hpp>

#include <filesystem>
#include <vector>

namespace render {

/// The bytes of a PNG file: RGB, or RGBA where a pixel is not opaque.
std::vector<unsigned char> encode_png(const Image& image);

/// Writes the file as a whole or not at all.
/// Errors    npt::Error that names the file.
void write_png(const std::filesystem::path& path, const Image& image);

/// Errors    npt::Error that names the file, for any bytes that are no PNG file, or one of more than 32768 pixels a
///           side.
Image read_png(const std::filesystem::path& path);

}  // namespace render
