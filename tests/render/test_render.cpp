/// Pictures: sizes are right, near hides far, bad input is an error, the same input is the same picture.
#include <doctest/doctest.h>

#include <render/render.hpp>
#include <render/shapes.hpp>

#include <npt/base/error.hpp>

#if NPT_HAS_TBB
#include <tbb/global_control.h>
#endif

#include <cmath>
#include <vector>

namespace {

using render::Colour;
using render::Image;
using render::Panel;

constexpr Colour red{1, 0, 0}, blue{0, 0, 1};

render::FigureOptions small_figure() {
  render::FigureOptions options;
  options.panel_width = 160;
  options.panel_height = 160;
  options.view = {0, 0};
  options.samples = 3;
  options.floor_shadow = false;
  options.shadow_cells = 64;  // a panel of 448 takes 0.3 s
  return options;
}

Image draw(const npt::Mesh& mesh, const render::FigureOptions& options, std::vector<Colour> colours = {}) {
  const Panel panel{&mesh, {}, std::move(colours)};
  return render::draw_figure(std::span(&panel, 1), options);
}

double covered(const Image& image) {
  double sum = 0;
  for (render::Pixel p : image.pixels) sum += p.a / 255.0;
  return sum;
}

}  // namespace

TEST_CASE("a sphere's silhouette is the disc that perspective makes of it") {
  render::FigureOptions options = small_figure();
  options.backdrop = render::Backdrop::transparent;
  const Image image = draw(shapes::sphere(1), options);
  // It fills the panel as the fit says; its area is that of a circle.
  const double radius = 0.5 * double{render::filled_share} * 160, area = 3.14159265 * radius * radius;
  CHECK(std::abs(covered(image) - area) < 0.01 * area);
  int left = 160, right = -1;
  for (int x = 0; x < 160; ++x)
    if (image.at(x, 80).a > 127) left = std::min(left, x), right = std::max(right, x);
  CHECK(std::abs(right - left + 1 - 2 * radius) <= 2);
}

TEST_CASE("panels of a row share their scale, panels of two rows don't") {
  const npt::Mesh large = shapes::sphere(2), small = shapes::sphere(1);
  const std::vector<Panel> panels{{&large, {}, {}}, {&small, {}, {}}};
  render::FigureOptions options = small_figure();
  options.backdrop = render::Backdrop::transparent;
  const auto ratio = [](const Image& image, bool below) {
    double parts[2] = {0, 0};
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) parts[(below ? y : x) / 160] += image.at(x, y).a / 255.0;
    return parts[0] / parts[1];
  };
  // Not exactly 4: the small sphere stands on the same ground, farther below the eye.
  const double in_row = ratio(render::draw_figure(panels, options), false);
  CHECK(in_row > 3.5);
  CHECK(in_row < 4.5);
  options.columns = 1;
  const double in_column = ratio(render::draw_figure(panels, options), true);
  CHECK(std::abs(in_column - 1) < 0.01);
}

TEST_CASE("the nearer triangle wins, in any order of the faces") {
  for (const bool red_first : {true, false}) {
    npt::Mesh mesh = shapes::square(1, red_first ? 0.5F : -0.5F);
    const npt::Mesh other = shapes::square(1, red_first ? -0.5F : 0.5F);
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    mesh.corners.insert(mesh.corners.end(), {4, 5, 6, 7});
    mesh.face_start.push_back(8);
    std::vector<Colour> colours(4, red);
    colours.insert(colours.end(), 4, blue);
    const render::Pixel p = draw(mesh, small_figure(), colours).at(80, 80);
    CHECK((p.r > p.b) == red_first);
  }
}

TEST_CASE("a surface is lit from both sides") {
  render::FigureOptions options = small_figure();
  const npt::Mesh mesh = shapes::square(1, 0);
  for (const double yaw : {0.0, 180.0}) {
    options.view = {yaw, 0};
    CHECK(draw(mesh, options, {Colour{1, 1, 1}}).at(80, 80).g > 120);
  }
}

TEST_CASE("points without faces are drawn") {
  npt::Mesh cloud = shapes::sphere(1);
  cloud.face_start.clear();
  cloud.corners.clear();
  render::FigureOptions options = small_figure();
  options.backdrop = render::Backdrop::transparent;
  CHECK(covered(draw(cloud, options)) > 0.5 * 3.14 * 69 * 69);
  cloud.positions.resize(1);
  CHECK(covered(draw(cloud, options)) > 0);
}

TEST_CASE("vertices that no face uses don't shrink the figure") {
  npt::Mesh mesh = shapes::sphere(1);
  const Image image = draw(mesh, small_figure());
  mesh.positions.push_back({1000, 5, 3});
  CHECK(draw(mesh, small_figure()).pixels == image.pixels);
}

TEST_CASE("where a mesh stands, and how large it is, does not matter") {
  const Image image = draw(shapes::sphere(1), small_figure());
  for (const auto& [radius, centre] : {std::pair{1e-20F, npt::Vec3f{}}, {1e30F, {}}, {1.0F, {512, -2048, 64}}}) {
    const Image other = draw(shapes::sphere(radius, centre), small_figure());
    std::size_t different = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      different += std::abs(image.pixels[i].r - other.pixels[i].r) > 3 ? 1U : 0U;
    CHECK(different < image.pixels.size() / 200);
  }
}

