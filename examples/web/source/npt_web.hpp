/// What the page's functions share: errors as JavaScript gets them, texts, meshes, transfers and characters.
#pragma once

#include <npt/base/error.hpp>
#include <npt/io/json.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/validate.hpp>
#include <npt/npt.hpp>
#include <npt/scene/pose.hpp>
#include <npt/scene/scene.hpp>
#include <npt/transfer/animation.hpp>

#include <cmath>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <emscripten.h>

#define NPT_WEB EMSCRIPTEN_KEEPALIVE

namespace web {

namespace fs = std::filesystem;

// ---- what went wrong ----

enum class ErrorKind { none, argument, input, memory, internal };

inline std::string last_error;
inline ErrorKind last_kind = ErrorKind::none;
inline npt::ErrorCode last_code = npt::ErrorCode::bad_input;
inline npt::Remedy last_remedy = npt::Remedy::none;

inline void failed(ErrorKind kind, const char* message) {
  last_kind = kind;
  last_error = message;
  last_code = npt::ErrorCode::bad_input;
  last_remedy = npt::Remedy::none;
}

/// f(), or `otherwise` where it throws.
template <class F, class R>
R guarded(R otherwise, const F& f) {
  try {
    return f();
  } catch (const npt::Error& error) {
    failed(ErrorKind::input, error.what());
    last_code = error.code();
    last_remedy = error.remedy();
  } catch (const std::bad_alloc&) {
    failed(ErrorKind::memory, "out of memory");
  } catch (const std::length_error&) {
    failed(ErrorKind::memory, "out of memory");
  } catch (const std::exception& error) {
    failed(ErrorKind::internal, error.what());
  }
  return otherwise;
}

// ---- what JavaScript gets besides numbers ----

/// The last text that was returned: valid until the next one.
inline std::string last_text;

inline const char* returned(std::string text) {
  last_text = std::move(text);
  return last_text.c_str();
}

inline std::string quoted(const std::string& text) {
  std::string result;
  return npt::internal::append_json_string(result, text) ? result : "\"(no UTF-8)\"";
}

inline std::string number(double x) { return std::isfinite(x) ? npt::number_text(x) : std::string("null"); }

// ---- what there is ----

/// A mesh as a file or its maker gave it, and the clips of its file.
struct Mesh {
  std::string name;
  npt::Mesh mesh{};
  std::vector<npt::Triangle> triangles{};
  bool in_metres = false;  ///< its file says so
  std::unique_ptr<npt::Scene> scene{};
  std::unique_ptr<npt::ScenePoser> poser{};

  npt::MeshView view() const { return {mesh.coordinates(), triangles, name}; }
};

inline Mesh* adopted(std::unique_ptr<Mesh> mesh) {
  npt::validate(mesh->mesh, mesh->name);
  mesh->triangles = npt::triangulate(mesh->mesh);
  return mesh.release();
}

struct Transfer {
  npt::PoseTransfer transfer;
};

struct Character {
  const Transfer& owner;
  std::string name;
  npt::Character character;
};

/// Metres in a unit of what is written to `path`, where files say metres and the mesh's own doesn't; else 1.
inline double metres_in(const Transfer* transfer, const Mesh& mesh, const fs::path& path) {
  if (transfer == nullptr || path.extension() != ".glb") return 1;
  return npt::output_unit(transfer->transfer, mesh.view(), mesh.in_metres);
}

}  // namespace web
