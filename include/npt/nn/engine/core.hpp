/// Engines apart from their networks' types, whole: what core_class.hpp declares and what it calls.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/engine/core_class.hpp>
#include <npt/nn/engine/forward.hpp>
#include <npt/nn/engine/packed_program.hpp>
#include <npt/nn/engine/workspace.hpp>
#include <npt/nn/graph/program.hpp>
#include <npt/nn/simd/amx.hpp>
#include <npt/nn/simd/bf16.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI::engine {

template <class T>
inline constexpr bool pairs_compiled = std::is_same_v<T, float>&& simd::has_bf16;

template <class T>
bool supports(Precision precision) {
  switch (precision) {
    case Precision::native:
    case Precision::automatic:
      return true;
    case Precision::bf16:
      return pairs_compiled<T>;
    case Precision::bf16x2:
    case Precision::bf16x3:
      return std::is_same_v<T, float> && simd::has_matrix_registers();
  }
  return false;
}

/// What runs in a precision.
/// Errors  npt::Error where this build or machine can't multiply in it
template <class T>
const CompiledProgram<T>& program_for(const CompiledNetwork<T>& network, Precision precision) {
  if (!supports<T>(precision))
    throw Error(
        {.file = "precision",
         .found = std::string(name_of(precision)) + " in an engine compiled for " NPT_ISA_NAME,
         .expected =
             precision == Precision::bf16
                 ? "a float engine compiled with AVX512_BF16, or the native precision"
                 : "a float engine compiled with AMX, a processor and a system that have it, or another precision"});
  const bool pairs = pairs_compiled<T> && precision == Precision::bf16 && !simd::has_matrix_registers();
  return pairs ? network.pairs : network.plain;
}

template <class T, class Exec>
Core<T, Exec>::Core(const CompiledNetwork<T>& network, std::span<const T> parameters, Precision precision,
                    Exec executor)
    : Core(*program_for(network, precision).program, parameters, resolve<T>(precision, *network.plain.program),
           program_for(network, precision).transforms, std::move(executor)) {}
template <class T, class Exec>
Core<T, Exec>::Core(const graph::Program& program, std::span<const T> parameters, Precision precision,
                    RowTransforms<T> transforms, Exec executor)
    : packed_(std::make_shared<const PackedProgram<T>>(program, parameters, precision)),
      transforms_(transforms),
      executor_(std::move(executor)) {}

template <class T, class Exec>
Precision Core<T, Exec>::precision() const {
  return packed_->precision();
}

template <class T, class Exec>
const graph::InputList& Core<T, Exec>::inputs() const {
  return packed_->program().inputs;
}

template <class T, class Exec>
void Core<T, Exec>::operator()(Workspace<T>& workspace, const Inputs<T>& inputs, std::span<T> result) const {
  const NetworkCall<T> call{inputs, result};
  run(workspace, {&call, 1});
}

template <class T, class Exec>
void Core<T, Exec>::run(std::span<const NetworkCall<T>> calls) const {
  const auto lease = pool_.lease();
  run(*lease, calls);
}

template <class T, class Exec>
void Core<T, Exec>::run(Workspace<T>& workspace, std::span<const NetworkCall<T>> calls) const {
  for (std::size_t i = 0; i < calls.size(); ++i) check(calls[i], calls.size() == 1 ? only_call : i);
  while (!calls.empty()) {
    const std::size_t count = batch_size(calls);
    run_batch(workspace.storage_, calls.first(count));
    calls = calls.subspan(count);
  }
}

template <class T, class Exec>
void Core<T, Exec>::encode(std::span<const T> values, EncodedInput<T>& code, const Control& control) const {
  const std::size_t vertices = count_vertices(encoded_input("a network"), values.size());
  const auto lease = pool_.lease();
  WorkspaceStorage<T>& memory = lease->storage_;
  memory.encoded.clear();
  add_encoded(memory.encoded, values, vertices);
  code.vertices_ = 0;  // should anything be thrown
  if (code.storage_.use_count() != 1) code.storage_ = std::make_shared<CodeStorage<T>>();
  forward(memory).encode(*code.storage_, executor_, control);
  code.vertices_ = static_cast<int>(vertices);
  code.program_ = packed_->id();
}

template <class T, class Exec>
EncodedInput<T> Core<T, Exec>::encode(std::span<const T> values) const {
  EncodedInput<T> code;
  encode(values, code);
  return code;
}

