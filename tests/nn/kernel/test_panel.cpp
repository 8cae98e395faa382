#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/nn/kernel/panel.hpp>

#include <vector>

namespace kernel = npt::kernel;

TEST_CASE_TEMPLATE("vertices survive the way into tiles and back; padding is zero", T, float, double) {
  for (const int channels : {1, 3, 7})
    for (const int valid : {1, 31, 32, 33, 96}) {
      std::vector<T> in, out(static_cast<std::size_t>(channels * valid));
      for (int i = 0; i < channels * valid; ++i) in.push_back(static_cast<T>(i + 1));
      npt::AlignedBuffer<T> tile(kernel::tile_size(channels));
      for (T& x : tile.span()) x = T(-1);
      kernel::split_vertices(in.data(), channels, valid, tile.data());
      CHECK(tile[static_cast<std::size_t>((channels - 1) * kernel::panel_width<T>)] == static_cast<T>(channels));
      kernel::join_vertices(tile.data(), channels, valid, out.data());
      CHECK(in == out);
      std::size_t zeros = 0;
      for (const T x : tile.span()) zeros += x == T(0) ? 1U : 0U;
      CHECK(zeros == static_cast<std::size_t>(channels * (kernel::group_width - valid)));
    }
}

TEST_CASE("groups and panels are counted with the rest") {
  CHECK(kernel::group_count(1) == 1);
  CHECK(kernel::group_count(96) == 1);
  CHECK(kernel::group_count(97) == 2);
  CHECK(kernel::used_panels<float>(1) == 1);
  CHECK(kernel::used_panels<float>(kernel::panel_width<float> + 1) == 2);
  CHECK(kernel::used_panels<float>(kernel::group_width) == kernel::group_panels<float>);
}
