/// Captions.
#include <doctest/doctest.h>

#include <render/text.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace {

render::Image written(const std::string& text, double size = 24) {
  render::Image image(200, 60, {255, 255, 255, 255});
  render::draw_text(image, text, 20, 40, size, {0, 0, 0, 255});
  return image;
}

}  // namespace

TEST_CASE("every printable character but the blank leaves ink, inside of its width, and no two look the same") {
  const render::Image blank = written(" ");
  std::set<std::string> pictures;
  for (char c = 33; c < 127; ++c) {
    const std::string text(1, c);
    const render::Image image = written(text);
    std::string shades;
    int left = 200, right = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        shades.push_back(static_cast<char>(image.at(x, y).r));
        if (image.at(x, y).r < 250) left = std::min(left, x), right = std::max(right, x);
      }
    INFO(text);
    CHECK_FALSE(image.pixels == blank.pixels);
    CHECK(left >= 17);
    CHECK(right <= 20 + render::text_width(text, 24) + 3);
    CHECK(pictures.insert(shades).second);
  }
}

TEST_CASE("a text is as wide as its letters, kerned; another character counts once; twice the size is twice as wide") {
  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-9; };
  CHECK(render::text_width("", 20) == 0);
  CHECK(near(render::text_width("ab", 20), render::text_width("a", 20) + render::text_width("b", 20)));
  CHECK(render::text_width("AV", 20) < render::text_width("A", 20) + render::text_width("V", 20) - 0.5);
  CHECK(render::text_width(" ", 20) > 3);
  CHECK(near(render::text_width("a\xC3\xA9"
                                "b",
                                20),
             render::text_width("a?b", 20)));
  CHECK(near(render::text_width("caption", 40), 2 * render::text_width("caption", 20)));
}

TEST_CASE("capitals stand on the baseline and are five eighths of a line high") {
  const render::Image image = written("H", 48);
  int top = 60, bottom = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (image.at(x, y).r < 128) top = std::min(top, y), bottom = std::max(bottom, y);
  CHECK(bottom == 39);
  CHECK(top == 10);
}

TEST_CASE("text is blended with what is under it") {
  render::Image image(40, 40, {0, 0, 255, 255});
  render::draw_text(image, "H", 5, 35, 40, {255, 0, 0, 128});
  CHECK(std::ranges::count(image.pixels, render::Pixel{128, 0, 127, 255}) > 50);
}

TEST_CASE("text that runs out of the picture is cut off") {
  render::Image image(20, 20, {255, 255, 255, 255});
  render::draw_text(image, "far outside", -500, 10, 15, {0, 0, 0, 255});
  render::draw_text(image, "far outside", 5, 900, 15, {0, 0, 0, 255});
  render::draw_text(image, "far outside", 1e300, 10, 15, {0, 0, 0, 255});
  render::draw_text(image, "far outside", 5, NAN, 15, {0, 0, 0, 255});
  CHECK(image.pixels == render::Image(20, 20, {255, 255, 255, 255}).pixels);
  render::draw_text(image, "wwwwwwwwwwww", -10, 15, 15, {0, 0, 0, 255});
  CHECK_FALSE(image.pixels == render::Image(20, 20, {255, 255, 255, 255}).pixels);
}
