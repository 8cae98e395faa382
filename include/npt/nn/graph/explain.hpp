/// What a network was lowered to, as text: sweeps, stages, what rides along with each product, and where everything
/// lives.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/graph/lower.hpp>
#include <npt/nn/kernel/panel.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace graph::internal {

struct OperationName {
  OperationId id;
  const char* name;
};

template <class... Ops>
std::vector<OperationName> operation_names(OperationList<Ops...>) {
  return {{operation_id<Ops>, Ops::name}...};
}

NPT_INLINE_CLASS(class, Explanation);
template <class>
class BasicExplanation {
 public:
  BasicExplanation(const Program& program, std::vector<NamedParameter> parameters,
                   std::vector<OperationName> operations)
      : program_(program), parameters_(std::move(parameters)), operations_(std::move(operations)) {}

  std::string text() {
    const std::string encoded = program_.inputs.encoded < 0 ? "" : program_.inputs[program_.inputs.encoded].name;
    line("%d stages in %d sweeps%s. %.0f multiply-adds a vertex.", program_.stage_count, program_.sweep_count,
         program_.encoder_sweeps == 0
             ? ""
             : ("; " + std::to_string(program_.encoder_sweeps) + " of them encode " + encoded).c_str(),
         program_.multiply_adds);
    line("Inputs: %s.", inputs().c_str());
    if (!encoded.empty() && !program_.paired)
      line("No vertex of %s meets one of the others: it may have any number of them.", encoded.c_str());
    else if (program_.inputs.count > 1)
      line("%s", "Inputs meet vertex by vertex: equal counts are needed.");
    std::size_t channels = 0;
    for (int b = 0; b < program_.buffer_count; ++b)
      channels += std::max(width(program_.buffer_channels[0], b), width(program_.buffer_channels[1], b));
    for (const Activation& t : program_.activations)
      if (t.storage == Storage::code && program_.code_alias < 0) channels += static_cast<std::size_t>(t.channels);
    line("Feature maps kept between sweeps: %zu floats a vertex. Scratch of a task: %d tiles.", channels,
         program_.scratch_count);
    for (int s = 0; s < program_.sweep_count; ++s) sweep(s);
    return text_;
  }

 private:
  template <class... Args>
  void line(const char* format, Args... args) {
    char buffer[512];
    std::snprintf(buffer, sizeof buffer, format, args...);
    text_ += buffer;
    text_ += '\n';
  }

  std::string inputs() const {
    std::string text;
    for (int i = 0; i < program_.inputs.count; ++i) {
      const Input& input = program_.inputs[i];
      text += (i == 0 ? "" : ", ") + std::string(input.name) + " [V, " + std::to_string(input.channels) + "]";
    }
    return text;
  }

  static std::size_t width(const auto& widths, int i) {
    return static_cast<std::size_t>(widths[static_cast<std::size_t>(i)]);
  }

  void sweep(int s) {
    const Sweep& sweep = program_.sweep(s);
    const InputList& inputs = program_.inputs;
    const char* name = inputs[sweep.encodes ? inputs.encoded : inputs.of_result()].name;
    line("\nsweep %d%s", s + 1,
         program_.encoder_sweeps == 0 ? "" : (std::string(", over the vertices of ") + name).c_str());
    for (int i = sweep.first_stage; i < sweep.first_stage + sweep.stage_count; ++i) stage(program_.stage(i));
  }

  void stage(const Stage& stage) {
    const std::string shape = std::to_string(stage.columns) + " -> " + std::to_string(stage.rows);
    std::string name = name_of(stage.weight);
    for (int f = 0; f < stage.folded_count; ++f)
      name += (f == 0 ? " * (" : " + ") + name_of(stage.folded[static_cast<std::size_t>(f)].weight);
    if (stage.folded_count != 0) name += ")";
    line("  %-32s %-13s %s", name.c_str(), shape.c_str(), (sources(stage) + "  =>  " + output(stage)).c_str());
  }

  std::string sources(const Stage& stage) {
    std::string text;
    for (int s = 0; s < stage.source_count; ++s) {
      const Source& source = stage.sources[static_cast<std::size_t>(s)];
      if (s != 0) text += " ++ ";
      text += name_of_activation(source.activation) + chain(source.chain);
    }
    return text;
  }

  std::string output(const Stage& stage) {
    const Activation& out = program_.activation(stage.output);
    std::string text = stage.bias_is_dead ? "(bias unused)" : "+ bias";
    text += chain(stage.epilogue);
    switch (out.storage) {
      case Storage::scratch:
        text += stage.output == program_.output ? " -> result" : " -> scratch " + std::to_string(out.place);
        break;
      case Storage::buffer:
        text += " -> map " + std::to_string(out.place);
        break;
      case Storage::code:
        text += " -> code";
        break;
      case Storage::none:
        text += " -> nothing";
        break;
      default:
        break;
    }
    if (out.moments) text += ", moments";
    if (stage.gathers_maxima) text += ", maxima";
    return text;
  }

  std::string chain(const Chain& chain) {
    std::string text;
    for (int c = 0; c < chain.count; ++c) {
      const Step& step = chain.steps[static_cast<std::size_t>(c)];
      for (const OperationName& operation : operations_)
        if (operation.id == step.operation) text += std::string(" | ") + operation.name;
      if (step.other >= 0) text.append("(").append(name_of_activation(step.other)).append(")");
    }
    return text;
  }

  std::string name_of_activation(int t) const {
    const Activation& activation = program_.activation(t);
    switch (activation.storage) {
      case Storage::input:
        return program_.inputs[activation.place].name;
      case Storage::scratch:
        return "scratch " + std::to_string(activation.place);
      case Storage::buffer:
        return "map " + std::to_string(activation.place);
      case Storage::code:
        return "code";
      case Storage::pooled:
        return "maxima";
      case Storage::none:
        break;
    }
    return "nothing";
  }

  std::string name_of(int weight) const {
    for (const NamedParameter& p : parameters_)
      if (p.parameter.offset == weight) return p.name.substr(0, p.name.rfind('.'));
    return "?";
  }

  const Program& program_;
  std::vector<NamedParameter> parameters_;
  std::vector<OperationName> operations_;
  std::string text_;
};

}  // namespace graph::internal

/// The lowered network as text, one line a stage: the convolution, its shape, what it reads and through which pointwise
/// layers, and what happens to the product before it is stored.
template <class Net>
std::string explain() {
  return graph::internal::Explanation(graph::program_of<Net>, list_parameters(graph::bound_network<Net>),
                                      graph::internal::operation_names(typename graph::ResultOf<Net>::Operations{}))
      .text();
}

}  // namespace npt::inline NPT_ABI
