/// Random networks as lists of steps, drawn from a seed in a constant expression: convolutions, norms, activations,
/// SPAdaIN on inputs and on hidden tensors, sums, concatenations, max pooling; values are used several times or not at
/// all.
#pragma once

#include <npt/base/random.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace random_networks {

enum class Kind { conv, activation, norm, modulate, sum, cat, max_pool };

/// A value that is made of earlier ones. The inputs come first, then what each step makes.
struct Step {
  Kind kind = Kind::conv;
  int first = -1;
  int second = -1;  ///< summand, second part of a concatenation, or what a modulation is conditioned on
  int channels = 0;
  bool pooled = false;  ///< one value for the whole mesh
  int activation = 0;   ///< 0: relu, 1: tanh, 2: one with parameters
};

inline constexpr int max_steps = 40;
inline constexpr int max_inputs = 3;
inline constexpr const char* input_names[max_inputs] = {"a", "b", "c"};

/// Channels of the hidden tensors that a typed network's SPAdaIN is conditioned on.
inline constexpr int hidden_condition = 5;

struct Composition {
  std::array<int, max_inputs> input_channels{};
  int inputs = 0;
  std::array<Step, max_steps> steps{};
  int count = 0;
  constexpr const Step& operator[](int i) const { return steps[static_cast<std::size_t>(i)]; }
  /// Channels of a value.
  constexpr int channels_of(int value) const {
    return value < inputs ? input_channels[static_cast<std::size_t>(value)] : (*this)[value - inputs].channels;
  }
};

/// Draws a composition. What the engine can't lower (nn/graph/lower.hpp says what) is drawn rarely, not never.
class Composer {
 public:
  /// `condition_channels`: those of a hidden tensor that a SPAdaIN is conditioned on.
  constexpr Composer(std::uint64_t seed, int condition_channels)
      : random_(seed, 4711), condition_channels_(condition_channels) {}

  constexpr Composition compose() {
    constexpr int counts[] = {1, 2, 2, 2, 2, 3, 3}, widths[] = {3, 3, 3, 3, 1, 2, 4, 7};
    inputs_ = composition_.inputs = counts[draw(7)];
    for (int i = 0; i < inputs_; ++i)
      value(i) = {.channels = composition_.input_channels[static_cast<std::size_t>(i)] = widths[draw(8)],
                  .stored = true};
    const int wanted = 3 + draw(10);
    for (int i = 0; i < wanted && composition_.count < max_steps - 12; ++i) add_part();
    finish();
    return composition_;
  }

 private:
  struct Value {
    int channels = 0;
    bool pooled = false;
    bool stored =
        false;           ///< the engine stores it: an input, a convolution, or layers behind one that nothing else uses
    bool taken = false;  ///< a stored value is this one with layers behind it: another use would undo that
  };

  constexpr int draw(int n) { return static_cast<int>(random_.below(static_cast<std::uint32_t>(n))); }
  constexpr bool chance(int percent) { return draw(100) < percent; }
  constexpr Value& value(int v) { return values_[static_cast<std::size_t>(v)]; }
  constexpr int value_count() const { return composition_.count + inputs_; }
  constexpr bool is_input(int v) const { return v < inputs_; }
  /// The input that most networks end over.
  constexpr int last_input() const { return inputs_ - 1; }

  constexpr int push(const Step& step, bool stored) {
    composition_.steps[static_cast<std::size_t>(composition_.count)] = step;
    Value& made = value(value_count());
    made = {.channels = step.channels, .pooled = step.pooled, .stored = stored};
    ++composition_.count;
    return value_count() - 1;
  }

  /// A value that `fits`, often a late one; -1: none was found.
  template <class Fits>
  constexpr int pick(Fits&& fits) {
    for (int attempt = 0; attempt < 24; ++attempt) {
      const int n = value_count();
      const int v = chance(60) ? n - 1 - draw(n < 4 ? n : 4) : draw(n);
      if (value(v).taken && !chance(4)) continue;
      if (fits(value(v))) return v;
    }
    return -1;
  }
  constexpr int pick_vertices(int widest = 40) {
    const int v = pick([widest](const Value& x) { return !x.pooled && x.channels <= widest; });
    return v < 0 ? last_input() : v;
  }

