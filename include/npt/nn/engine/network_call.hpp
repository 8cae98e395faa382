/// One run of a network on borrowed memory, and the checks of its sizes that engines and gradients share.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/nn/graph/inputs.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>

namespace npt::inline NPT_ABI {

/// What a network is given, by its inputs in their order: [V, channels], row major.
///   engine({points, normals}, result);
template <class T = float>
class Inputs {
 public:
  Inputs() = default;
  Inputs(std::initializer_list<std::span<const T>> list) : count_(list.size()) {
    std::copy_n(list.begin(), std::min(count_, values_.size()), values_.begin());
  }

  /// How many were given, which may be more than any network has.
  std::size_t size() const { return count_; }
  std::span<const T> operator[](int input) const { return values_[static_cast<std::size_t>(input)]; }
  void push_back(std::span<const T> values) {
    if (count_ < values_.size()) values_[count_] = values;
    ++count_;
  }

 private:
  std::array<std::span<const T>, static_cast<std::size_t>(graph::max_inputs)> values_{};
  std::size_t count_ = 0;
};

/// One run of a batch: inputs in, [V, 3] out, row major.
template <class T = float>
struct NetworkCall {
  Inputs<T> inputs;
  std::span<T> result;
};

namespace engine {

inline constexpr std::size_t max_vertices = std::size_t{1} << 28;       ///< of one input
inline constexpr std::size_t only_call = static_cast<std::size_t>(-1);  ///< number of a call that is not one of several

// Names are composed only where an error is thrown: a warm call allocates nothing.
NPT_INLINE std::string name_in_batch(const char* what, std::size_t call) {
  return call == only_call ? what : std::string(what) + " of call " + std::to_string(call);
}

/// Vertices of an input of `size` numbers.
/// Errors  npt::Error for none, too many, and a size that isn't so many channels a vertex
NPT_INLINE std::size_t count_vertices(const Input& input, std::size_t size, std::size_t call = only_call) {
  const auto channels = static_cast<std::size_t>(input.channels);
  const auto refuse = [&](std::string found, std::string expected) {
    throw Error({.file = name_in_batch(input.name, call), .found = std::move(found), .expected = std::move(expected)});
  };
  if (size == 0) refuse("no vertices", "at least one");
  if (size % channels != 0) refuse(std::to_string(size) + " numbers", std::to_string(channels) + " for each vertex");
  if (size / channels > max_vertices)
    refuse(std::to_string(size / channels) + " vertices", "at most " + std::to_string(max_vertices));
  return size / channels;
}

NPT_INLINE void refuse_input_count(const graph::InputList& inputs, std::size_t found, int without, std::size_t call) {
  std::string names;
  for (int i = 0; i < inputs.count; ++i)
    if (i != without) names += (names.empty() ? "" : ", ") + std::string(inputs[i].name);
  throw Error({.file = name_in_batch("inputs", call), .found = std::to_string(found), .expected = names});
}

/// `result`: numbers of the result, for an input of so many vertices.
NPT_INLINE void check_result(const Input& input, std::size_t vertices, std::size_t result,
                             std::size_t call = only_call) {
  if (3 * vertices != result)
    throw Error({.file = name_in_batch("result", call),
                 .found = std::to_string(result) + " numbers",
                 .expected = std::to_string(3 * vertices) + ", three for each vertex of " + input.name});
}

/// Vertices of two inputs that the network reads together.
NPT_INLINE void check_equal_counts(const Input& input, std::size_t vertices, const Input& other, std::size_t expected,
                                   std::size_t call = only_call) {
  if (vertices != expected)
    throw Error({.file = name_in_batch(input.name, call),
                 .found = std::to_string(vertices) + " vertices",
                 .expected = std::to_string(expected) + ", as many as " + other.name +
                             " has: this network reads both vertex by vertex"});
}

/// Vertices of the encoded input (0 where there is none) and of the result.
struct CallVertices {
  std::size_t encoded = 0, result = 0;
};

/// Call number `call`. `code_vertices`: of an encoded input that isn't among the call's; 0: all inputs are.
template <class T>
CallVertices check_call(const graph::InputList& inputs, bool paired, const NetworkCall<T>& given, std::size_t call,
                        std::size_t code_vertices = 0) {
  const int without = code_vertices != 0 ? inputs.encoded : -1;
  if (given.inputs.size() != static_cast<std::size_t>(inputs.count - (without >= 0 ? 1 : 0)))
    refuse_input_count(inputs, given.inputs.size(), without, call);
  CallVertices vertices{.encoded = code_vertices};
  const Input& first = inputs[inputs.of_result()];
  int place = 0;
  for (int i = 0; i < inputs.count; ++i) {
    if (i == without) continue;
    const std::size_t own = count_vertices(inputs[i], given.inputs[place++].size(), call);
    if (i == inputs.encoded)
      vertices.encoded = own;
    else if (i == inputs.of_result())
      vertices.result = own;
    else
      check_equal_counts(inputs[i], own, first, vertices.result, call);
  }
  check_result(first, vertices.result, given.result.size(), call);
  if (paired) check_equal_counts(inputs[inputs.encoded], vertices.encoded, first, vertices.result, call);
  return vertices;
}

}  // namespace engine
}  // namespace npt::inline NPT_ABI
