#include <render/png.hpp>

#include <npt/io/file.hpp>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

#include <algorithm>
#include <new>
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

void write_png(const std::filesystem::path& path, const Image& image) {
  const std::vector<unsigned char> png = encode_png(image);
  npt::write_file(path, std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
}

}  // namespace render
