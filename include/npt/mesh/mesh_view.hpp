/// A mesh on borrowed memory: what a host hands to a transfer without making a Mesh of it.
#pragma once

#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>

#include <cstddef>
#include <span>
#include <string_view>

namespace npt::inline NPT_ABI {

/// Positions, triangles and a name, all the caller's.
struct MeshView {
  std::span<const float> xyz;             ///< [V, 3], row major
  std::span<const Triangle> triangles{};  ///< [F] vertex numbers; none: a cloud of points
  std::string_view name{};                ///< stands in messages of errors; empty: what the mesh is used for

  std::size_t vertex_count() const noexcept { return xyz.size() / 3; }
};

}  // namespace npt::inline NPT_ABI
