/// The page as a file: what it holds, how large it is, and what it refuses.
#include <doctest/doctest.h>

#include <view/embedded.hpp>
#include <view/page.hpp>

#include <npt/base/error.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/mesh/triangles.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

#include "view/decoding.hpp"

namespace {

/// A tent: a quad and two triangles.
npt::Mesh tent() {
  npt::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5F, 1, 0.5F}};
  mesh.face_start = {0, 4, 7, 10};
  mesh.corners = {0, 1, 2, 3, 0, 1, 4, 2, 3, 4};
  return mesh;
}

view::Page page_of(view::Panel panel) {
  view::Page page;
  page.title = "a <title> & more";
  page.groups.push_back({"", {}});
  page.groups[0].panels.push_back(std::move(panel));
  return page;
}

std::string_view between(std::string_view text, std::string_view open, std::string_view close) {
  const std::size_t first = text.find(open);
  REQUIRE(first != std::string_view::npos);
  text.remove_prefix(first + open.size());
  return text.substr(0, text.find(close));
}

nlohmann::json scene_of(std::string_view text) {
  return nlohmann::json::parse(between(text, "id=\"scene\">", "</script>"));
}

/// A chunk as the page unpacks it.
std::string chunk_of(std::string_view text, int number) {
  const std::string open = "data-chunk=\"" + std::to_string(number) + "\"";
  std::string_view rest = text.substr(text.find(open) + open.size());
  const bool deflated = rest.starts_with(" data-deflated=\"deflate\"");
  const std::string bytes = decoding::from_base64(between(rest, ">", "</script>"));
  if (!deflated) return bytes;
  int size = 0;
  const std::unique_ptr<char, void (*)(void*)> unpacked(
      stbi_zlib_decode_malloc(bytes.data(), static_cast<int>(bytes.size()), &size), stbi_image_free);
  REQUIRE(unpacked != nullptr);
  return {unpacked.get(), static_cast<std::size_t>(size)};
}

npt::Mesh body(float bend) {
  const npt::BodyModel& model = npt::mannequin();
  std::vector<float> angles(3 * model.joint_count(), 0.0F);
  angles[5] = bend;
  return npt::to_mesh(model, {}, angles);
}

}  // namespace

TEST_CASE("the program holds the page's files and three.js") {
  CHECK(view::page_html().starts_with("<!doctype html>"));
  CHECK(view::base_style().find("#stage") != std::string_view::npos);
  CHECK(view::page_style().find("#message") != std::string_view::npos);
  CHECK(view::stage_script().find("const npt = ") != std::string_view::npos);
  CHECK(view::page_script().find("DecompressionStream") != std::string_view::npos);
  CHECK(view::three_gzip().starts_with("\x1f\x8b"));
  CHECK(view::three_gzip().size() > 100000);
  CHECK(view::three_gzip().size() < 250000);
  // Scripts stand in elements.
  for (const std::string_view script : {view::stage_script(), view::page_script()})
    CHECK(script.find("</script") == std::string_view::npos);
}

TEST_CASE("a mesh comes back from its page: positions, faces, sides within faces, colours") {
  npt::Mesh mesh = tent();
  for (const char* name : {"red", "green", "blue"}) mesh.properties.push_back({name, "uchar", {0, 50, 100, 200, 255}});
  const std::string text = view::page_text(page_of(view::mesh_panel("tent", mesh)));
  const nlohmann::json scene = scene_of(text);
  const nlohmann::json& panel = scene["groups"][0]["panels"][0];
  CHECK(panel["caption"] == "tent");
  CHECK(panel["detail"] == "5 vertices");
  const nlohmann::json& m = panel["mesh"];
  CHECK(m["vertices"] == 5);
  CHECK(m["triangles"] == 4);
  CHECK(m["frames"] == 1);
  const auto corners = decoding::indices(chunk_of(text, m["faces"]), 12, m["planes"]);
  CHECK(corners == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3, 0, 1, 4, 2, 3, 4});
  // The quad's diagonal 2-0 of the first triangle, 0-2 of the second.
  CHECK(chunk_of(text, m["inner"]) == std::string("\x04\x01\x00\x00", 4));
  CHECK(chunk_of(text, m["colours"]) == std::string("\0\0\0\x32\x32\x32\x64\x64\x64\xc8\xc8\xc8\xff\xff\xff", 15));
  const std::vector<std::vector<npt::Vec3f>> frames{mesh.positions};
  const view::Box box = view::box_of(frames);
  const auto positions = decoding::positions(chunk_of(text, m["positions"]), 5, 1, box);
  for (std::size_t v = 0; v < 5; ++v) CHECK(npt::length(positions[0][v] - mesh.positions[v]) < 1e-4F);
  CHECK(scene["heat"].is_null());
}

