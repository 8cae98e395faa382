/// The program npt of a build for every x86-64 processor (NPT_MULTI_ISA): runs the one of its kind, ../lib/npt/npt-SET,
/// that is compiled for the best instruction set which this processor and system have. Programs of their own rather
/// than one with several copies of everything: no code of one set, constructors included, can run where there is no
/// such set.
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include <unistd.h>

namespace {

/// The sets, from the best down, written by CMake: NPT_SETS is "{name, condition}, ...".
struct Set {
  const char* name;
  bool present;
};

}  // namespace

int main(int, char** argv) {
  __builtin_cpu_init();
  const Set sets[] = {NPT_SETS};
  char path[4096];
  const ssize_t size = readlink("/proc/self/exe", path, sizeof path - 64);
  char* folder = nullptr;
  if (size > 0) {
    path[size] = '\0';
    folder = std::strrchr(path, '/');
  }
  if (folder == nullptr) {
    std::fputs("npt: error: /proc/self/exe: found no name of this program, expected one\n", stderr);
    return 1;
  }
  const auto rest = static_cast<std::size_t>(path + sizeof path - folder);
  for (const Set& set : sets) {
    if (!set.present) continue;
    std::snprintf(folder, rest, "/../lib/npt/npt-%s", set.name);
    execv(path, argv);
    if (errno != ENOENT) break;  // a package may leave sets out
  }
  std::fprintf(stderr, "npt: error: %s: %s\n", path, std::strerror(errno));
  return 1;
}
