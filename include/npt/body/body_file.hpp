/// Body models as files: safetensors with SMPL's names.
///   v_template [V, 3], shapedirs [V, 3, S], J_regressor [J, V], weights [V, J], f [F, 3], parents [J] and, where there
///   are any, posedirs [V, 3, 9 (J - 1)]; metadata joint_names (separated by blanks), unit, up, front, rest_pose,
///   licence, source
/// Numerics  any stored type of numbers is accepted and converted to float; written as F32 and I32
/// Errors    npt::Error that names the file, and all missing or misshapen tensors at once, or the one whose values
///           don't make a body
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/error.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/body_tables.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/text.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace body::internal {

/// The sizes of a body file, and all that is wrong with its tensors.
class BodyShapes {
 public:
  explicit BodyShapes(const SafetensorsFile& file) {
    vertices_ = size_of_first(file, "v_template", {any, 3});
    joints_ = size_of_first(file, "parents", {any});
    const std::uint64_t corrections = joints_ == any ? any : 9 * (joints_ - 1);
    expect(file, "shapedirs", {vertices_, 3, any});
    expect(file, "J_regressor", {joints_, vertices_});
    expect(file, "weights", {vertices_, joints_});
    expect(file, "f", {any, 3});
    if (file.find("posedirs") != nullptr) expect(file, "posedirs", {vertices_, 3, corrections});
    if (!problems_.empty())
      throw Error({.file = file.name(), .found = problems_, .expected = "a body with every tensor"});
    // Indices are 32 bits wide; no body comes near that.
    require(vertices_ > 0 && joints_ > 0 && vertices_ < (std::uint64_t{1} << 31) / joints_, file.name(),
            "tensor 'weights'", text({vertices_, joints_}),
            "at least one vertex and joint, and fewer than 2^31 weights");
  }

  std::size_t vertices() const { return static_cast<std::size_t>(vertices_); }
  std::size_t joints() const { return static_cast<std::size_t>(joints_); }

 private:
  /// A size that the file may choose.
  static constexpr std::uint64_t any = std::numeric_limits<std::uint64_t>::max();

  std::uint64_t size_of_first(const SafetensorsFile& file, std::string_view name, const TensorShape& wanted) {
    return expect(file, name, wanted) ? file.find(name)->shape[0] : any;
  }

  bool expect(const SafetensorsFile& file, std::string_view name, const TensorShape& wanted) {
    const FileTensor* tensor = file.find(name);
    bool good = tensor != nullptr && tensor->shape.size() == wanted.size();
    for (std::size_t i = 0; good && i < wanted.size(); ++i) good = wanted[i] == any || tensor->shape[i] == wanted[i];
    if (good) return true;
    if (!problems_.empty()) problems_ += "; ";
    problems_ += tensor == nullptr ? "no tensor '" + std::string(name) + "' of shape " + text(wanted)
                                   : "tensor '" + std::string(name) + "' of shape " + to_string(tensor->shape) +
                                         " instead of " + text(wanted);
    return false;
  }

  static std::string text(const TensorShape& shape) {
    std::string result = "[";
    for (const std::uint64_t n : shape)
      result += (result.size() > 1 ? ", " : "") + (n == any ? "any" : std::to_string(n));
    return result + "]";
  }

  std::uint64_t vertices_ = any, joints_ = any;
  std::string problems_;
};

/// A whole number of a tensor as the library holds it, or an error.
template <class Int>
Int index_value(std::int64_t value, std::int64_t least, const std::string& file, const char* tensor, std::size_t at) {
  if (value < least || value > std::numeric_limits<std::int32_t>::max()) {
    throw Error({file, "tensor '" + std::string(tensor) + "', element " + std::to_string(at), std::to_string(value),
                 "an index from " + std::to_string(least)});
  }
  return static_cast<Int>(value);
}

}  // namespace body::internal

/// The body in an open file.
NPT_INLINE BodyModel load_body(const SafetensorsFile& file) {
  using namespace body::internal;
  const BodyShapes shapes(file);
  const std::size_t v = shapes.vertices(), j = shapes.joints();
  BodyTables body;
  body.v_template = to_float(file.at("v_template"));
  body.shapedirs = to_float(file.at("shapedirs"));
  if (file.find("posedirs") != nullptr) body.posedirs = to_float(file.at("posedirs"));
  body.J_regressor = SparseMatrix::from_dense(as_span(to_float(file.at("J_regressor"))), j, v);
  body.weights = SparseMatrix::from_dense(as_span(to_float(file.at("weights"))), v, j);
  const std::vector<std::int64_t> corners = to_int64(file.at("f")), parents = to_int64(file.at("parents"));
  body.triangles.resize(corners.size() / 3);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    body.triangles[i / 3][i % 3] = index_value<std::uint32_t>(corners[i], 0, file.name(), "f", i);
  }
  for (std::size_t i = 0; i < j; ++i)
    body.parents.push_back(index_value<int>(parents[i], -1, file.name(), "parents", i));
  body.metadata = file.metadata();
  if (const auto names = body.metadata.find("joint_names"); names != body.metadata.end()) {
    std::string_view rest = names->second;
    for (std::string_view name; !(name = next_word(rest)).empty();) body.joint_names.emplace_back(name);
    body.metadata.erase(names);
  }
  return BodyModel(std::move(body), file.name());
}

NPT_INLINE BodyModel load_body(const std::filesystem::path& path) { return load_body(SafetensorsFile::read(path)); }

/// Writes what load_body() reads. Matrices are stored dense.
NPT_INLINE void save_body(const BodyModel& model, const std::filesystem::path& path) {
  const BodyTables& body = model.tables();
  const std::uint64_t v = body.vertex_count(), j = body.joint_count(), s = body.shape_count();
  const std::vector<float> regressor = body.J_regressor.to_dense(), weights = body.weights.to_dense();
  const std::vector<std::int32_t> parents(body.parents.begin(), body.parents.end());
  std::vector<std::int32_t> corners;
  corners.reserve(3 * body.triangles.size());
  for (const auto& triangle : body.triangles)
    for (const std::uint32_t corner : triangle) corners.push_back(static_cast<std::int32_t>(corner));
  std::vector<FileTensor> tensors;
  const auto add = [&tensors](const char* name, Dtype dtype, const TensorShape& shape,
                              std::span<const std::byte> bytes) {
    tensors.push_back({.name = name, .dtype = dtype, .shape = shape, .bytes = bytes});
  };
  add("v_template", Dtype::f32, {v, 3}, std::as_bytes(as_span(body.v_template)));
  add("shapedirs", Dtype::f32, {v, 3, s}, std::as_bytes(as_span(body.shapedirs)));
  if (!body.posedirs.empty()) add("posedirs", Dtype::f32, {v, 3, 9 * (j - 1)}, std::as_bytes(as_span(body.posedirs)));
  add("J_regressor", Dtype::f32, {j, v}, std::as_bytes(as_span(regressor)));
  add("weights", Dtype::f32, {v, j}, std::as_bytes(as_span(weights)));
  add("f", Dtype::i32, {body.triangles.size(), 3}, std::as_bytes(as_span(corners)));
  add("parents", Dtype::i32, {j}, std::as_bytes(as_span(parents)));
  std::map<std::string, std::string> metadata = body.metadata;
  for (const std::string& name : body.joint_names) {
    std::string& names = metadata["joint_names"];
    names += (names.empty() ? "" : " ") + name;
  }
  write_safetensors(path, as_span(tensors), metadata);
}

}  // namespace npt::inline NPT_ABI