template <class T, class Exec>
void Core<T, Exec>::decode(const EncodedInput<T>& code, const Inputs<T>& others, std::span<T> result,
                           const Control& control) const {
  const Input& input = encoded_input("a code");
  if (code.vertices_ == 0)
    throw Error({.file = input.name, .found = "an empty code", .expected = "one made by encode"});
  if (code.program_ != packed_->id())
    throw Error(
        {.file = input.name, .found = "a code that another engine made", .expected = "one made by this engine"});
  const CallVertices vertices =
      check(NetworkCall<T>{others, result}, only_call, static_cast<std::size_t>(code.vertices_));
  const auto lease = pool_.lease();
  WorkspaceStorage<T>& memory = lease->storage_;
  memory.main.clear();
  BatchMesh<T> mesh{.result = result.data(), .vertices = static_cast<int>(vertices.result)};
  for (int i = 0, place = 0; i < inputs().count; ++i)
    if (i != inputs().encoded) mesh.inputs[static_cast<std::size_t>(i)] = others[place++].data();
  memory.main.add(mesh);
  forward(memory).decode(*code.storage_, executor_, control);
}

template <class T, class Exec>
Forward<T> Core<T, Exec>::forward(WorkspaceStorage<T>& memory) const {
  return Forward<T>(*packed_, transforms_, memory);
}

template <class T, class Exec>
const Input& Core<T, Exec>::encoded_input(const char* found) const {
  if (inputs().encoded < 0) throw Error({.file = inputs()[0].name, .found = found, .expected = "several inputs"});
  return inputs()[inputs().encoded];
}

template <class T, class Exec>
CallVertices Core<T, Exec>::check(const NetworkCall<T>& call, std::size_t number, std::size_t code_vertices) const {
  return check_call(inputs(), packed_->program().paired, call, number, code_vertices);
}

template <class T, class Exec>
std::size_t Core<T, Exec>::batch_size(std::span<const NetworkCall<T>> calls) const {
  std::size_t count = 0;
  std::size_t vertices = 0;
  const std::size_t most = batch_vertices * static_cast<std::size_t>(executor_.slots());
  while (count < calls.size() && (count == 0 || vertices + vertices_of(calls[count]) <= most))
    vertices += vertices_of(calls[count++]);
  return count;
}

template <class T, class Exec>
void Core<T, Exec>::add_encoded(MeshBatch<T>& batch, std::span<const T> values, std::size_t vertices) const {
  BatchMesh<T> mesh{.vertices = static_cast<int>(vertices)};
  mesh.inputs[static_cast<std::size_t>(inputs().encoded)] = values.data();
  batch.add(mesh);
}

template <class T, class Exec>
int Core<T, Exec>::code_of(MeshBatch<T>& batch, std::span<const T> values) const {
  const std::size_t vertices = values.size() / channels_of(inputs().encoded);
  const int known = static_cast<int>(batch.meshes.size());
  for (int code = 0; code < known; ++code) {
    const BatchMesh<T>& mesh = batch.meshes[static_cast<std::size_t>(code)];
    if (mesh.inputs[static_cast<std::size_t>(inputs().encoded)] == values.data() &&
        mesh.vertices == static_cast<int>(vertices))
      return code;
  }
  add_encoded(batch, values, vertices);
  return known;
}

template <class T, class Exec>
void Core<T, Exec>::run_batch(WorkspaceStorage<T>& memory, std::span<const NetworkCall<T>> calls) const {
  memory.encoded.clear();
  memory.main.clear();
  for (const NetworkCall<T>& call : calls) {
    BatchMesh<T> mesh{.result = call.result.data(), .vertices = static_cast<int>(vertices_of(call))};
    for (int i = 0; i < inputs().count; ++i)
      if (i == inputs().encoded)
        mesh.code = code_of(memory.encoded, call.inputs[i]);
      else
        mesh.inputs[static_cast<std::size_t>(i)] = call.inputs[i].data();
    memory.main.add(mesh);
  }
  Forward<T> pass = forward(memory);
  if (inputs().encoded >= 0) pass.encode(memory.code, executor_);
  if (memory.encoded.meshes.size() == calls.size())
    pass.decode_and_consume(memory.code, executor_);
  else
    pass.decode(memory.code, executor_);
}

}  // namespace npt::inline NPT_ABI::engine
