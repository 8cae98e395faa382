/// Whole files in, whole files out. A file that is written appears under its name only when it is complete.
/// Paths     std::string, which a std::filesystem::path converts to: <filesystem> would be a twentieth of what the umbrella
///           header costs a compiler
/// Errors    npt::Error that names the path and the system's reason
#pragma once

#include <sys/stat.h>
#include <unistd.h>
#include <npt/config.hpp>
#include <npt/core/error.hpp>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <ostream>
#include <span>
#include <streambuf>
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

struct FreeText {
  void operator()(char* text) const { std::free(text); }
};

/// The reason of the last failed system call.
inline std::string system_reason() { return std::generic_category().message(errno); }

/// What stands at a path, behind symbolic links.
struct FileStatus {
  bool known = true;   ///< false: the system won't say, errno has the reason
  bool exists = true;  ///< false: nothing stands there
  struct ::stat system {};

  explicit FileStatus(const std::string& path) {
    if (::stat(path.c_str(), &system) == 0) return;
    exists = false;
    known = errno == ENOENT || errno == ENOTDIR;
  }
  bool regular() const { return exists && S_ISREG(system.st_mode); }
  const char* kind() const {
    return !exists ? "no such file" : S_ISDIR(system.st_mode) ? "a directory" : "a device or pipe";
  }
};

}  // namespace internal

/// No file of npt comes near this size; a larger one is a mistake that would only fill the memory.
inline constexpr std::uint64_t max_file_size = std::uint64_t{8} << 30;

/// The bytes of a file of at most `limit` bytes. A path that is no regular file is an error: reading a pipe or a device
/// could block or never end.
inline std::string read_file(const std::string& path, std::uint64_t limit = max_file_size) {
  const auto fail = [&path](std::string found, std::string expected) {
    return Error({.file = path, .found = std::move(found), .expected = std::move(expected)});
  };
  const internal::FileStatus status(path);
  if (!status.known) throw fail(internal::system_reason(), "a readable file");
  if (!status.regular()) throw fail(status.kind(), "a file");
  const internal::FileHandle file(std::fopen(path.c_str(), "rb"));
  if (!file) throw fail(internal::system_reason(), "a readable file");
  const auto size = static_cast<std::uint64_t>(status.system.st_size);
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
class AtomicFile {
 public:
  explicit AtomicFile(const std::string& path) : name_(path), target_(resolve(path)) {
    temporary_ = target_ + ".part-" + std::to_string(::getpid()) + "-" + std::to_string(next_number());
    // "x": a file of that name that someone else put there is never overwritten.
    file_.reset(std::fopen(temporary_.c_str(), "wbx"));
    if (!file_) fail(internal::system_reason());
    buffer_.file = this;
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

  /// The same file as a stream, for code that writes to one. Errors throw out of the stream's operations.
  std::ostream& stream() { return stream_; }

  /// Makes the file visible under its name. The last call.
  void commit() {
    NPT_ASSERT(file_);
    if (std::fflush(file_.get()) != 0) fail(internal::system_reason());
    if (std::fclose(file_.release()) != 0) fail_closed(internal::system_reason());
    const internal::FileStatus old(target_);
    if (old.regular()) static_cast<void>(::chmod(temporary_.c_str(), old.system.st_mode & 07777U));
    if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail_closed(internal::system_reason());
  }

 private:
  struct Buffer : std::streambuf {
    AtomicFile* file = nullptr;
    std::streamsize xsputn(const char* text, std::streamsize size) override {
      file->write(std::string_view(text, static_cast<std::size_t>(size)));
      return size;
    }
    int_type overflow(int_type c) override {
      const char character = traits_type::to_char_type(c);
      if (!traits_type::eq_int_type(c, traits_type::eof())) file->write(std::string_view(&character, 1));
      return traits_type::not_eof(c);
    }
  };
  /// A stream that hands a buffer's exceptions on.
  struct Stream : std::ostream {
    explicit Stream(Buffer& buffer) : std::ostream(&buffer) { exceptions(std::ios::badbit); }
  };

  static std::uint64_t next_number() {
    static std::atomic<std::uint64_t> number{0};
    return number++;
  }

  /// Where the file really goes. Refuses what a rename would wrongly replace: a directory, a device, a write-protected
  /// file.
  static std::string resolve(const std::string& path) {
    const auto refuse = [&path](const std::string& found) {
      throw Error({.file = path, .found = found, .expected = "a file that can be written"});
    };
    if (path.empty()) refuse("an empty name");
    const internal::FileStatus status(path);
    if (!status.known) refuse(internal::system_reason());
    if (!status.exists) return path;
    if (!status.regular()) refuse(status.kind());
    if (::access(path.c_str(), W_OK) != 0) refuse(internal::system_reason());
    const std::unique_ptr<char, internal::FreeText> target(::realpath(path.c_str(), nullptr));
    if (!target) refuse(internal::system_reason());
    return target.get();
  }

  void remove_temporary() noexcept { std::remove(temporary_.c_str()); }
  [[noreturn]] void fail(const std::string& reason) const {
    throw Error({.file = name_, .found = reason, .expected = "a file that can be written"});
  }
  [[noreturn]] void fail_closed(const std::string& reason) {
    remove_temporary();
    fail(reason);
  }

  std::string name_;
  std::string target_, temporary_;
  internal::FileHandle file_;
  Buffer buffer_;
  Stream stream_{buffer_};
};

/// Writes a whole file at once, by way of AtomicFile.
inline void write_file(const std::string& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace npt::inline NPT_ABI
