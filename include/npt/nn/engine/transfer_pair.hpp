/// One transfer of a batch, and the checks of its sizes that engines and gradients share.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <cstddef>
#include <span>
#include <string>

namespace npt::inline NPT_ABI {

/// One transfer of a batch, on borrowed memory: [Vp, 3] and [V, 3] coordinates in, [V, 3] out, row major.
template <class T = float>
struct TransferPair {
  std::span<const T> pose;
  std::span<const T> identity;
  std::span<T> result;
};

namespace engine {

inline constexpr std::size_t max_vertices = std::size_t{1} << 28;       ///< of one mesh
inline constexpr std::size_t only_pair = static_cast<std::size_t>(-1);  ///< number of a pair that is not one of several

// Names are composed only where an error is thrown: a warm call allocates nothing.
NPT_INLINE std::string name_in_batch(const char* what, std::size_t pair) {
  return pair == only_pair ? what : std::string(what) + " of pair " + std::to_string(pair);
}

/// `size`: numbers of a mesh's coordinates.
NPT_INLINE void check_coordinates(std::size_t size, const char* what, std::size_t pair = only_pair) {
  if (size == 0) throw Error({.file = name_in_batch(what, pair), .found = "no vertices", .expected = "at least one"});
  if (size % 3 != 0)
    throw Error({.file = name_in_batch(what, pair),
                 .found = std::to_string(size) + " numbers",
                 .expected = "three for each vertex"});
  if (size / 3 > max_vertices)
    throw Error({.file = name_in_batch(what, pair),
                 .found = std::to_string(size / 3) + " vertices",
                 .expected = "at most " + std::to_string(max_vertices)});
}

/// Numbers of the identity's coordinates and of the result's.
NPT_INLINE void check_result(std::size_t identity, std::size_t result, std::size_t pair = only_pair) {
  if (identity != result)
    throw Error({.file = name_in_batch("result", pair),
                 .found = std::to_string(result) + " numbers",
                 .expected = std::to_string(identity) + ", as many as the identity has"});
}

/// Vertices of both meshes; `paired`: the network needs equally many.
NPT_INLINE void check_pairing(bool paired, std::size_t pose, std::size_t identity, std::size_t pair = only_pair) {
  if (paired && pose != identity)
    throw Error(
        {.file = name_in_batch("pose", pair),
         .found = std::to_string(pose) + " vertices",
         .expected = std::to_string(identity) +
                     ", as many as the identity has: this network pairs vertices (resample the pose mesh, or use a "
                     "network with the pooled feature)"});
}

/// Pair number i of `count`.
template <class T>
void check_pair(const TransferPair<T>& pair, std::size_t i, std::size_t count, bool paired) {
  const std::size_t number = count == 1 ? only_pair : i;
  check_coordinates(pair.pose.size(), "pose", number);
  check_coordinates(pair.identity.size(), "identity", number);
  check_result(pair.identity.size(), pair.result.size(), number);
  check_pairing(paired, pair.pose.size() / 3, pair.identity.size() / 3, number);
}

}  // namespace engine
}  // namespace npt::inline NPT_ABI
