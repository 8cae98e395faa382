/// The door for host code's tensor types. The engine accepts every type for which TensorAdapter is specialised;
/// <npt/adapt/xtensor.hpp> does so for xtensor's expressions.
#pragma once

#include <npt/config.hpp>

#include <concepts>
#include <cstddef>
#include <span>

namespace npt::inline NPT_ABI {

/// Specialise with
///   using Result = the owning tensor type returned to the host;
///   template <class T> static Points<T> read(const E&)   // [V, 3] row major; throws npt::Error on another shape
///   template <class T> static std::pair<Result, std::span<T>> make(std::size_t vertices)
template <class E>
struct TensorAdapter;

template <class E>
concept HostTensor = requires {
  typename TensorAdapter<E>::Result;
};

}  // namespace npt::inline NPT_ABI