  constexpr int conv(int from, int channels) {
    return push({.kind = Kind::conv, .first = from, .channels = channels}, true);
  }
  constexpr int activation(int from) {
    // Behind a convolution it becomes part of the stage, as long as nothing else reads the convolution.
    const bool absorbed = value(from).stored && !is_input(from);
    if (absorbed) value(from).taken = true;
    return push({.kind = Kind::activation,
                 .first = from,
                 .channels = value(from).channels,
                 .pooled = value(from).pooled,
                 .activation = draw(3)},
                absorbed);
  }
  constexpr int norm(int from) {
    return push({.kind = Kind::norm, .first = from, .channels = value(from).channels}, false);
  }
  constexpr int cat(int a, int b) {
    return push({.kind = Kind::cat,
                 .first = a,
                 .second = b,
                 .channels = value(a).channels + value(b).channels,
                 .pooled = value(a).pooled && value(b).pooled},
                false);
  }
  constexpr int modulate(int from, int condition) {
    return push({.kind = Kind::modulate, .first = from, .second = condition, .channels = value(from).channels}, false);
  }
  /// A convolution of anything to any width. (Arguments that draw would be evaluated in any order.)
  constexpr int any_conv() { return conv_to_any(pick_vertices()); }
  constexpr int conv_to_any(int from) {
    constexpr int choices[] = {1, 2, 3, 3, 5, 7, 8, 16, 17, 20};
    return conv(from, choices[draw(10)]);
  }

  /// What a modulation may be conditioned on: an input, or a hidden tensor of the right width.
  constexpr int condition() {
    const int kind = draw(10), wanted = condition_channels_;
    const int input = kind < 4 ? last_input() : 0;
    if (kind < 5 && (value(input).channels == 3 || value(input).channels == wanted)) return input;
    if (const int v = pick([wanted](const Value& x) { return x.stored && !x.pooled && x.channels == wanted; });
        v >= inputs_ && chance(70))
      return v;
    const int hidden = conv(pick_vertices(), wanted);
    return chance(50) ? activation(hidden) : hidden;
  }

