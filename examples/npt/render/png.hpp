/// PNG files.
#pragma once

#include <render/image.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace render {

/// The bytes of a PNG file: RGB, or RGBA where a pixel is not opaque.
std::vector<unsigned char> encode_png(const Image& image);

/// A zlib stream (RFC 1950), as PNG files have them inside.
/// Errors    npt::Error for 2 GiB and more
std::string deflate(std::string_view bytes);

/// Writes the file as a whole or not at all.
/// Errors    npt::Error that names the file.
void write_png(const std::filesystem::path& path, const Image& image);

/// Errors    npt::Error that names the file, for any bytes that are no PNG file, or one of more than 32768 pixels a
///           side.
Image read_png(const std::filesystem::path& path);

}  // namespace render
