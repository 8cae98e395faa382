/// A random composition as a network type: its layers, and an operator() that composes them, as a host would write by
/// hand.
#pragma once

#include <npt/nn/graph/expression.hpp>
#include <npt/nn/graph/graph.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/max_pool.hpp>
#include <npt/nn/layer/relu.hpp>
#include <npt/nn/layer/spadain.hpp>
#include <npt/nn/layer/tanh.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

#include "composition.hpp"
#include "network.hpp"

namespace random_networks {

/// Values one after another, the last one outermost: a std::tuple that grows by std::tuple_cat takes g++ half of the unit's time.
template <class Before, class Last>
struct Values {
  Before before;
  Last last;
};
template <class Before, class Last>
Values(Before, Last) -> Values<Before, Last>;
struct NoValues {};

/// The value that stands `Back` before the last one.
template <int Back, class Before, class Last>
constexpr const auto& value_before(const Values<Before, Last>& values) {
  if constexpr (Back == 0)
    return values.last;
  else
    return value_before<Back - 1>(values.before);
}

template <std::uint64_t Seed>
class TypedNetwork {
  static constexpr Composition composition = composition_of(Seed, hidden_condition);
  static constexpr int channels_of(int value) { return composition.channels_of(value); }

  template <int I>
  static constexpr auto layer() {
    constexpr Step step = composition[I];
    if constexpr (step.kind == Kind::conv)
      return npt::Conv1x1<channels_of(step.first), step.channels>{};
    else if constexpr (step.kind == Kind::activation && step.activation == 0)
      return npt::Relu{};
    else if constexpr (step.kind == Kind::activation && step.activation == 1)
      return npt::Tanh{};
    else if constexpr (step.kind == Kind::activation)
      return npt::ScaledTanh{};
    else if constexpr (step.kind == Kind::norm)
      return npt::InstanceNorm{};
    else if constexpr (step.kind == Kind::modulate)
      return npt::SPAdaIN<step.channels, channels_of(step.second), npt::Norm::none>{};
    else
      return npt::MaxPool{};
  }
  template <int... I>
  static constexpr auto layers(std::integer_sequence<int, I...>) {
    return std::tuple{layer<I>()...};
  }

 public:
  static constexpr auto inputs = [] {
    std::array<npt::Input, static_cast<std::size_t>(composition.inputs)> list{};
    for (std::size_t i = 0; i < list.size(); ++i)
      list[i] = {.name = input_names[i], .channels = channels_of(static_cast<int>(i))};
    return list;
  }();

  decltype(layers(std::make_integer_sequence<int, composition.count>{})) layers_ =
      layers(std::make_integer_sequence<int, composition.count>{});

  static constexpr void visit(auto& self, auto&& visitor) {
    constexpr const char* names[max_steps] = {"v0",  "v1",  "v2",  "v3",  "v4",  "v5",  "v6",  "v7",  "v8",  "v9",
                                              "v10", "v11", "v12", "v13", "v14", "v15", "v16", "v17", "v18", "v19",
                                              "v20", "v21", "v22", "v23", "v24", "v25", "v26", "v27", "v28", "v29",
                                              "v30", "v31", "v32", "v33", "v34", "v35", "v36", "v37", "v38", "v39"};
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      const auto one = [&](const char* name, auto& layer) {
        if constexpr (requires { layer.visit(layer, visitor); }) visitor(name, layer);
      };
      (one(names[I], std::get<I>(self.layers_)), ...);
    }
    (std::make_index_sequence<static_cast<std::size_t>(composition.count)>{});
  }

  constexpr auto operator()(auto... given) const { return take(NoValues{}, given...); }

 private:
  constexpr auto take(auto values) const { return grow<0>(values); }
  constexpr auto take(auto values, auto next, auto... rest) const { return take(Values{values, next}, rest...); }

  template <int I>
  constexpr auto grow(auto values) const {
    if constexpr (I == composition.count) {
      return values.last;
    } else {
      constexpr Step step = composition[I];
      const auto& first = value_before<I + composition.inputs - 1 - step.first>(values);
      const auto& layer = std::get<static_cast<std::size_t>(I)>(layers_);
      const auto with = [&](auto value) { return grow<I + 1>(Values{values, value}); };
      if constexpr (step.kind == Kind::modulate)
        return with(layer(first, value_before<I + composition.inputs - 1 - step.second>(values)));
      else if constexpr (step.kind == Kind::sum)
        return with(first + value_before<I + composition.inputs - 1 - step.second>(values));
      else if constexpr (step.kind == Kind::cat)
        return with(cat(first, value_before<I + composition.inputs - 1 - step.second>(values)));
      else
        return with(first | layer);
    }
  }
};

template <class Scalar, std::uint64_t... Seeds>
void check_typed_networks() {
  (check(network_of<TypedNetwork<Seeds>, Scalar>(text_of(composition_of(Seeds, hidden_condition))), Seeds), ...);
}

}  // namespace random_networks
