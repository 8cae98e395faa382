/// A page to look at meshes in: one HTML file that holds all that it needs and fetches nothing.
///
///   view::Page page{.title = "walk"};
///   page.groups.push_back({"", {}});
///   page.groups[0].panels.push_back(view::mesh_panel("identity", identity));
///   view::write_page("walk.html", page);
///
/// Panels of a group stand side by side, with one camera; of several groups one is shown at a time. A mesh of several
/// frames moves. Errors are colours on one scale for the whole page.
#pragma once

#include <view/encoding.hpp>

#include <render/colour.hpp>

#include <npt/mesh/mesh.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace view {

/// A mesh, or a GLB file as it is.
struct Panel {
  std::string caption;
  std::string detail;  ///< a second line, smaller
  render::Colour colour = render::from_hex(0xD3CCC3);
  npt::Mesh mesh;                           ///< its faces, and its vertices' colours where it has some
  std::vector<std::vector<Vec3f>> frames;   ///< [frames][V] positions: at least one
  std::vector<std::vector<double>> errors;  ///< [frames][V] in millimetres, or none
  std::string glb;                          ///< bytes of the file; empty: a mesh
};

struct Group {
  std::string caption;
  std::vector<Panel> panels;
};

struct Page {
  std::string title;
  std::vector<Group> groups;
  double fps = 30;
  bool z_up = false;       ///< the meshes' own z axis points up; GLB files are y up always
  double error_scale = 0;  ///< millimetres at the end of the colours; 0: a round number that few vertices exceed
};

/// The largest page that browsers were seen to take.
inline constexpr std::size_t largest_page = std::size_t{400} << 20;

/// A panel of one frame, whose second line is the mesh's size.
Panel mesh_panel(std::string caption, const npt::Mesh& mesh);

/// Adds the positions of another mesh of the same faces. `name` stands in the message.
/// Errors    npt::Error for other faces, or another vertex count
void add_frame(Panel& panel, const npt::Mesh& mesh, const std::string& name);

/// Whether both have the same faces on as many vertices.
bool same_faces(const npt::Mesh& a, const npt::Mesh& b);

/// The distance of each of the panel's vertices, in the frame that was added last, to the same vertex of the truth,
/// boxes centred, as millimetres of meshes in metres.
/// Errors    npt::Error for a truth of another vertex count
void add_errors(Panel& panel, const npt::Mesh& truth, const std::string& name, const std::string& truth_name);

/// Errors    npt::Error for a page without panels, a panel without vertices, and more than largest_page
std::string page_text(const Page& page);

/// Writes the file as a whole or not at all, and returns its bytes.
std::size_t write_page(const std::filesystem::path& path, const Page& page);

}  // namespace view
