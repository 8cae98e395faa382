/// xtensor in and out: transfer(identity, pose) on any xtensor expressions of shape [V, 3] returns an
/// xt::xtensor<float, 2>, as an engine does. Meshes with faces are MeshTensors.
/// Row-major containers and views of contiguous memory of the engine's scalar are borrowed; everything else (lazy
/// expressions, other scalars, column-major or strided views) is evaluated once.
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/tensor_adapter.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/triangles.hpp>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>
#include <xtensor/xtensor.hpp>

namespace npt::inline NPT_ABI {

template <class E>
requires xt::is_xexpression<E>::value struct TensorAdapter<E> {
  /// Coordinates that are either borrowed from the expression or owned.
  template <class T>
  class Coordinates {
   public:
    explicit Coordinates(std::span<const T> borrowed) : view_(borrowed) {}
    explicit Coordinates(xt::xtensor<T, 2> owned) : owned_(std::move(owned)), view_(owned_.data(), owned_.size()) {}
    Coordinates(const Coordinates&) = delete;
    Coordinates& operator=(const Coordinates&) = delete;
    std::span<const T> span() const { return view_; }

   private:
    xt::xtensor<T, 2> owned_;
    std::span<const T> view_;
  };

  template <class T>
  static Coordinates<T> read(const E& e, std::size_t channels = 3) {
    if (e.dimension() != 2 || e.shape()[1] != channels)
      throw Error(
          {.file = "tensor", .found = "shape " + shape_of(e), .expected = "[V, " + std::to_string(channels) + "]"});
    if constexpr (std::same_as<std::remove_cv_t<typename E::value_type>, T> &&
                  requires { e.data() + e.data_offset(); }) {
      const auto& strides = e.strides();
      const bool one_vertex = e.shape()[0] == 1;
      if (strides[1] == 1 && (strides[0] == static_cast<std::ptrdiff_t>(channels) || one_vertex))
        return Coordinates<T>(std::span<const T>(e.data() + e.data_offset(), e.size()));
    }
    return Coordinates<T>(xt::xtensor<T, 2>(xt::cast<T>(e)));
  }

  template <class T>
  static xt::xtensor<T, 2> make(std::size_t vertices) {
    return xt::xtensor<T, 2>::from_shape({vertices, std::size_t{3}});
  }

  template <class T>
  static std::span<T> write(xt::xtensor<T, 2>& tensor) {
    return {tensor.data(), tensor.size()};
  }

 private:
  static std::string shape_of(const E& e) {
    std::string text;
    for (std::size_t i = 0; i < e.dimension(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(e.shape()[i]);
    return "[" + text + "]";
  }
};

/// A mesh as a host with tensors holds it.
struct MeshTensors {
  xt::xtensor<float, 2> positions;          ///< [V, 3]
  xt::xtensor<std::uint32_t, 2> triangles;  ///< [F, 3] vertex numbers, or empty
};

/// A mesh's positions and triangles, each face a fan around its first corner.
inline MeshTensors to_tensors(const Mesh& mesh) {
  const std::vector<Triangle> list = triangulate(mesh);
  MeshTensors tensors{xt::xtensor<float, 2>::from_shape({mesh.vertex_count(), std::size_t{3}}),
                      xt::xtensor<std::uint32_t, 2>::from_shape({list.size(), std::size_t{3}})};
  const std::span<const float> xyz = mesh.coordinates();
  std::copy(xyz.begin(), xyz.end(), tensors.positions.data());
  for (std::size_t t = 0; t < list.size(); ++t)
    std::copy(list[t].begin(), list[t].end(), tensors.triangles.data() + 3 * t);
  return tensors;
}

/// The tensors as a transfer takes them, without a copy. `name` stands in messages of errors.
/// Errors    npt::Error for other shapes than [V, 3] and [F, 3]
inline MeshView view_of(const MeshTensors& mesh, std::string_view name = {}) {
  const auto check = [&name](const auto& tensor, const char* what) {
    if (tensor.size() != 0 && tensor.shape()[1] != 3)
      throw Error(
          {.file = std::string(name),
           .place = what,
           .found = "shape [" + std::to_string(tensor.shape()[0]) + ", " + std::to_string(tensor.shape()[1]) + "]",
           .expected = "three columns"});
  };
  check(mesh.positions, "positions");
  check(mesh.triangles, "triangles");
  return {.xyz = {mesh.positions.data(), mesh.positions.size()},
          .triangles = {reinterpret_cast<const Triangle*>(mesh.triangles.data()), mesh.triangles.size() / 3},
          .name = name};
}

/// A tensor's memory, for results. [V, 3]
inline std::span<float> span_of(xt::xtensor<float, 2>& tensor) { return {tensor.data(), tensor.size()}; }

}  // namespace npt::inline NPT_ABI
