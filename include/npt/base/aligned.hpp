/// A heap buffer aligned for SIMD: the storage of parameters, packed weights and activations.
#pragma once

#include <npt/config.hpp>

#include <cstddef>
#include <cstring>
#include <limits>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI {

/// A cache line, and the widest SIMD register (AVX-512).
inline constexpr std::size_t simd_alignment = 64;

/// Move-only array of `size()` trivially copyable elements on a 64-byte boundary.
/// A fresh buffer is all zero bytes: padding lanes must never hold NaN by chance.
/// Errors    std::bad_alloc when memory is short or the byte count overflows.
template <class T>
class AlignedBuffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  AlignedBuffer() = default;
  explicit AlignedBuffer(std::size_t size) : data_(allocate(size)), size_(size) {
    if (size != 0) std::memset(static_cast<void*>(data_), 0, size * sizeof(T));
  }
  AlignedBuffer(AlignedBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  AlignedBuffer& operator=(AlignedBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  AlignedBuffer(const AlignedBuffer& other) : data_(allocate(other.size_)), size_(other.size_) {
    if (size_ != 0) std::memcpy(static_cast<void*>(data_), other.data_, size_ * sizeof(T));
  }
  AlignedBuffer& operator=(const AlignedBuffer& other) { return *this = AlignedBuffer(other); }
  ~AlignedBuffer() {
    if (data_ != nullptr) ::operator delete (static_cast<void*>(data_), std::align_val_t{simd_alignment});
  }

  /// Makes space for at least `size` elements. Contents are lost (zeroed) only when the buffer has to grow.
  void grow_to(std::size_t size) {
    if (size > size_) *this = AlignedBuffer(size);
  }

  T* data() noexcept { return data_; }
  const T* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  std::span<T> span() noexcept { return {data_, size_}; }
  std::span<const T> span() const noexcept { return {data_, size_}; }
  T& operator[](std::size_t i) noexcept {
    NPT_ASSERT(i < size_);
    return data_[i];
  }
  const T& operator[](std::size_t i) const noexcept {
    NPT_ASSERT(i < size_);
    return data_[i];
  }

 private:
  static T* allocate(std::size_t size) {
    if (size == 0) return nullptr;
    if (size > std::numeric_limits<std::size_t>::max() / sizeof(T)) throw std::bad_alloc();
    return static_cast<T*>(::operator new (size * sizeof(T), std::align_val_t{simd_alignment}));
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace npt::inline NPT_ABI
