#include <doctest/doctest.h>

#include <npt/nn/kernel/packed_weights.hpp>

using npt::kernel::RowBlocks;

TEST_CASE("row blocks cover every row once, waste none, and fit the registers") {
  for (int rows = 1; rows <= 1100; ++rows) {
    const RowBlocks blocks = RowBlocks::of(rows);
    int next = 0;
    for (int b = 0; b < blocks.count; ++b) {
      REQUIRE(blocks.first_row(b) == next);
      REQUIRE(blocks.rows(b) >= 1);
      REQUIRE(blocks.rows(b) <= npt::kernel::max_tile_rows);
      REQUIRE(blocks.rows(0) - blocks.rows(b) <= 1);
      next += blocks.rows(b);
    }
    REQUIRE(next == rows);
  }
}

TEST_CASE("packed weights hold every entry in the order in which the micro-kernel reads them") {
  const int rows = 31, columns = 5;
  const npt::kernel::PackedWeights<float> packed(
      rows, columns, [](int r, int k) { return static_cast<float>(100 * r + k); },
      [](int r) { return static_cast<float>(-r); });
  for (int b = 0; b < packed.blocks().count; ++b) {
    const int height = packed.blocks().rows(b);
    for (int k = 0; k < columns; ++k)
      for (int r = 0; r < height; ++r)
        CHECK(packed.block(b)[k * height + r] == static_cast<float>(100 * (packed.blocks().first_row(b) + r) + k));
  }
  for (int r = 0; r < rows; ++r) CHECK(packed.bias()[r] == static_cast<float>(-r));
  CHECK(packed.bytes() == sizeof(float) * (31 * 5 + 31));
}
