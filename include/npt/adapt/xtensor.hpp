/// xtensor in and out: engine(pose, identity) on any xtensor expressions of shape [V, 3] returns an xt::xtensor<T, 2>.
/// Row-major containers and views of contiguous memory of the engine's scalar are borrowed; everything else (lazy
/// expressions, other scalars, column-major or strided views) is evaluated once.
#pragma once

#include <npt/config.hpp>
#include <npt/core/error.hpp>
#include <npt/core/tensor_adapter.hpp>

#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
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
  static Coordinates<T> read(const E& e) {
    if (e.dimension() != 2 || e.shape()[1] != 3)
      throw Error({.file = "tensor", .found = "shape " + shape_of(e), .expected = "[V, 3]"});
    if constexpr (std::same_as<std::remove_cv_t<typename E::value_type>, T> &&
                  requires { e.data() + e.data_offset(); }) {
      const auto& strides = e.strides();
      const bool one_vertex = e.shape()[0] == 1;
      if (strides[1] == 1 && (strides[0] == 3 || one_vertex))
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

}  // namespace npt::inline NPT_ABI
