/// Objects that calls take and give back, so that each running call has one of its own and a warm call makes none.
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A pool of scratch memory.
/// Threads   lease may be called by any number of threads at a time
/// Memory    as many objects as calls ever ran at the same time; a lease allocates only where all are taken
template <class T>
class Pool {
  struct State {
    std::mutex mutex;
    std::vector<std::unique_ptr<T>> free;
    std::size_t count = 0;  ///< objects made
  };

 public:
  Pool() : state_(std::make_shared<State>()) {}
  Pool(Pool&&) = default;
  Pool& operator=(Pool&&) = default;

  /// An object for as long as this lives.
  class Lease {
   public:
    explicit Lease(State& state) : state_(&state) {
      const std::lock_guard lock(state.mutex);
      if (!state.free.empty()) {
        object_ = std::move(state.free.back());
        state.free.pop_back();
        return;
      }
      object_ = std::make_unique<T>();
      // Space for every object, so that giving one back can't fail.
      state.free.reserve(++state.count);
    }
    ~Lease() {
      const std::lock_guard lock(state_->mutex);
      state_->free.push_back(std::move(object_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

    T& operator*() const noexcept { return *object_; }
    T* operator->() const noexcept { return object_.get(); }

   private:
    State* state_;
    std::unique_ptr<T> object_;
  };

  Lease lease() const { return Lease(*state_); }

 private:
  std::shared_ptr<State> state_;  ///< shared by nobody: it alone needs no complete T to be destroyed
};

}  // namespace npt::inline NPT_ABI
