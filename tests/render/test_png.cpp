/// PNG files decode to the pixels that went in.
#include <doctest/doctest.h>

#include <render/png.hpp>

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/io/file.hpp>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

#include <filesystem>
#include <memory>

namespace {

render::Image random_image(int width, int height, bool opaque) {
  npt::Random random(7);
  render::Image image(width, height);
  for (render::Pixel& p : image.pixels) {
    const std::uint32_t bits = random();
    const auto byte = [bits](int shift) { return static_cast<std::uint8_t>(bits >> shift); };
    p = {byte(0), byte(8), byte(16), opaque ? std::uint8_t{255} : byte(24)};
  }
  return image;
}

}  // namespace

TEST_CASE("a PNG decodes to the same pixels, with and without alpha") {
  for (const bool opaque : {true, false})
    for (const auto& [width, height] : {std::pair{1, 1}, {37, 5}, {130, 64}}) {
      const render::Image image = random_image(width, height, opaque);
      const std::vector<unsigned char> png = render::encode_png(image);
      int w = 0, h = 0, channels = 0;
      const std::unique_ptr<stbi_uc, void (*)(void*)> decoded(
          stbi_load_from_memory(png.data(), static_cast<int>(png.size()), &w, &h, &channels, 4), stbi_image_free);
      REQUIRE(decoded);
      CHECK(w == width);
      CHECK(h == height);
      CHECK(channels == (opaque ? 3 : 4));
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const stbi_uc* p = decoded.get() + 4 * i;
        wrong += image.pixels[i] == render::Pixel{p[0], p[1], p[2], p[3]} ? 0U : 1U;
      }
      CHECK(wrong == 0);
    }
}

TEST_CASE("a PNG that can't be written is an error that names it, and leaves nothing") {
  const auto folder = std::filesystem::temp_directory_path() / "npt_test_png";
  std::filesystem::remove_all(folder);
  CHECK_THROWS_AS(render::write_png(folder / "a.png", random_image(4, 4, true)), npt::Error);
  std::filesystem::create_directories(folder / "taken.png");
  CHECK_THROWS_AS(render::write_png(folder / "taken.png", random_image(4, 4, true)), npt::Error);
  CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);
  render::write_png(folder / "b.png", random_image(4, 4, true));
  CHECK(npt::read_file(folder / "b.png").starts_with("\x89PNG"));
  std::filesystem::remove_all(folder);
}

TEST_CASE("a PNG file comes back as it was written; other bytes are an error that names the file") {
  const auto folder = std::filesystem::temp_directory_path() / "npt_test_png_read";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const render::Image image = random_image(17, 9, false);
  render::write_png(folder / "a.png", image);
  const render::Image read = render::read_png(folder / "a.png");
  CHECK(read.width == 17);
  CHECK(read.pixels == image.pixels);
  const std::string bytes = npt::read_file(folder / "a.png");
  for (std::size_t length = 0; length < bytes.size(); length += 7) {
    npt::write_file(folder / "b.png", std::string_view(bytes).substr(0, length));
    try {
      (void)render::read_png(folder / "b.png");
    } catch (const npt::Error& error) {
      CHECK(error.parts().file == (folder / "b.png").string());
    }
  }
  npt::write_file(folder / "b.png", "no picture");
  CHECK_THROWS_AS(render::read_png(folder / "b.png"), npt::Error);
  CHECK_THROWS_AS(render::read_png(folder / "none.png"), npt::Error);
  std::filesystem::remove_all(folder);
}

TEST_CASE("a smaller picture is made of means, weighted by alpha") {
  render::Image image(4, 2, {100, 0, 0, 255});
  image.at(2, 0) = image.at(3, 0) = {0, 200, 0, 255};
  image.at(2, 1) = image.at(3, 1) = {9, 9, 9, 0};
  const render::Image small = render::shrunk(image, 2, 1);
  CHECK(small.at(0, 0) == render::Pixel{100, 0, 0, 255});
  CHECK(small.at(1, 0) == render::Pixel{0, 200, 0, 128});
  CHECK(render::shrunk(image, 4, 2).pixels[0] == image.pixels[0]);
}
