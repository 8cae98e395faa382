/// What a network takes: named inputs of some channels each.
#pragma once

#include <npt/config.hpp>

#include <array>
#include <cstddef>
#include <initializer_list>
#include <string_view>

namespace npt::inline NPT_ABI {

/// An input of a network: so many numbers for each vertex, [V, channels], under a name. A network lists its inputs,
///   static constexpr npt::Input inputs[] = {{"points", 3}, {"normals", 3}};
/// in the order in which its operator() takes them.
struct Input {
  const char* name = "";
  int channels = 0;
};

}  // namespace npt::inline NPT_ABI

namespace npt::inline NPT_ABI::graph {

inline constexpr int max_inputs = 8;

/// A network's inputs, and how their vertices belong together.
struct InputList {
  std::array<Input, max_inputs> list{};
  int count = 0;
  /// The input that may have vertices of its own, whose part of the network runs before the rest and can be kept
  /// (encoded_input); -1: there is one input only.
  int encoded = -1;

  constexpr const Input& operator[](int i) const { return list[static_cast<std::size_t>(i)]; }
  /// An input with the result's vertices, as all but the encoded one have them.
  constexpr int of_result() const { return encoded == 0 ? 1 : 0; }
  /// Whether these are the inputs, by name and channels.
  constexpr bool are(std::initializer_list<Input> wanted) const {
    int i = 0;
    bool same = static_cast<int>(wanted.size()) == count;
    for (const Input& input : wanted) {
      same = same && std::string_view((*this)[i].name) == input.name && (*this)[i].channels == input.channels;
      if (++i == max_inputs) break;
    }
    return same;
  }
};

}  // namespace npt::inline NPT_ABI::graph
