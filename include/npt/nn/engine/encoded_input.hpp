/// What a network's encoder leaves, as its holders see it.
#pragma once

#include <npt/config.hpp>

#include <cstdint>
#include <memory>

namespace npt::inline NPT_ABI {

namespace engine {
template <class T>
struct CodeStorage;
template <class T, class Exec>
class Core;
}  // namespace engine

/// What a network's encoder made of the encoded input, for many calls that share it. Belongs to the engine that made
/// it, as long as that lives: the engine may be moved, and every other one refuses the code.
template <class T = float>
class EncodedInput {
 public:
  /// Vertices of the input; 0: nothing encoded yet.
  int vertices() const { return vertices_; }

 private:
  template <class, class>
  friend class engine::Core;
  int vertices_ = 0;
  std::uint64_t program_ = 0;                        ///< PackedProgram::id of the engine that made it
  std::shared_ptr<engine::CodeStorage<T>> storage_;  ///< shared by copies; encoding into one gives it its own
};

}  // namespace npt::inline NPT_ABI
