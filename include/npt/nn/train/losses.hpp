/// The losses of the paper, with their gradients.
///   reconstruction  eq. 5: sum over vertices of the squared distance to the truth; the released code takes the mean
///                   over the 3 V coordinates
///   edge length     eq. 6: sum over each vertex's neighbours of the squared edge length, so every edge counts twice
///   relative edges  the released code's: mean over triangles of the sum over their sides of
///                   |length / reference's length - 1|
/// Each returns the loss of one mesh, summed in double, and adds `weight` times its gradient to `gradient`.
/// Shapes  prediction, truth, reference, gradient: [V, 3], row major
#pragma once

#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/topology.hpp>

#include <cmath>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI {

/// Whether a loss is a sum over the points, as the paper writes it, or a mean over the coordinates, as its code does.
enum class LossScaling { sum, mean };

/// The paper's weight of the edge length loss beside the reconstruction.
inline constexpr double paper_edge_weight = 5e-4;

template <class T>
double reconstruction_loss(std::span<const T> prediction, std::span<const T> truth, LossScaling scaling, double weight,
                           std::span<T> gradient) {
  NPT_ASSERT(prediction.size() == truth.size() && prediction.size() == gradient.size());
  const double scale = scaling == LossScaling::sum ? 1.0 : 1.0 / static_cast<double>(prediction.size());
  double sum = 0;
  for (std::size_t i = 0; i < prediction.size(); ++i) {
    const double d = static_cast<double>(prediction[i]) - static_cast<double>(truth[i]);
    sum += d * d;
    gradient[i] += static_cast<T>(2 * weight * scale * d);
  }
  return scale * sum;
}

/// The mean over the vertices of the distance to the truth, sqrt(|d|^2 + rounding^2): robust where some vertices have
/// no right answer, since its least is at the median instead of the mean. `rounding`, in the network's units, is where
/// it turns quadratic.
template <class T>
double distance_loss(std::span<const T> prediction, std::span<const T> truth, double rounding, double weight,
                     std::span<T> gradient) {
  NPT_ASSERT(prediction.size() == truth.size() && prediction.size() == gradient.size());
  const double scale = 3.0 / static_cast<double>(prediction.size());
  double sum = 0;
  for (std::size_t i = 0; i + 2 < prediction.size(); i += 3) {
    double d[3], square = rounding * rounding;
    for (std::size_t k = 0; k < 3; ++k) {
      d[k] = static_cast<double>(prediction[i + k]) - static_cast<double>(truth[i + k]);
      square += d[k] * d[k];
    }
    const double distance = std::sqrt(square);
    sum += distance;
    for (std::size_t k = 0; k < 3; ++k) gradient[i + k] += static_cast<T>(weight * scale * d[k] / distance);
  }
  return scale * sum;
}

namespace internal {

template <class T>
Vec3d point_of(std::span<const T> xyz, std::size_t v) {
  return {static_cast<double>(xyz[3 * v]), static_cast<double>(xyz[3 * v + 1]), static_cast<double>(xyz[3 * v + 2])};
}

template <class T>
void add_to_point(std::span<T> xyz, std::size_t v, Vec3d d) {
  xyz[3 * v] += static_cast<T>(d.x);
  xyz[3 * v + 1] += static_cast<T>(d.y);
  xyz[3 * v + 2] += static_cast<T>(d.z);
}

}  // namespace internal

/// `edges`: each undirected edge once; it is counted for both of its ends. With LossScaling::mean the sum is divided by
/// the number of directed edges.
template <class T>
double edge_length_loss(std::span<const T> prediction, std::span<const Edge> edges, LossScaling scaling, double weight,
                        std::span<T> gradient) {
  NPT_ASSERT(prediction.size() == gradient.size());
  if (edges.empty()) return 0;
  const double scale = scaling == LossScaling::sum ? 2.0 : 1.0 / static_cast<double>(edges.size());
  double sum = 0;
  for (const auto& [a, b] : edges) {
    const Vec3d d = internal::point_of(prediction, a) - internal::point_of(prediction, b);
    sum += dot(d, d);
    internal::add_to_point(gradient, a, d * (2 * weight * scale));
    internal::add_to_point(gradient, b, d * (-2 * weight * scale));
  }
  return scale * sum;
}

/// A side without length in the reference can't be compared and is left out; one without length in the prediction has
/// no direction to grow in and gets no gradient.
template <class T>
double relative_edge_loss(std::span<const T> prediction, std::span<const T> reference,
                          std::span<const Triangle> triangles, double weight, std::span<T> gradient) {
  NPT_ASSERT(prediction.size() == reference.size() && prediction.size() == gradient.size());
  if (triangles.empty()) return 0;
  const double scale = 1.0 / static_cast<double>(triangles.size());
  double sum = 0;
  for (const Triangle& t : triangles) {
    for (std::size_t side = 0; side < 3; ++side) {
      const std::size_t a = t[side], b = t[(side + 1) % 3];
      const double rest = length(internal::point_of(reference, a) - internal::point_of(reference, b));
      if (rest == 0) continue;
      const Vec3d d = internal::point_of(prediction, a) - internal::point_of(prediction, b);
      const double now = length(d);
      sum += std::abs(now / rest - 1);
      if (now == 0) continue;
      const double slope = now > rest ? 1 : now < rest ? -1 : 0;
      const Vec3d change = d * (weight * scale * slope / (rest * now));
      internal::add_to_point(gradient, a, change);
      internal::add_to_point(gradient, b, -change);
    }
  }
  return scale * sum;
}

}  // namespace npt::inline NPT_ABI
