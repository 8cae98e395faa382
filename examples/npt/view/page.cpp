#include <view/page.hpp>

#include <render/data_colours.hpp>
#include <render/png.hpp>
#include <render/surface.hpp>
#include <view/embedded.hpp>

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/io/file.hpp>
#include <npt/io/json.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <span>
#include <string_view>
#include <utility>

namespace view {

namespace {

using npt::Triangle;

/// The page's numbers, each content once.
class Chunks {
 public:
  std::size_t add(const std::string& bytes) {
    const auto [found, fresh] = numbers_.emplace(bytes, numbers_.size());
    if (!fresh) return found->second;
    const std::string deflated = render::deflate(bytes), name = std::to_string(found->second);
    if (deflated.size() < bytes.size())
      append(name, deflated, "deflate");
    else
      append(name, bytes);
    return found->second;
  }
  /// `format`: what unpacks the bytes: deflate or gzip; empty: they are as they are.
  void append(const std::string& name, std::string_view bytes, const std::string& format = {}) {
    text_ += "<script type=\"text/plain\" data-chunk=\"" + name + "\"" +
             (format.empty() ? "" : " data-deflated=\"" + format + "\"") + ">" + base64(bytes) + "</script>\n";
    if (text_.size() > largest_page)
      throw npt::Error({"page",
                        {},
                        "more than " + std::to_string(largest_page >> 20) + " MB",
                        "less: fewer frames, fewer pairs or smaller meshes"});
  }
  const std::string& text() const { return text_; }

 private:
  std::map<std::string, std::size_t> numbers_;
  std::string text_;
};

/// Text for a place in HTML that isn't a script.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

/// JSON that may stand in an element of a page: without `<`. Bytes that are no UTF-8 become question marks.
std::string json_string(std::string_view text) {
  std::string valid;
  while (!text.empty()) {
    const std::size_t length = npt::internal::utf8_length(text);
    valid += length == 0 ? std::string_view("?") : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(1, length));
  }
  std::string json, result;
  npt::internal::append_json_string(json, valid);
  for (const char c : json) result += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return result;
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}
std::string list(Vec3f p) {
  return "[" + number(static_cast<double>(p.x)) + "," + number(static_cast<double>(p.y)) + "," +
         number(static_cast<double>(p.z)) + "]";
}
std::string hex(render::Colour colour) {
  const render::Pixel p = render::to_pixel(colour);
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", p.r, p.g, p.b);
  return text;
}

/// A bit for each side of a triangle that lies within a face of the file; empty where all faces are triangles.
std::string inner_sides(const npt::Mesh& mesh) {
  std::string bits;
  bool any = false;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::size_t size = mesh.face(f).size();
    for (std::size_t i = 1; i + 1 < size; ++i) {  // the triangle 0, i, i + 1
      const int first = i > 1 ? 1 : 0, last = i + 2 < size ? 4 : 0;
      bits += static_cast<char>(first | last);
      any = any || first != 0 || last != 0;
    }
  }
  return any ? bits : std::string();
}

std::string colour_bytes(const npt::Mesh& mesh) {
  std::string bytes;
  for (const render::Colour colour : render::vertex_colours(mesh)) {
    const render::Pixel p = render::to_pixel(colour);
    for (const std::uint8_t channel : {p.r, p.g, p.b}) bytes += static_cast<char>(channel);
  }
  return bytes;
}

double largest_error(const Panel& panel) {
  double largest = 0;
  for (const std::vector<double>& frame : panel.errors)
    for (const double e : frame)
      if (std::isfinite(e)) largest = std::max(largest, e);
  return largest;
}

/// Frames with z for y.
std::vector<std::vector<Vec3f>> upright(std::vector<std::vector<Vec3f>> frames) {
  for (std::vector<Vec3f>& frame : frames)
    for (Vec3f& p : frame) p = {p.x, p.z, -p.y};
  return frames;
}

std::string mesh_json(const Panel& panel, bool z_up, Chunks& chunks) {
  const auto frames = z_up ? upright(panel.frames) : panel.frames;
  const std::size_t vertices = frames.empty() ? 0 : frames.front().size();
  if (vertices == 0) throw npt::Error({panel.caption, {}, "a mesh without vertices", "one to show"});
  const Box box = box_of(frames);
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : npt::triangulate(panel.mesh)) corners.insert(corners.end(), t.begin(), t.end());
  const EncodedIndices faces = encode_indices(corners);
  std::string json =
      "{\"vertices\":" + std::to_string(vertices) + ",\"triangles\":" + std::to_string(corners.size() / 3) +
      ",\"frames\":" + std::to_string(frames.size()) + ",\"low\":" + list(box.low) + ",\"high\":" + list(box.high) +
      ",\"positions\":" + std::to_string(chunks.add(encode_positions(frames, box))) +
      ",\"faces\":" + std::to_string(chunks.add(faces.bytes)) + ",\"planes\":" + std::to_string(faces.planes);
  const auto optional = [&](const char* name, const std::string& bytes) {
    if (!bytes.empty()) json += ",\"" + std::string(name) + "\":" + std::to_string(chunks.add(bytes));
  };
  optional("inner", inner_sides(panel.mesh));
  optional("colours", colour_bytes(panel.mesh));
  if (!panel.errors.empty()) {
    const double high = std::max(largest_error(panel), 1e-6);
    json += ",\"error_high\":" + number(high);
    optional("errors", encode_values(panel.errors, high));
  }
  return json + "}";
}

