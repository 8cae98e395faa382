#include <doctest/doctest.h>

#include <io/scratch.hpp>

#if !defined(_WIN32)
#include <sys/stat.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <sys/syscall.h>
#endif

#include <cerrno>
#include <stdexcept>
#include <type_traits>

namespace fs = std::filesystem;
using scratch::error_of;

namespace {
#if defined(_WIN32)
bool may_read_everything() { return true; }
#else
bool may_read_everything() { return ::geteuid() == 0; }
#endif
}  // namespace

#if defined(__linux__)
namespace {

/// What fsync, below, is to do, and what it found.
struct SyncCall {
  int error = 0;  ///< other than 0: fails so
  fs::path look_at{};
  int count = 0;
  long size = 0;
  std::string seen_then{};
};
SyncCall sync_call;

}  // namespace

/// In the place of the C library's.
extern "C" int fsync(int file) {
  ++sync_call.count;
  struct stat status {};
  if (::fstat(file, &status) == 0) sync_call.size = static_cast<long>(status.st_size);
  if (!sync_call.look_at.empty()) sync_call.seen_then = npt::read_file(sync_call.look_at);
  errno = sync_call.error;
  return sync_call.error == 0 ? static_cast<int>(::syscall(SYS_fsync, file)) : -1;
}
#endif

TEST_CASE("what is written is read back, empty and binary content too") {
  const scratch::Folder folder;
  std::string bytes;
  for (unsigned i = 0; i < 100000; ++i) bytes += static_cast<char>(i * i % 251);
  for (const std::string& content : {std::string(), std::string("\0\r\n\xFF", 4), bytes}) {
    npt::write_file(folder / "a", content);
    CHECK(npt::read_file(folder / "a") == content);
  }
  CHECK(folder.file_count() == 1);
}

TEST_CASE("what can't be read is named with its reason") {
  const scratch::Folder folder;
  CHECK(error_of([&] { npt::read_file(folder / "none"); }) ==
        (folder / "none").string() + ": found no such file, expected a file");
  CHECK(error_of([&] { npt::read_file(folder.path()); }).ends_with("found a directory, expected a file"));
#if !defined(_WIN32)
  CHECK(error_of([&] { npt::read_file("/dev/null"); }).ends_with("found a device or pipe, expected a file"));
#endif
  npt::write_file(folder / "a", "12345");
  CHECK(error_of([&] { npt::read_file(folder / "a", 4); }).ends_with("found 5 bytes, expected at most 4"));
  CHECK(npt::read_file(folder / "a", 5) == "12345");
  CHECK(error_of([&] { npt::read_file(folder / std::string(5000, 'x')); }) != "no error");
  if (!may_read_everything()) {  // root may read everything
    fs::permissions(folder / "a", fs::perms::none);
    CHECK(
        error_of([&] { npt::read_file(folder / "a"); }).ends_with("found Permission denied, expected a readable file"));
  }
}

TEST_CASE("an output that isn't committed leaves no trace") {
  const scratch::Folder folder;
  npt::write_file(folder / "a", "old");
  const auto fails = [&] {
    npt::AtomicFile file(folder / "a");
    file.write("new");
    throw std::runtime_error("on the way");
  };
  CHECK_THROWS_AS(fails(), std::runtime_error);
  CHECK(npt::read_file(folder / "a") == "old");
  CHECK(folder.file_count() == 1);
}

TEST_CASE("before commit the old file stands, after it the new one") {
  const scratch::Folder folder;
  npt::write_file(folder / "a", "old");
  npt::AtomicFile file(folder / "a");
  file.write("new");
  CHECK(npt::read_file(folder / "a") == "old");
  CHECK(folder.file_count() == 2);
  file.commit();
  CHECK(npt::read_file(folder / "a") == "new");
  CHECK(folder.file_count() == 1);
}

#if defined(__linux__)
TEST_CASE("the bytes are on the disk before the file gets its name") {
  const scratch::Folder folder;
  npt::write_file(folder / "a", "old");
  sync_call = {};
  npt::AtomicFile file(folder / "a");
  file.write("all of the new");
  sync_call.look_at = folder / "a";
  file.commit();
  CHECK(sync_call.count == 1);
  CHECK(sync_call.size == 14);  // nothing waited in a buffer of this program
  CHECK(sync_call.seen_then == "old");
  sync_call = {};
  CHECK(npt::read_file(folder / "a") == "all of the new");
}

TEST_CASE("a disk that fails while it syncs is an error, and the old file stays") {
  const scratch::Folder folder;
  npt::write_file(folder / "a", "old");
  sync_call = {.error = EIO};
  CHECK(error_of([&] {
          npt::write_file(folder / "a", "new");
        }).ends_with("found Input/output error, expected a file that can be written"));
  CHECK(npt::read_file(folder / "a") == "old");
  CHECK(folder.file_count() == 1);
  sync_call = {.error = EINVAL};  // a file system that can't sync
  npt::write_file(folder / "a", "new");
  CHECK(npt::read_file(folder / "a") == "new");
  sync_call = {};
}
#endif

TEST_CASE("names may be texts or paths") {
  const scratch::Folder folder;
  const fs::path path = folder / "a";
  const std::string text = path.string();
  npt::write_file(text, "1");
  CHECK(npt::read_file(text.c_str()) == "1");
  npt::write_file(text.c_str(), "2");
  CHECK(npt::read_file(std::string_view(text)) == "2");
  npt::write_file(path, "3");
  CHECK(npt::read_file(text) == "3");
  CHECK(std::is_constructible_v<npt::AtomicFile, const char*>);
}

TEST_CASE("outputs that can't be written are errors at once") {
  const scratch::Folder folder;
  const auto opened = [](const fs::path& path) { return error_of([&] { npt::AtomicFile file(path); }); };
  CHECK(opened(folder / "no/such/folder/a")
            .ends_with("found No such file or directory, expected a file that can be written"));
  CHECK(opened(folder.path()).ends_with("found a directory, expected a file that can be written"));
#if !defined(_WIN32)
  CHECK(opened("/dev/null").ends_with("found a device or pipe, expected a file that can be written"));
#endif
  CHECK(opened("").find("found an empty name") != std::string::npos);
  if (!may_read_everything()) {
    npt::write_file(folder / "a", "");
    fs::permissions(folder / "a", fs::perms::owner_read);
    CHECK(opened(folder / "a").ends_with("found Permission denied, expected a file that can be written"));
  }
}

#if !defined(_WIN32)
TEST_CASE("permissions of an existing file and symbolic links survive") {
  const scratch::Folder folder;
  npt::write_file(folder / "a", "old");
  fs::permissions(folder / "a", fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  fs::create_symlink(folder / "a", folder / "link");
  npt::write_file(folder / "link", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(npt::read_file(folder / "a") == "new");
  CHECK(fs::status(folder / "a").permissions() ==
        (fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read));
}
#endif
