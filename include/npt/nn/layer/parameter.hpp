/// What a layer declares about its learned tensors, and the walk over them.
///
/// A layer holds Parameter members and lists them, with the public names, in a static `visit`:
///   static constexpr void visit(auto& self, auto&& visitor) {
///     visitor("weight", self.weight);
///     visitor("bias", self.bias);
///   }
/// A network lists its layers the same way, which composes names such as "decoder.conv1.weight". Values live elsewhere,
/// in one buffer a model (nn/engine/model.hpp): a Parameter only knows its shape and its place in that buffer.
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// Place and shape of one learned tensor, row major, at most three dimensions (a 1x1 convolution's [Cout, Cin, 1]).
struct Parameter {
  int dims[3] = {0, 0, 0};
  int rank = 0;
  int offset = -1;         ///< first element in the model's buffer; -1: not bound to a model yet
  bool attribute = false;  ///< a fixed number kept in the file's metadata under its own name, not a learned tensor
  double initial = 0;      ///< an attribute's default value

  constexpr Parameter() = default;
  constexpr explicit Parameter(int d0) : dims{d0, 0, 0}, rank(1) {}
  constexpr Parameter(int d0, int d1, int d2) : dims{d0, d1, d2}, rank(3) {}
  /// A number that belongs to the network but isn't learned, such as the output's scale.
  static constexpr Parameter number(double value) {
    Parameter p(1);
    p.attribute = true;
    p.initial = value;
    return p;
  }
  constexpr int size() const {
    int n = rank == 0 ? 0 : 1;
    for (int i = 0; i < rank; ++i) n *= dims[i];
    return n;
  }
};

/// Calls f(parameter) for every Parameter of a layer or network, in declaration order. Usable in constant expressions.
template <class Layer, class F>
constexpr void for_each_parameter(Layer& layer, F&& f) {
  if constexpr (std::is_same_v<std::remove_const_t<Layer>, Parameter>) {
    f(layer);
  } else {
    std::remove_const_t<Layer>::visit(layer, [&f](const char*, auto& part) { for_each_parameter(part, f); });
  }
}

/// A parameter with its full name, such as "decoder.conv1.weight".
struct NamedParameter {
  std::string name;
  Parameter parameter;
};

namespace internal {

/// Collects parameters under the names of the layers around them. Not inlined: networks call this hundreds of times,
/// once.
class ParameterCollector {
 public:
  /// Names what comes next until leave(), which takes what enter() returned.
  NPT_NOINLINE std::size_t enter(const char* name) {
    const std::size_t outer = prefix_.size();
    if (outer != 0) prefix_ += '.';
    prefix_ += name;
    return outer;
  }
  NPT_NOINLINE void leave(std::size_t outer) { prefix_.resize(outer); }
  NPT_NOINLINE void add(const Parameter& parameter) { list_.push_back({prefix_, parameter}); }

  std::vector<NamedParameter> take() { return std::move(list_); }

 private:
  std::string prefix_;
  std::vector<NamedParameter> list_;
};

template <class Layer>
void list_parameters(const Layer& layer, ParameterCollector& collector) {
  if constexpr (std::is_same_v<Layer, Parameter>) {
    collector.add(layer);
  } else {
    Layer::visit(layer, [&collector](const char* name, const auto& part) {
      const std::size_t outer = collector.enter(name);
      list_parameters(part, collector);
      collector.leave(outer);
    });
  }
}

}  // namespace internal

/// All parameters of a layer or network in declaration order. What works on this list compiles once for all networks.
template <class Layer>
std::vector<NamedParameter> list_parameters(const Layer& layer) {
  internal::ParameterCollector collector;
  internal::list_parameters(layer, collector);
  return collector.take();
}

/// Elements between tensors' starts are multiples of this: each tensor begins on a 64-byte boundary in fp32 and in
/// fp64.
inline constexpr int parameter_alignment = 16;

/// A copy of the network whose parameters have their places in one buffer.
template <class Net>
constexpr Net bind_parameters(Net net = {}) {
  int next = 0;
  for_each_parameter(net, [&next](Parameter& p) {
    p.offset = next;
    next += (p.size() + parameter_alignment - 1) / parameter_alignment * parameter_alignment;
  });
  return net;
}

/// Elements that a buffer for a bound network needs.
template <class Net>
constexpr int parameter_buffer_size(const Net& net) {
  int end = 0;
  for_each_parameter(net, [&end](const Parameter& p) {
    end = p.offset + (p.size() + parameter_alignment - 1) / parameter_alignment * parameter_alignment;
  });
  return end;
}

}  // namespace npt::inline NPT_ABI
