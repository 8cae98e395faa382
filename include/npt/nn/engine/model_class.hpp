/// A network with values for its parameters. model.hpp has the members that know the network's type.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/config.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace npt::inline NPT_ABI {

/// Attributes at their defaults, into a buffer laid out as Model::buffer().
template <class T>
void set_attributes(const std::vector<NamedParameter>& parameters, std::span<T> buffer) {
  for (const auto& [name, p] : parameters)
    if (p.attribute) buffer[static_cast<std::size_t>(p.offset)] = static_cast<T>(p.initial);
}

/// Parameters of a network: all learned tensors in one buffer on 64-byte boundaries. Copyable. Fresh ones are zero,
/// attributes (such as the output's scale) have their default.
template <class Net, class T = float>
class Model {
 public:
  using Network = Net;
  using Scalar = T;

  Model() : values_(buffer_size()) { set_attributes(parameters(), buffer()); }

  /// The network's layers, with their parameters' places.
  static constexpr const Net& network();

  /// The buffer with everything, padding included.
  std::span<T> buffer() { return values_.span(); }
  std::span<const T> buffer() const { return values_.span(); }

  /// The values of one tensor, row major.
  std::span<T> values(const Parameter& p) { return slice(values_.span(), p); }
  std::span<const T> values(const Parameter& p) const { return slice(values_.span(), p); }

  /// All parameters with their names; the order is that of the network's declaration.
  static const std::vector<NamedParameter>& parameters();
  /// Elements of buffer().
  static std::size_t buffer_size();

  /// Calls f(name, parameter, values) for every learned tensor, under the names of the public state dict.
  template <class F>
  void for_each_tensor(F&& f) {
    for (const NamedParameter& p : parameters())
      if (!p.parameter.attribute) f(p.name, p.parameter, values(p.parameter));
  }
  template <class F>
  void for_each_tensor(F&& f) const {
    for (const NamedParameter& p : parameters())
      if (!p.parameter.attribute) f(p.name, p.parameter, values(p.parameter));
  }
  /// Calls f(name, value) for every attribute.
  template <class F>
  void for_each_attribute(F&& f) {
    for (const NamedParameter& p : parameters())
      if (p.parameter.attribute) f(p.name, values(p.parameter)[0]);
  }
  template <class F>
  void for_each_attribute(F&& f) const {
    for (const NamedParameter& p : parameters())
      if (p.parameter.attribute) f(p.name, values(p.parameter)[0]);
  }

 private:
  template <class Span>
  static Span slice(Span all, const Parameter& p) {
    return all.subspan(static_cast<std::size_t>(p.offset), static_cast<std::size_t>(p.size()));
  }

  AlignedBuffer<T> values_;
};

}  // namespace npt::inline NPT_ABI
