#include <render/png.hpp>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STBI_NO_LINEAR
#define STBI_NO_HDR
#define STBI_MAX_DIMENSIONS 32768
#include <stb/stb_image.h>
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <string_view>

namespace render {

std::vector<unsigned char> encode_png(const Image& image) {
  const bool opaque = std::ranges::all_of(image.pixels, [](Pixel p) { return p.a == 255; });
  std::vector<unsigned char> bytes;
  bytes.reserve(image.pixels.size() * (opaque ? 3 : 4));
  for (Pixel p : image.pixels) {
    bytes.insert(bytes.end(), {p.r, p.g, p.b});
    if (!opaque) bytes.push_back(p.a);
  }
  const int channels = opaque ? 3 : 4;
  int length = 0;
  unsigned char* png =
      stbi_write_png_to_mem(bytes.data(), image.width * channels, image.width, image.height, channels, &length);
  if (png == nullptr) throw std::bad_alloc();
  std::vector<unsigned char> result(png, png + length);
  STBIW_FREE(png);
  return result;
}

std::string deflate(std::string_view bytes) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw npt::Error({"deflate", {}, std::to_string(bytes.size()) + " bytes", "less than 2 GiB"});
  // stb takes bytes that it doesn't change as unsigned char*.
  std::string copy(bytes);
  int length = 0;
  constexpr int effort = 8;
  unsigned char* stream =
      stbi_zlib_compress(reinterpret_cast<unsigned char*>(copy.data()), static_cast<int>(copy.size()), &length, effort);
  if (stream == nullptr) throw std::bad_alloc();
  std::string result(reinterpret_cast<const char*>(stream), static_cast<std::size_t>(length));
  STBIW_FREE(stream);
  return result;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  const std::vector<unsigned char> png = encode_png(image);
  npt::write_file(path, std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
}

Image read_png(const std::filesystem::path& path) {
  const std::string bytes = npt::read_file(path);
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw npt::Error({path.string(), {}, std::to_string(bytes.size()) + " bytes", "a picture of less than 2 GiB"});
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, channels = 0;
  const std::unique_ptr<unsigned char, void (*)(void*)> pixels(
      stbi_load_from_memory(data, static_cast<int>(bytes.size()), &width, &height, &channels, 4), stbi_image_free);
  if (!pixels) throw npt::Error({path.string(), {}, stbi_failure_reason(), "a PNG file"});
  Image image(width, height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const unsigned char* p = pixels.get() + 4 * i;
    image.pixels[i] = {p[0], p[1], p[2], p[3]};
  }
  return image;
}

}  // namespace render
