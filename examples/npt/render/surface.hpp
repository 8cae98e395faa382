/// A mesh made ready to be drawn: triangles or points in the world of the picture, normals, colours.
#pragma once

#include <render/colour.hpp>
#include <render/image.hpp>

#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace render {

using npt::Triangle;
using npt::Vec3f;

/// Which axis of the mesh's own coordinates points to the sky.
enum class UpAxis { y, z };

/// One mesh or finished picture in the figure, or with neither an empty place.
struct Panel {
  const npt::Mesh* mesh = nullptr;
  std::string caption;             ///< below the panel; several lines are separated by '\n'
  std::vector<Colour> colours;     ///< empty: the default; one: the whole mesh; [V]: one a vertex
  const Image* picture = nullptr;  ///< shown in the panel's middle, made smaller where it doesn't fit
  double even_light = 0;  ///< 0 .. 1: the share of light without direction. Colours that say something need some
};

/// A mesh in world units: on the ground y = 0, centred at x = z = 0, in a row whose largest mesh has radius 1 or so.
struct Figure {
  std::vector<Vec3f> positions;     ///< [V]
  std::vector<Vec3f> normals;       ///< [V], length 1 or 0
  std::vector<Triangle> triangles;  ///< empty: a cloud of points
  std::vector<Colour> colours;      ///< [1] or [V]
  float disc_radius = 0;            ///< of each point of a cloud
  float even_light = 0;             ///< as in Panel
  std::vector<Vec3f> outline;       ///< the positions that are drawn: a mesh may have vertices that no face uses

  bool is_empty() const { return positions.empty(); }
  bool is_cloud() const { return triangles.empty(); }
  Colour colour(std::uint32_t vertex) const { return colours.size() == 1 ? colours[0] : colours[vertex]; }
};

/// The figures of some panels, at one scale. A panel without a mesh gives an empty figure.
/// Errors    npt::Error for a mesh without vertices and for colours that are neither one nor one a vertex.
std::vector<Figure> make_figures(std::span<const Panel> row, UpAxis up, Colour default_colour);

/// Reads the vertex properties red, green, blue, where a mesh has them (0 .. 255, or 0 .. 1 for floating point).
std::vector<Colour> vertex_colours(const npt::Mesh& mesh);

}  // namespace render
