/// The way in for host code's tensor types. The engine accepts every type for which TensorAdapter is specialised;
/// <npt/adapt/xtensor.hpp> does so for xtensor's expressions.
#pragma once

#include <npt/config.hpp>

namespace npt::inline NPT_ABI {

/// Specialise for E with
///
///     template <class T> static auto read(const E& e, std::size_t channels = 3);
///     template <class T> static auto make(std::size_t vertices);
///     template <class T> static std::span<T> write(Tensor& tensor);
///
/// read: an object whose span() is [V, channels], row major, of T: a view of e's memory or an evaluated copy; it
/// throws npt::Error on any other shape. make: a new [V, 3] tensor to return to the host. write: that tensor's memory.
template <class E>
struct TensorAdapter;

/// A type with a TensorAdapter.
template <class E>
concept HostTensor = requires {
  sizeof(TensorAdapter<E>);
};

}  // namespace npt::inline NPT_ABI
