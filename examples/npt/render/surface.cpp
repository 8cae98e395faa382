#include <render/surface.hpp>

#include <npt/base/error.hpp>
#include <npt/mesh/normals.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace render {
namespace {

using npt::Vec3d;

struct Box {
  Vec3d low{std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  Vec3d high = -low;
  void add(Vec3d p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
};

/// Vertices that the picture shows, ascending.
std::vector<std::uint32_t> drawn_vertices(const npt::Mesh& mesh, const std::vector<Triangle>& triangles) {
  std::vector<bool> drawn(mesh.vertex_count(), triangles.empty());
  for (const Triangle& t : triangles)
    for (std::uint32_t v : t) drawn[v] = true;
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t v = 0; v < drawn.size(); ++v)
    if (drawn[v]) vertices.push_back(v);
  return vertices;
}

/// Turned so that y is up; in double, because a mesh may stand far from its origin.
Vec3d upright(Vec3f p, UpAxis up) { return up == UpAxis::y ? p.as<double>() : Vec3f{p.x, p.z, -p.y}.as<double>(); }

struct Extent {
  Vec3d origin;       ///< comes to stand at the world's origin
  double radius = 0;  ///< of half the box's diagonal
};

Extent extent_of(const npt::Mesh& mesh, const std::vector<std::uint32_t>& drawn, UpAxis up) {
  Box box;
  for (std::uint32_t v : drawn) box.add(upright(mesh.positions[v], up));
  return {{0.5 * (box.low.x + box.high.x), box.low.y, 0.5 * (box.low.z + box.high.z)},
          0.5 * length(box.high - box.low)};
}

void check_panel(const Panel& panel) {
  if (panel.mesh->positions.empty())
    throw npt::Error(
        {panel.caption.empty() ? "picture" : panel.caption, {}, "a mesh without vertices", "something to draw"});
  const std::size_t count = panel.colours.size();
  if (count > 1 && count != panel.mesh->vertex_count())
    throw npt::Error({panel.caption.empty() ? "picture" : panel.caption, "colours", std::to_string(count),
                      std::to_string(panel.mesh->vertex_count()) + ", one for each vertex"});
}

/// Discs that just overlap where the points fill a surface about as large as the bounding box's.
float disc_radius(std::size_t points, double box_radius) {
  return static_cast<float>(0.9 * box_radius / std::sqrt(static_cast<double>(std::max<std::size_t>(points, 16))));
}

}  // namespace

std::vector<Figure> make_figures(std::span<const Panel> row, UpAxis up, Colour default_colour) {
  std::vector<Figure> figures(row.size());
  std::vector<std::vector<std::uint32_t>> drawn(row.size());
  std::vector<Extent> extents(row.size());
  double radius = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (row[i].mesh == nullptr) continue;
    check_panel(row[i]);
    figures[i].triangles = npt::triangulate(*row[i].mesh);
    drawn[i] = drawn_vertices(*row[i].mesh, figures[i].triangles);
    extents[i] = extent_of(*row[i].mesh, drawn[i], up);
    radius = std::max(radius, extents[i].radius);
  }
  const double scale = radius > 0 ? 1 / radius : 1;
  for (std::size_t i = 0; i < row.size(); ++i) {
    Figure& figure = figures[i];
    if (row[i].mesh == nullptr) continue;
    figure.even_light = static_cast<float>(std::clamp(row[i].even_light, 0.0, 1.0));
    figure.positions.resize(row[i].mesh->vertex_count());
    for (std::uint32_t v : drawn[i]) {
      figure.positions[v] = ((upright(row[i].mesh->positions[v], up) - extents[i].origin) * scale).as<float>();
      figure.outline.push_back(figure.positions[v]);
    }
    figure.normals = npt::vertex_normals(*row[i].mesh);
    for (Vec3f& normal : figure.normals) normal = upright(normal, up).as<float>();
    figure.colours = row[i].colours.empty() ? std::vector<Colour>{default_colour} : row[i].colours;
    if (figure.is_cloud()) figure.disc_radius = disc_radius(figure.positions.size(), extents[i].radius * scale);
  }
  return figures;
}

std::vector<Colour> vertex_colours(const npt::Mesh& mesh) {
  std::array<const npt::VertexProperty*, 3> channels{};
  for (const npt::VertexProperty& property : mesh.properties)
    for (std::size_t i = 0; i < 3; ++i)
      if (property.name == std::array{"red", "green", "blue"}[i]) channels[i] = &property;
  std::vector<Colour> colours;
  for (const auto* channel : channels)
    if (channel == nullptr || channel->values.size() != mesh.vertex_count()) return colours;
  const bool bytes = !channels[0]->type.starts_with("float") && !channels[0]->type.starts_with("double");
  const auto value = [&](std::size_t channel, std::size_t v) {
    return static_cast<float>(std::clamp(channels[channel]->values[v] / (bytes ? 255 : 1), 0.0, 1.0));
  };
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    colours.push_back(from_srgb(value(0, v), value(1, v), value(2, v)));
  return colours;
}

}  // namespace render