TEST_CASE("the same input gives the same picture, on one thread and on several") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 20);
  render::FigureOptions options = small_figure();
  options.floor_shadow = true;
  const Image image = draw(mesh, options);
  CHECK(draw(mesh, options).pixels == image.pixels);
#if NPT_HAS_TBB
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  CHECK(draw(mesh, options).pixels == image.pixels);
#endif
}

TEST_CASE("the floor's shadow darkens the page around the feet and nothing else") {
  render::FigureOptions options = small_figure();
  options.view = {0, 20};
  const npt::Mesh mesh = shapes::sphere(1);
  const Image without = draw(mesh, options);
  options.floor_shadow = true;
  const Image with = draw(mesh, options);
  std::size_t darker = 0, brighter = 0;
  for (std::size_t i = 0; i < with.pixels.size(); ++i) {
    darker += with.pixels[i].g < without.pixels[i].g ? 1U : 0U;
    brighter += with.pixels[i].g > without.pixels[i].g ? 1U : 0U;
  }
  CHECK(darker > 300);
  CHECK(brighter == 0);
  CHECK(with.at(0, 0) == render::Pixel{255, 255, 255, 255});
}

TEST_CASE("a caption and a colour bar add to the picture's height and are seen") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 12);
  render::FigureOptions options = small_figure();
  const auto picture = [&](const char* caption) {
    const Panel panel{&mesh, caption, {}};
    return render::draw_figure(std::span(&panel, 1), options);
  };
  const Image plain = picture(""), one = picture("one"), two = picture("two"), lines = picture("one\ntwo");
  CHECK(plain.height == 160);
  CHECK(one.height > 165);
  CHECK(lines.height > one.height);
  CHECK(two.height == one.height);
  CHECK_FALSE(two.pixels == one.pixels);
  options.colour_bar = {0, 1, "millimetres"};
  CHECK(picture("one").height > one.height + 20);
}

TEST_CASE("what can't be drawn is an error") {
  const npt::Mesh empty, mesh = shapes::square(1, 0);
  CHECK_THROWS_AS(draw(empty, small_figure()), npt::Error);
  CHECK_THROWS_AS(draw(mesh, small_figure(), std::vector<Colour>(3, red)), npt::Error);
  CHECK_THROWS_AS(render::draw_figure({}, small_figure()), npt::Error);
  render::FigureOptions options = small_figure();
  options.panel_width = 4;
  CHECK_THROWS_AS(draw(mesh, options), npt::Error);
  options.panel_width = 8192;
  const std::vector<Panel> many(3, Panel{&mesh, {}, {}});
  CHECK_THROWS_AS(render::draw_figure(many, options), npt::Error);
}

TEST_CASE("a mesh whose vertices all lie in one point, or whose faces have no area, is drawn as nothing or a dot") {
  const npt::Mesh point = shapes::mesh({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}});
  CHECK(draw(point, small_figure()).width == 160);
  const npt::Mesh line = shapes::mesh({{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}, {{0, 1, 2}});
  CHECK(draw(line, small_figure()).width == 160);
}

TEST_CASE("colours are read as names and hexadecimal numbers, others are refused") {
  CHECK(render::to_pixel(render::parse_colour("#9db7d5", "--colours")) == render::Pixel{0x9D, 0xB7, 0xD5, 255});
  CHECK(render::to_pixel(render::parse_colour("white", "--colours")) == render::Pixel{255, 255, 255, 255});
  for (const char* bad : {"", "#12345", "#12345g", "no colour", "9db7d5"})
    CHECK_THROWS_AS(render::parse_colour(bad, "--colours"), npt::Error);
}

namespace {

/// Pixels that differ from the page, in a rectangle.
int inked(const Image& image, int left, int top, int right, int bottom) {
  int count = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) count += image.at(x, y) == render::Pixel{255, 255, 255, 255} ? 0 : 1;
  return count;
}

render::FigureOptions small_grid(int columns) {
  render::FigureOptions options = render::grid_figure(columns, 120);
  options.view = {0, 0};
  options.samples = 2;
  options.floor_shadow = false;
  options.shadow_cells = 64;
  return options;
}

}  // namespace

TEST_CASE("a grid's columns and rows are as large as their figures need, at one scale") {
  const npt::Mesh large = shapes::sphere(2, {}, 12), small = shapes::sphere(1, {}, 12);
  const std::vector<Panel> panels{{&large, {}, {}}, {&small, {}, {}}, {&small, {}, {}}, {&small, {}, {}}};
  render::FigureOptions options = small_grid(2);
  options.gap = 0;
  const Image image = render::draw_figure(panels, options);
  // Column 0 holds the large sphere, column 1 small ones; row 1 holds small ones.
  CHECK(std::abs(image.width - (120 + 66)) <= 4);
  CHECK(std::abs(image.height - (120 + 66)) <= 4);
  // The small spheres of both rows have one size.
  options.backdrop = render::Backdrop::transparent;
  const Image clear = render::draw_figure(panels, options);
  const auto cover = [&clear](int left, int top, int right, int bottom) {
    double sum = 0;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) sum += clear.at(x, y).a / 255.0;
    return sum;
  };
  const double beside = cover(120, 0, clear.width, 120), below = cover(120, 120, clear.width, clear.height);
  CHECK(std::abs(beside - below) < 0.05 * below);
  options.one_scale = false;
  CHECK(render::draw_figure(panels, options).height > image.height + 30);  // row 1 is as high as row 0 then
}

