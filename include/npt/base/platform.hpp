/// What the C++ standard has no words for, or that one library does otherwise than the others: the only header that
/// asks which system it is. What else the program needs of a system stands in examples/npt/host.
#pragma once

#include <npt/config.hpp>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#if defined(_WIN32)
#include <io.h>
#include <process.h>
#elif __has_include(<unistd.h>)
#include <unistd.h>
#endif

#if defined(_WIN32)
/// As in <windows.h>, whose macros no header of npt brings into a program.
extern "C" __declspec(dllimport) int __stdcall MoveFileExW(const wchar_t*, const wchar_t*, unsigned long);
extern "C" __declspec(dllimport) unsigned long __stdcall GetLastError();
#endif

namespace npt::inline NPT_ABI::platform {

/// A number that no other running process has.
inline long process_id() {
#if defined(_WIN32)
  return ::_getpid();
#elif __has_include(<unistd.h>)
  return ::getpid();
#else
  return 0;  // a system with one process
#endif
}

/// std::fopen for names in any script. `mode` is ASCII.
inline std::FILE* open_file(const std::filesystem::path& path, const char* mode) {
#if defined(_WIN32)
  return ::_wfopen(path.c_str(), std::wstring(mode, mode + std::char_traits<char>::length(mode)).c_str());
#else
  return std::fopen(path.c_str(), mode);
#endif
}

/// A file for writing that isn't there yet; nullptr and errno (EEXIST) where it is.
inline std::FILE* create_file(const std::filesystem::path& path) {
#if defined(_WIN32)
  // Its C library of old knows no "x".
  if (::_waccess(path.c_str(), 0) == 0) {
    errno = EEXIST;
    return nullptr;
  }
  return open_file(path, "wb");
#else
  return open_file(path, "wbx");
#endif
}

/// Whether the system would let this process write to a file that is there; else errno says why.
inline bool may_write(const std::filesystem::path& path) {
#if defined(_WIN32)
  constexpr int writing = 2;
  return ::_waccess(path.c_str(), writing) == 0;
#elif __has_include(<unistd.h>)
  return ::access(path.c_str(), W_OK) == 0;
#else
  return true;
#endif
}

/// Puts on the disk what was written to a flushed file. A file system that can't (EINVAL) has done what it can.
inline bool sync(std::FILE* file) {
#if defined(_WIN32)
  return ::_commit(::_fileno(file)) == 0 || errno == EINVAL || errno == EBADF;
#elif __has_include(<unistd.h>)
  return ::fsync(::fileno(file)) == 0 || errno == EINVAL;
#else
  return file != nullptr;
#endif
}

/// std::filesystem::rename, also where there is a file of the new name: libstdc++ on Windows refuses that.
inline void replace_file(const std::filesystem::path& from, const std::filesystem::path& to, std::error_code& code) {
#if defined(_WIN32)
  constexpr unsigned long replace_existing = 1, write_through = 8;
  code.clear();
  if (::MoveFileExW(from.c_str(), to.c_str(), replace_existing | write_through) == 0)
    code.assign(static_cast<int>(::GetLastError()), std::system_category());
#else
  std::filesystem::rename(from, to, code);
#endif
}

}  // namespace npt::inline NPT_ABI::platform
