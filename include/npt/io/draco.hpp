/// Meshes that Draco compressed (KHR_draco_mesh_compression), by Google's libdraco. Part of reading glTF where
/// NPT_WITH_DRACO is defined, as target npt::draco does; without it such files are refused.
/// Errors    npt::Error for bytes that libdraco refuses, and for attributes that aren't there
#pragma once

#include <draco/compression/decode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/mesh/mesh.h>
#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/triangles.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

class DracoMesh {
 public:
  /// `place` stands in messages of errors.
  DracoMesh(std::string_view bytes, std::string file, std::string place)
      : file_(std::move(file)), place_(std::move(place)) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    try {
      auto result = decoder.DecodeMeshFromBuffer(&buffer);
      if (!result.ok()) fail(result.status().error_msg_string());
      mesh_ = std::move(result).value();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& error) {  // damaged counts end as failed allocations
      fail(error.what());
    }
  }

  std::size_t vertex_count() const { return mesh_->num_points(); }

  std::vector<Triangle> triangles() const {
    std::vector<Triangle> result(mesh_->num_faces());
    for (std::uint32_t f = 0; f < result.size(); ++f)
      for (std::size_t c = 0; c < 3; ++c) {
        result[f][c] = mesh_->face(draco::FaceIndex(f))[c].value();
        if (result[f][c] >= vertex_count()) fail("a corner at vertex " + std::to_string(result[f][c]));
      }
    return result;
  }

  /// An attribute by its number in the extension. components: 1 to 4
  std::vector<float> attribute(std::uint32_t number, std::size_t components) const {
    const draco::PointAttribute* a = mesh_->GetAttributeByUniqueId(number);
    if (a == nullptr || static_cast<std::size_t>(a->num_components()) != components)
      fail(a == nullptr
               ? "no attribute " + std::to_string(number)
               : "attribute " + std::to_string(number) + " of " + std::to_string(a->num_components()) + " numbers");
    std::vector<float> values(vertex_count() * components);
    for (std::uint32_t v = 0; v < vertex_count(); ++v) {
      std::array<float, 4> row{};
      const draco::AttributeValueIndex at = a->mapped_index(draco::PointIndex(v));
      if (at.value() >= a->size() || !a->ConvertValue(at, static_cast<std::int8_t>(components), row.data()))
        fail("attribute " + std::to_string(number) + " without a value for vertex " + std::to_string(v));
      for (std::size_t c = 0; c < components; ++c) values[v * components + c] = row[c];
    }
    return values;
  }

 private:
  [[noreturn]] void fail(const std::string& found) const {
    throw Error({.file = file_, .place = place_, .found = found, .expected = "a mesh that libdraco can read"});
  }

  std::string file_, place_;
  std::unique_ptr<draco::Mesh> mesh_;
};

}  // namespace npt::inline NPT_ABI::internal