  constexpr void add_part() {
    const int kind = draw(100);
    if (kind < 26) {
      const int made = any_conv();
      if (chance(30)) activation(made);
    } else if (kind < 38) {
      const int v = pick([](const Value&) { return true; });
      if (v >= inputs_ || chance(50)) activation(v < 0 ? last_input() : v);
    } else if (kind < 50) {
      const int v = pick([](const Value& x) { return !x.pooled && x.stored && x.channels <= 40; });
      const int normed = norm(v >= inputs_ ? v : any_conv());
      if (chance(60)) activation(normed);
    } else if (kind < 64) {
      const int c = condition();
      int v = pick([](const Value& x) { return !x.pooled && x.stored && x.channels <= 24; });
      if (v < inputs_) v = any_conv();
      const int modulated = modulate(chance(60) ? norm(v) : v, c);
      if (chance(40)) activation(modulated);
    } else if (kind < 80) {  // a residual connection around one or two layers
      const int v = pick([](const Value& x) { return !x.pooled && x.stored && x.channels <= 24; });
      const int base = v < 0 ? last_input() : v;
      const int inner = chance(70) ? base : pick_vertices();
      int branch = chance(50) && !is_input(inner) ? activation_of_copy(inner) : inner;
      branch = conv(branch, value(base).channels);
      if (chance(40)) branch = activation(branch);
      value(branch).taken = true;
      push({.kind = Kind::sum, .first = chance(50) ? base : branch, .second = -1, .channels = value(base).channels},
           true);
      Step& made = composition_.steps[static_cast<std::size_t>(composition_.count - 1)];
      made.second = made.first == base ? branch : base;
    } else if (kind < 88) {
      const int a = pick([](const Value& x) { return x.channels <= 20; });
      const int b = pick([](const Value& x) { return x.channels <= 20; });
      if (a >= 0 && b >= 0) {
        const int joined = cat(a, b);
        if (!value(joined).pooled && chance(70)) conv_to_any(joined);
      }
    } else if (kind < 97) {  // a pooled feature, of layers that increase
      int v = pick([](const Value& x) { return !x.pooled && x.stored && x.channels <= 20; });
      if (v < inputs_) v = any_conv();
      if (chance(40)) v = norm(v);
      if (chance(40)) v = activation_of_copy(v);
      int pooled = push({.kind = Kind::max_pool, .first = v, .channels = value(v).channels, .pooled = true}, false);
      if (chance(30)) pooled = activation(pooled);
      if (chance(80)) {
        const int other = pick_vertices(20);
        const int joined = chance(50) ? cat(pooled, other) : cat(other, pooled);
        conv_to_any(joined);
      }
    } else {
      const int a = pick_vertices();
      const int wanted = value(a).channels;
      const int b = pick([wanted](const Value& x) { return !x.pooled && x.channels == wanted; });
      if (b >= 0) push({.kind = Kind::sum, .first = a, .second = b, .channels = wanted}, false);
    }
  }
  /// An activation that is not counted as part of the stage before it, since others read that too.
  constexpr int activation_of_copy(int from) {
    return push({.kind = Kind::activation,
                 .first = from,
                 .channels = value(from).channels,
                 .pooled = value(from).pooled,
                 .activation = draw(3)},
                false);
  }

  constexpr void finish() {
    int last = pick([](const Value& x) { return !x.pooled && x.channels <= 40; });
    if (last < inputs_) last = value_count() - 1;
    if (value(last).pooled || chance(40)) last = cat(last, last_input());
    int result = conv(last, 3);
    if (chance(30)) result = activation(result);
    if (!chance(25) || value(last_input()).channels != 3) return;
    const bool input_first = chance(50);
    push({.kind = Kind::sum,
          .first = input_first ? last_input() : result,
          .second = input_first ? result : last_input(),
          .channels = 3},
         true);
  }

  npt::Random random_;
  int condition_channels_;
  int inputs_ = 0;
  Composition composition_{};
  std::array<Value, max_steps + max_inputs> values_{};
};

constexpr Composition composition_of(std::uint64_t seed, int condition_channels) {
  return Composer(seed, condition_channels).compose();
}

/// The inputs, and one line a step, such as "v3 = v0 + v2 [8]".
inline std::string text_of(const Composition& composition) {
  std::string text;
  const auto name = [&composition](int v) {
    return v < composition.inputs ? input_names[v] : "v" + std::to_string(v - composition.inputs);
  };
  for (int i = 0; i < composition.inputs; ++i)
    text += name(i) + " [" + std::to_string(composition.channels_of(i)) + "]\n";
  for (int i = 0; i < composition.count; ++i) {
    const Step& step = composition[i];
    const std::string first = name(step.first), second = step.second < 0 ? "" : name(step.second);
    text += "v" + std::to_string(i) + " = ";
    switch (step.kind) {
      case Kind::conv:
        text += first + " | conv";
        break;
      case Kind::activation:
        text += first + (step.activation == 0 ? " | relu" : step.activation == 1 ? " | tanh" : " | with parameters");
        break;
      case Kind::norm:
        text += first + " | instance_norm";
        break;
      case Kind::modulate:
        text += "modulate(" + first + ", " + second + ")";
        break;
      case Kind::sum:
        text += first + " + " + second;
        break;
      case Kind::cat:
        text += "cat(" + first + ", " + second + ")";
        break;
      case Kind::max_pool:
        text += first + " | max_pool";
        break;
    }
    text += " [" + std::to_string(step.channels) + "]\n";
  }
  return text;
}

}  // namespace random_networks
