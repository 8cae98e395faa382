/// One program for every x86-64 processor, which uses AVX-512 where there is some. The network is compiled four times,
/// and the call of make_retarget goes to the best that this machine can run; nothing here knows of it.
#include "retarget.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

int main(int argc, char** argv) {
  if (argc > 1) {
    const bool help = std::string_view(argv[1]) == "--help";
    std::fprintf(help ? stdout : stderr, "usage: %s\nRuns a small random network on made-up vertices.\n", argv[0]);
    return help ? 0 : 2;
  }
  constexpr std::size_t vertices = 6890;
  std::vector<float> pose, identity, result(3 * vertices);
  for (std::size_t i = 0; i < 3 * vertices; ++i) {
    pose.push_back(std::sin(static_cast<float>(i)));
    identity.push_back(std::cos(static_cast<float>(i)));
  }
  const std::unique_ptr<Retarget> retarget(make_retarget(1));
  (*retarget)(pose.data(), identity.data(), result.data(), vertices);
  const auto start = std::chrono::steady_clock::now();
  (*retarget)(pose.data(), identity.data(), result.data(), vertices);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  std::printf("%zu vertices in %.2f ms with %s\n", vertices, time.count(), retarget->instruction_set());
  return 0;
}
