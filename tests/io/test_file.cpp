#include <doctest/doctest.h>

#include <io/scratch.hpp>

#include <sys/stat.h>

#include <fstream>
#include <stdexcept>

namespace fs = std::filesystem;
using scratch::error_of;

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
  CHECK(error_of([&] { npt::read_file("/dev/null"); }).ends_with("found a device or pipe, expected a file"));
  npt::write_file(folder / "a", "12345");
  CHECK(error_of([&] { npt::read_file(folder / "a", 4); }).ends_with("found 5 bytes, expected at most 4"));
  CHECK(npt::read_file(folder / "a", 5) == "12345");
  CHECK(error_of([&] { npt::read_file(folder / std::string(5000, 'x')); }) != "no error");
  if (::geteuid() != 0) {  // root may read everything
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

TEST_CASE("the stream writes to the same file") {
  const scratch::Folder folder;
  npt::AtomicFile file(folder / "a");
  file.write("x = ");
  file.stream() << 12 << ',' << 0.5 << '\n';
  file.commit();
  CHECK(npt::read_file(folder / "a") == "x = 12,0.5\n");
}

TEST_CASE("outputs that can't be written are errors at once") {
  const scratch::Folder folder;
  const auto opened = [](const fs::path& path) { return error_of([&] { npt::AtomicFile file(path); }); };
  CHECK(opened(folder / "no/such/folder/a")
            .ends_with("found No such file or directory, expected a file that can be written"));
  CHECK(opened(folder.path()).ends_with("found a directory, expected a file that can be written"));
  CHECK(opened("/dev/null").ends_with("found a device or pipe, expected a file that can be written"));
  CHECK(opened("").find("found an empty name") != std::string::npos);
  if (::geteuid() != 0) {
    npt::write_file(folder / "a", "");
    fs::permissions(folder / "a", fs::perms::owner_read);
    CHECK(opened(folder / "a").ends_with("found Permission denied, expected a file that can be written"));
  }
}

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