TEST_CASE("texts can't break out of their place") {
  view::Page page = page_of(view::mesh_panel("</script><script>alert(1)</script> \"quoted\" \xff", tent()));
  page.groups[0].caption = "<b>";
  const std::string text = view::page_text(page);
  CHECK(text.find("alert(1)</script>") == std::string::npos);
  CHECK(text.find("<title>a &lt;title&gt; &amp; more</title>") != std::string::npos);
  CHECK(scene_of(text)["groups"][0]["panels"][0]["caption"] == "</script><script>alert(1)</script> \"quoted\" ?");
  CHECK(text.find("{{") == std::string::npos);
}

TEST_CASE("a page names no other file and no address that it would fetch") {
  const std::string text = view::page_text(page_of(view::mesh_panel("tent", tent())));
  CHECK(text.find("default-src 'none'") != std::string::npos);
  for (const char* word : {" src=", "href=", "@import", "url("})
    CHECK_MESSAGE(text.find(word) == std::string::npos, word);
}

TEST_CASE("a pair of 6890 vertices takes half a megabyte, a sequence less than its positions") {
  view::Page page = page_of(view::mesh_panel("identity", body(0)));
  page.groups[0].panels.push_back(view::mesh_panel("pose", body(0.5F)));
  const std::size_t pair = view::page_text(page).size();
  MESSAGE("a pair: " << pair << " bytes");
  CHECK(pair < 600000);
  constexpr std::size_t frames = 20;
  for (std::size_t f = 1; f < frames; ++f)
    view::add_frame(page.groups[0].panels[1], body(0.5F + 0.02F * static_cast<float>(f)), "frame");
  const std::size_t sequence = view::page_text(page).size();
  MESSAGE("with " << frames << " frames: " << sequence << " bytes");
  CHECK(sequence - pair < (frames - 1) * 6890 * 6);
}

TEST_CASE("errors are millimetres with boxes centred, on one scale for all groups") {
  npt::Mesh moved = tent();
  for (npt::Vec3f& p : moved.positions) p.x += 3;
  view::Panel panel = view::mesh_panel("result", moved);
  view::add_errors(panel, tent(), "result", "truth");
  for (const double e : panel.errors[0]) CHECK(e < 1e-3);
  moved.positions[0].y += 0.0199F;
  panel = view::mesh_panel("result", moved);
  view::add_errors(panel, tent(), "result", "truth");
  CHECK(panel.errors[0][0] == doctest::Approx(19.9).epsilon(1e-3));
  const std::string text = view::page_text(page_of(panel));
  const nlohmann::json scene = scene_of(text), mesh = scene["groups"][0]["panels"][0]["mesh"];
  CHECK(scene["heat"]["high"] == 20);
  CHECK(scene["heat"]["colours"].size() == 33);
  const auto errors = decoding::values(chunk_of(text, mesh["errors"]), 5, 1, mesh["error_high"]);
  CHECK(errors[0][0] == doctest::Approx(19.9).epsilon(1e-3));
  CHECK(errors[0][1] < 0.01);
  npt::Mesh other = tent();
  other.positions.pop_back();
  CHECK_THROWS_WITH_AS(view::add_errors(panel, other, "r.ply", "t.ply"),
                       "r.ply: found 5 vertices, expected 4 as in t.ply", npt::Error);
}

TEST_CASE("what can't be shown is refused") {
  CHECK_THROWS_AS(view::page_text({}), npt::Error);
  view::Page empty;
  empty.groups.push_back({"", {}});
  CHECK_THROWS_AS(view::page_text(empty), npt::Error);
  CHECK_THROWS_WITH_AS(view::page_text(page_of(view::mesh_panel("none", npt::Mesh{}))),
                       "none: found a mesh without vertices, expected one to show", npt::Error);
  view::Panel panel = view::mesh_panel("tent", tent());
  npt::Mesh other = tent();
  other.corners[0] = 4;
  CHECK_THROWS_WITH_AS(view::add_frame(panel, other, "2.ply"),
                       "2.ply: found other faces, expected those of the sequence's first frame", npt::Error);
  other.positions.emplace_back();
  CHECK_THROWS_WITH_AS(view::add_frame(panel, other, "2.ply"),
                       "2.ply: found 6 vertices, expected 5, as in the sequence's first frame", npt::Error);
}

TEST_CASE("z up is turned to y up, and a mesh without faces is a cloud") {
  npt::Mesh points;
  points.positions = {{0, 0, 0}, {1, 2, 3}};
  view::Page page = page_of(view::mesh_panel("cloud", points));
  page.z_up = true;
  const nlohmann::json mesh = scene_of(view::page_text(page))["groups"][0]["panels"][0]["mesh"];
  CHECK(mesh["triangles"] == 0);
  CHECK(mesh["high"] == nlohmann::json{1, 3, 0});
  CHECK(mesh["low"] == nlohmann::json{0, 0, -2});
}
