/// Ctrl-C in the middle of long work: the loops ask between two pieces, so that what is being written is finished or
/// removed and no temporary file stays. A second Ctrl-C ends the program at once.
#pragma once

#include "host/host.hpp"

#include <atomic>
#include <exception>

namespace program {

struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

inline std::atomic<bool>& interrupt_flag() {
  static std::atomic<bool> flag{false};
  static_assert(std::atomic<bool>::is_always_lock_free);
  return flag;
}

/// To be called once, before any work that calls stop_if_interrupted().
inline void catch_interrupts() {
  interrupt_flag().store(false);
  host::on_interrupt([] { interrupt_flag().store(true); });
}

inline void stop_if_interrupted() {
  if (interrupt_flag().load()) throw Interrupted();
}

}  // namespace program
