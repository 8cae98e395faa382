/// Whole files in, whole files out. A file that is written appears under its name only when it is complete.
/// Errors    npt::Error that names the path and the system's reason
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/platform.hpp>
#include <npt/config.hpp>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace npt::inline NPT_ABI {

namespace internal {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, CloseFile>;

/// The reason of the last failed system call.
inline std::string system_reason() { return std::generic_category().message(errno); }

inline std::string file_kind(std::filesystem::file_type type) {
  using std::filesystem::file_type;
  return type == file_type::not_found   ? "no such file"
         : type == file_type::directory ? "a directory"
                                        : "a device or pipe";
}

}  // namespace internal

/// No file of npt comes near this size; a larger one is a mistake that would only fill the memory.
inline constexpr std::uint64_t max_file_size = std::uint64_t{8} << 30;

/// The bytes of a file of at most `limit` bytes. A path that is no regular file is an error: reading a pipe or a device
/// could block or never end.
NPT_INLINE std::string read_file(const std::filesystem::path& path, std::uint64_t limit = max_file_size) {
  const auto fail = [&path](std::string found, std::string expected) {
    return Error({.file = path.string(), .found = std::move(found), .expected = std::move(expected)});
  };
  using std::filesystem::file_type;
  std::error_code code;
  const file_type type = std::filesystem::status(path, code).type();
  if (type == file_type::none) throw fail(code.message(), "a readable file");
  if (type != file_type::regular) throw fail(internal::file_kind(type), "a file");
  const internal::FileHandle file(platform::open_file(path, "rb"));
  if (!file) throw fail(internal::system_reason(), "a readable file");
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (code) throw fail(code.message(), "a readable file");
  if (size > limit) throw fail(std::to_string(size) + " bytes", "at most " + std::to_string(limit));
  std::string bytes(static_cast<std::size_t>(size), '\0');
  const std::size_t got = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (std::ferror(file.get()) != 0) throw fail(internal::system_reason(), "a readable file");
  if (got != bytes.size())
    throw fail(std::to_string(got) + " bytes", std::to_string(size) + ", the size when reading began");
  return bytes;
}

/// A file that is written under a temporary name beside `path` and takes its place in commit(). Without commit() (an
/// exception on the way) the temporary file is removed and what stood at `path` is untouched. An existing file keeps
/// its permissions, a symbolic link keeps pointing and its target is replaced.
///
/// The bytes are on the disk before the file gets its name (fsync), so that also after a loss of power the name stands
/// for the old file or the whole new one. The folder is not synced: which of the two it is then, is left open. On a
/// virtual disk with ext4, a thousand files of 200 KB take 0.4 s unsynced, 5 to 8 s synced, and 12 s with their folder
/// synced as well; a transfer that makes such a file takes 50 ms or more.
class AtomicFile {
 public:
  NPT_INLINE explicit AtomicFile(const std::filesystem::path& path) : name_(path.string()), target_(resolve(path)) {
    temporary_ = target_;
    temporary_ += ".part-" + std::to_string(platform::process_id()) + "-" + std::to_string(next_number());
    // A file of that name that someone else put there is never overwritten.
    file_.reset(platform::create_file(temporary_));
    if (!file_) fail(internal::system_reason());
  }
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile() {
    if (!file_) return;
    file_.reset();
    remove_temporary();
  }

  void write(std::string_view text) {
    NPT_ASSERT(file_);
    if (text.empty()) return;
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail(internal::system_reason());
  }
  void write(std::span<const std::byte> bytes) {
    write(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }

  /// Makes the file visible under its name. The last call.
  NPT_INLINE void commit() {
    NPT_ASSERT(file_);
    std::error_code code;
    const std::filesystem::file_status old = std::filesystem::status(target_, code);
    if (std::filesystem::is_regular_file(old)) std::filesystem::permissions(temporary_, old.permissions(), code);
    if (std::fflush(file_.get()) != 0 || !platform::sync(file_.get())) fail(internal::system_reason());
    if (std::fclose(file_.release()) != 0) fail_closed(internal::system_reason());
    platform::replace_file(temporary_, target_, code);
    if (code) fail_closed(code.message());
  }

 private:
  static std::uint64_t next_number() {
    static std::atomic<std::uint64_t> number{0};
    return number++;
  }

  /// Where the file really goes. Refuses what a rename would wrongly replace: a directory, a device, a write-protected
  /// file.
  NPT_INLINE static std::filesystem::path resolve(const std::filesystem::path& path) {
    const auto refuse = [&path](const std::string& found) {
      throw Error({.file = path.string(), .found = found, .expected = "a file that can be written"});
    };
    using std::filesystem::file_type;
    if (path.empty()) refuse("an empty name");
    std::error_code code;
    const file_type type = std::filesystem::status(path, code).type();
    if (type == file_type::none) refuse(code.message());
    if (type == file_type::not_found) return path;
    if (type != file_type::regular) refuse(internal::file_kind(type));
    if (!platform::may_write(path)) refuse(internal::system_reason());
    std::filesystem::path target = std::filesystem::canonical(path, code);
    if (code) refuse(code.message());
    return target;
  }

  void remove_temporary() noexcept {
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
  [[noreturn]] void fail(const std::string& reason) const {
    throw Error({.file = name_, .found = reason, .expected = "a file that can be written"});
  }
  [[noreturn]] void fail_closed(const std::string& reason) {
    remove_temporary();
    fail(reason);
  }

  std::string name_;
  std::filesystem::path target_, temporary_;
  internal::FileHandle file_;
};

/// Writes a whole file at once, by way of AtomicFile.
NPT_INLINE void write_file(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace npt::inline NPT_ABI