std::string panel_json(const Panel& panel, bool z_up, Chunks& chunks) {
  return "{\"caption\":" + json_string(panel.caption) + ",\"detail\":" + json_string(panel.detail) + ",\"colour\":\"" +
         hex(panel.colour) + "\"," +
         (panel.glb.empty() ? "\"mesh\":" + mesh_json(panel, z_up, chunks)
                            : "\"glb\":" + std::to_string(chunks.add(panel.glb))) +
         "}";
}

std::string heat_json(const Page& page) {
  std::vector<double> all;
  for (const Group& group : page.groups)
    for (const Panel& panel : group.panels)
      for (const std::vector<double>& frame : panel.errors) all.insert(all.end(), frame.begin(), frame.end());
  if (all.empty()) return "null";
  const render::ErrorScale scale = render::error_scale(std::move(all), page.error_scale);
  std::string json = "{\"high\":" + number(scale.high) + ",\"open\":" + (scale.open_end ? "true" : "false") +
                     ",\"label\":\"distance to the ground truth\",\"colours\":[";
  constexpr int stops = 32;
  for (int i = 0; i <= stops; ++i)
    json += (i > 0 ? ",\"" : "\"") + hex(render::heat_colour(static_cast<float>(i) / stops)) + "\"";
  return json + "]}";
}

std::string scene_json(const Page& page, Chunks& chunks) {
  std::string json = "{\"fps\":" + number(page.fps) + ",\"heat\":" + heat_json(page) + ",\"groups\":[";
  for (const Group& group : page.groups) {
    json += (&group == &page.groups.front() ? "{\"caption\":" : ",{\"caption\":") + json_string(group.caption) +
            ",\"panels\":[";
    for (const Panel& panel : group.panels)
      json += (&panel == &group.panels.front() ? "" : ",") + panel_json(panel, page.z_up, chunks);
    json += "]}";
  }
  return json + "]}";
}

std::string with_thousands(std::size_t count) {
  std::string text = std::to_string(count);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, 1, ',');
  return text;
}

}  // namespace

bool same_faces(const npt::Mesh& a, const npt::Mesh& b) {
  return a.vertex_count() == b.vertex_count() && a.face_start == b.face_start && a.corners == b.corners;
}

Panel mesh_panel(std::string caption, const npt::Mesh& mesh) {
  Panel panel;
  panel.caption = std::move(caption);
  panel.detail = with_thousands(mesh.vertex_count()) + " vertices";
  panel.mesh = mesh;
  panel.frames.push_back(mesh.positions);
  return panel;
}

void add_frame(Panel& panel, const npt::Mesh& mesh, const std::string& name) {
  if (panel.mesh.vertex_count() != mesh.vertex_count())
    throw npt::Error({name,
                      {},
                      std::to_string(mesh.vertex_count()) + " vertices",
                      std::to_string(panel.mesh.vertex_count()) + ", as in the sequence's first frame"});
  if (!same_faces(panel.mesh, mesh)) throw npt::Error({name, {}, "other faces", "those of the sequence's first frame"});
  panel.frames.push_back(mesh.positions);
}

void add_errors(Panel& panel, const npt::Mesh& truth, const std::string& name, const std::string& truth_name) {
  const std::vector<Vec3f>& last = panel.frames.back();
  if (last.size() != truth.vertex_count())
    throw npt::Error({name,
                      {},
                      std::to_string(last.size()) + " vertices",
                      std::to_string(truth.vertex_count()) + " as in " + truth_name});
  std::vector<double> errors = render::centred_distances({&last.front().x, 3 * last.size()}, truth.coordinates());
  for (double& e : errors) e *= 1000;
  panel.errors.push_back(std::move(errors));
}

std::string page_text(const Page& page) {
  if (page.groups.empty() || std::ranges::any_of(page.groups, [](const Group& g) { return g.panels.empty(); }))
    throw npt::Error({"page", {}, "nothing to show", "a mesh at least"});
  Chunks chunks;
  const std::string scene = scene_json(page, chunks);
  std::string three(three_gzip());
  three.replace(4, 4, 4, '\0');  // the time of the build, in a gzip file's header
  chunks.append("three", three, "gzip");
  const std::map<std::string_view, std::string_view> parts{{"base", base_style()},    {"style", page_style()},
                                                           {"stage", stage_script()}, {"script", page_script()},
                                                           {"scene", scene},          {"chunks", chunks.text()}};
  std::string text;
  std::string_view rest = page_html();
  while (!rest.empty()) {
    const std::size_t open = rest.find("{{");
    text += rest.substr(0, open);
    if (open == std::string_view::npos) break;
    const std::size_t close = rest.find("}}", open);
    const std::string_view name = rest.substr(open + 2, close - open - 2);
    if (name == "title")
      text += escaped(page.title);
    else if (name == "version")
      text += NPT_VERSION;
    else
      text += parts.at(name);
    rest.remove_prefix(close + 2);
  }
  return text;
}

std::size_t write_page(const std::filesystem::path& path, const Page& page) {
  const std::string text = page_text(page);
  npt::write_file(path, text);
  return text.size();
}

}  // namespace view
