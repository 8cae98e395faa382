/// Affine maps: x -> linear x + shift, as nodes of a scene and bones of a body have them.
#pragma once

#include <npt/base/matrix3.hpp>
#include <npt/base/rigid.hpp>
#include <npt/base/similarity.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// x -> linear x + shift
template <class T>
struct BasicAffine {
  BasicMatrix3<T> linear = BasicMatrix3<T>::identity();
  Vec3<T> shift;

  template <class U>
  constexpr BasicAffine<U> as() const {
    return {linear.template as<U>(), shift.template as<U>()};
  }
  constexpr Vec3<T> operator()(Vec3<T> p) const { return linear * p + shift; }
  /// x -> a(b(x))
  friend constexpr BasicAffine operator*(const BasicAffine& a, const BasicAffine& b) {
    return {a.linear * b.linear, a(b.shift)};
  }
  friend constexpr bool operator==(const BasicAffine&, const BasicAffine&) = default;
};

using Affine = BasicAffine<double>;

constexpr Affine affine_of(const Rigid& r) { return {r.rotation, r.shift}; }
constexpr Affine affine_of(const Similarity& s) { return {s.rotation * s.scale, s.shift}; }

/// The map that undoes another. Requires a determinant that isn't 0.
constexpr Affine inverse(const Affine& a) {
  const Matrix3 linear = cofactors(a.linear).transposed() * (1 / a.linear.determinant());
  return {linear, -(linear * a.shift)};
}

}  // namespace npt::inline NPT_ABI
