/// What the host program and the instruction sets' units agree on. No header of npt here, and no type of npt: those
/// differ between instruction sets.
#pragma once

#include <cstddef>
#include <cstdint>

/// A network with packed weights. `result` and `identity` hold 3 * vertices numbers, so does `pose`.
struct Retarget {
  virtual ~Retarget() = default;
  virtual void operator()(const float* pose, const float* identity, float* result, std::size_t vertices) const = 0;
  virtual const char* instruction_set() const = 0;
};

extern "C" {
/// Seeded random weights. The caller deletes.
Retarget* make_retarget(std::uint64_t seed);
}
