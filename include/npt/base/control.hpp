/// Progress of long work, and a way to stop it.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>

#include <functional>

namespace npt::inline NPT_ABI {

/// What a caller gives to work that may take more than 0.2 s. Both may be empty.
struct Control {
  std::function<void(double)> progress{};  ///< called with the fraction that is done, from 0 to 1
  std::function<bool()> stop{};            ///< asked between steps; true ends the work

  /// Errors    npt::Error (ErrorCode::stopped) where the caller asked to stop
  void step(double done) const {
    if (stop && stop()) throw Error({.file = "work", .found = "a request to stop", .code = ErrorCode::stopped});
    if (progress) progress(done);
  }

  /// Of the part of this work from one fraction to another. This control must outlive it.
  Control part(double first, double last) const {
    Control result{.progress = {}, .stop = stop};
    if (progress) result.progress = [this, first, last](double done) { progress(first + (last - first) * done); };
    return result;
  }
};

}  // namespace npt::inline NPT_ABI