TEST_CASE("row and column captions stand outside of the panels") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 12);
  const std::vector<Panel> panels(4, Panel{&mesh, {}, {}});
  render::FigureOptions options = small_grid(2);
  const Image plain = render::draw_figure(panels, options);
  options.column_captions = {"one", "two"};
  const Image columns = render::draw_figure(panels, options);
  const int top = columns.height - plain.height;
  CHECK(columns.width == plain.width);
  CHECK(top > 8);
  CHECK(inked(columns, 0, 0, plain.width / 2, top) > 10);
  CHECK(inked(columns, plain.width / 2, 0, plain.width, top) > 10);
  options.row_captions = {"three", ""};
  const Image both = render::draw_figure(panels, options);
  const int left = both.width - plain.width;
  CHECK(left > 8);
  CHECK(both.height == columns.height);
  CHECK(inked(both, 0, top, left, top + plain.height / 2) > 10);
  CHECK(inked(both, 0, top + plain.height / 2, left, both.height) == 0);
  // The panels themselves are the same.
  for (int y = 0; y < plain.height; ++y)
    for (int x = 0; x < plain.width; ++x) REQUIRE(both.at(left + x, top + y) == plain.at(x, y));
  options.row_captions = {"one", "two", "three"};
  CHECK_THROWS_AS(render::draw_figure(panels, options), npt::Error);
}

TEST_CASE("panels may be pictures or empty; a picture is shrunk to fit and lies over the page") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 12);
  const Image red_picture(300, 150, {255, 0, 0, 255}), clear_picture(10, 10, {0, 0, 255, 0});
  std::vector<Panel> panels(4);
  panels[0].mesh = &mesh;
  panels[1].picture = &red_picture;
  panels[2].picture = &clear_picture;
  render::FigureOptions options = small_figure();
  const Image image = render::draw_figure(panels, options);
  CHECK(image.width == 640);
  CHECK(image.at(160 + 80, 80) == render::Pixel{255, 0, 0, 255});
  CHECK(image.at(160 + 80, 80 - 45) == render::Pixel{255, 255, 255, 255});
  CHECK(inked(image, 160, 0, 320, 160) == 160 * 80);
  CHECK(inked(image, 320, 0, 640, 160) == 0);
  const Image tight = render::draw_figure(panels, small_grid(4));
  CHECK(tight.width > 240 + 100);
  panels[0].picture = &red_picture;
  CHECK_THROWS_AS(render::draw_figure(panels, options), npt::Error);
  const std::vector<Panel> none(3);
  CHECK(inked(render::draw_figure(none, options), 0, 0, 480, 160) == 0);
  CHECK_NOTHROW(render::draw_figure(none, small_grid(2)));
}

TEST_CASE("a scale of errors has numbers, and a sign for what lies beyond") {
  const npt::Mesh mesh = shapes::sphere(1, {}, 12);
  const Panel panel{&mesh, {}, {}};
  const auto with = [&](render::ColourBar bar) {
    render::FigureOptions options = small_figure();
    options.colour_bar = std::move(bar);
    return render::draw_figure(std::span(&panel, 1), options);
  };
  const Image closed = with({0, 80, "mm", false}), open = with({0, 80, "mm", true}), other = with({0, 40, "mm", false});
  CHECK(closed.height == open.height);
  CHECK_FALSE(closed.pixels == open.pixels);
  CHECK_FALSE(closed.pixels == other.pixels);
  // From light to dark along the bar.
  const int y = 160 + 10;
  int darkest = 255 * 3;
  for (int x = 20; x < 140; x += 10) {
    const render::Pixel p = closed.at(x, y);
    if (p == render::Pixel{255, 255, 255, 255}) continue;
    CHECK(p.r + p.g + p.b <= darkest);
    darkest = p.r + p.g + p.b;
  }
  CHECK(darkest < 300);
}

TEST_CASE("even light takes the shading off colours") {
  const npt::Mesh mesh = shapes::sphere(1);
  const auto spread = [&](double even_light) {
    Panel panel{&mesh, {}, {Colour{0.5F, 0.5F, 0.5F}}};
    panel.even_light = even_light;
    const Image image = render::draw_figure(std::span(&panel, 1), small_figure());
    int low = 255, high = 0;
    for (int y = 40; y < 120; ++y)
      low = std::min<int>(low, image.at(80, y).g), high = std::max<int>(high, image.at(80, y).g);
    return high - low;
  };
  CHECK(spread(render::data_light) < 0.7 * spread(0));
  CHECK(spread(1) <= 3);
}
