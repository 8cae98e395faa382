#include <doctest/doctest.h>

#include <npt/base/aligned.hpp>
#include <npt/base/random.hpp>
#include <npt/nn/kernel/few_rows.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace kernel = npt::kernel;

TEST_CASE("a few rows are the plain product") {
  constexpr int width = kernel::panel_width<float>;
  const auto index = [](int i) { return static_cast<std::size_t>(i); };
  npt::Random random(5);
  for (int rows = 1; rows <= kernel::most_few_rows; ++rows)
    for (const int columns : {0, 1, 2, 3, 4, 5, 65, 131}) {
      CAPTURE(rows);
      CAPTURE(columns);
      std::vector<float> weights(index(rows * columns)), bias(index(2 * rows));
      npt::AlignedBuffer<float> values(index(columns * width) + 1), tile(index((rows + 1) * width));
      for (float& x : weights) x = static_cast<float>(random.uniform(-1, 1));
      for (float& x : bias) x = static_cast<float>(random.uniform(-1, 1));
      for (float& x : values.span()) x = static_cast<float>(random.uniform(-1, 1));
      for (float& x : tile.span()) x = 7;
      for (const bool biased : {true, false}) {
        kernel::multiply_few_rows(rows, columns, weights.data(), values.data(), biased ? bias.data() : nullptr, 2,
                                  tile.data());
        double worst = 0;
        for (int r = 0; r < rows; ++r)
          for (int v = 0; v < width; ++v) {
            double expected = biased ? double{bias[index(2 * r)]} : 0.0;
            for (int c = 0; c < columns; ++c)
              expected += double{weights[index(c * rows + r)]} * double{values.data()[c * width + v]};
            const double error = std::abs(double{tile.data()[r * width + v]} - expected);
            if (!(error <= worst)) worst = error;  // NaN counts
          }
        CHECK(worst < 1e-5);
        CHECK(tile.data()[rows * width] == 7);  // nothing behind them
      }
    }
}
