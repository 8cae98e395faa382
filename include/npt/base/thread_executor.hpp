/// The executor on threads of its own, with nothing but the standard library. For programs without oneTBB and without a
/// parallel loop of their own, and for ThreadSanitizer, which doesn't understand oneTBB.
#pragma once

#include <npt/base/executor.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace npt::inline NPT_ABI {

namespace parallel::internal {

/// Threads that wait for a loop, run it together with the thread that asked for it, and wait again.
class ThreadPool {
 public:
  /// A loop: `call` gives an index and a slot to the function behind `f`.
  struct Job {
    const void* f = nullptr;
    void (*call)(const void* f, int i, int slot) = nullptr;
    int count = 0;
    std::atomic<int> next{0};
    std::exception_ptr error{};  ///< the first that a thread of the pool met; guarded by the pool's mutex

    void run(int slot) {
      for (int i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) call(f, i, slot);
    }
    void abandon() { next.store(count, std::memory_order_relaxed); }
  };

  ThreadPool() = default;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  ~ThreadPool() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  /// Apart from the constructor, so that threads already running are joined when the system refuses a further one.
  void start(int threads) {
    threads_.reserve(static_cast<std::size_t>(threads));
    for (int slot = 1; slot <= threads; ++slot) threads_.emplace_back([this, slot] { serve(slot); });
  }

  /// Whether the pool was free and is now the caller's until release().
  bool acquire() { return !taken_.exchange(true, std::memory_order_acquire); }
  void release() { taken_.store(false, std::memory_order_release); }

  void run(Job& job) {
    {
      const std::lock_guard lock(mutex_);
      job_ = &job;
      busy_ = static_cast<int>(threads_.size());
      ++generation_;
    }
    wake_.notify_all();
    std::exception_ptr own;
    try {
      job.run(0);
    } catch (...) {
      own = std::current_exception();
      job.abandon();
    }
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return busy_ == 0; });
    lock.unlock();
    if (own == nullptr) own = job.error;
    if (own != nullptr) std::rethrow_exception(own);
  }

 private:
  void serve(int slot) {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
      Job& job = *job_;
      lock.unlock();
      std::exception_ptr error;
      try {
        job.run(slot);
      } catch (...) {
        error = std::current_exception();
        job.abandon();
      }
      lock.lock();
      if (error != nullptr && job.error == nullptr) job.error = error;
      if (--busy_ == 0) done_.notify_one();
    }
  }

  std::vector<std::thread> threads_;
  std::atomic<bool> taken_{false};
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::uint64_t generation_ = 0;  ///< counts the loops
  int busy_ = 0;                  ///< threads that have not finished the current one
  Job* job_ = nullptr;
  bool stop_ = false;
};

}  // namespace parallel::internal

/// Copies share the threads, which end with the last copy. One loop at a time uses them: a loop that finds them at
/// work, for another caller or around itself, runs in its calling thread.
/// Errors  std::system_error when the system gives no thread; what a task throws is thrown by for_each, once all
///         threads are done
class ThreadExecutor {
 public:
  /// 0: as many threads as the process may use, the calling one among them.
  explicit ThreadExecutor(int threads = 0)
      : slots_(threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
        pool_(std::make_shared<parallel::internal::ThreadPool>()) {
    pool_->start(slots_ - 1);
  }

  int slots() const { return slots_; }

  template <class F>
  void for_each(int count, const F& f) const {
    if (slots_ == 1 || count <= 1 || !pool_->acquire()) {
      for (int i = 0; i < count; ++i) f(i, 0);
      return;
    }
    const struct Release {
      parallel::internal::ThreadPool& pool;
      ~Release() { pool.release(); }
    } release{*pool_};
    parallel::internal::ThreadPool::Job job;
    job.f = &f;
    job.call = [](const void* function, int i, int slot) { (*static_cast<const F*>(function))(i, slot); };
    job.count = count;
    pool_->run(job);
  }

 private:
  int slots_;
  std::shared_ptr<parallel::internal::ThreadPool> pool_;
};
static_assert(Executor<ThreadExecutor>);

}  // namespace npt::inline NPT_ABI
