#include <doctest/doctest.h>

#include <npt/base/random.hpp>
#include <npt/nn/kernel/moments.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

namespace kernel = npt::kernel;

namespace {

/// Mean and 1 / deviation of `channels` rows over V vertices, through tiles, groups and the merge.
template <class T>
struct Moments {
  std::vector<T> mean, inverse, maximum;
  Moments(const std::vector<std::vector<T>>& rows) {
    const int channels = static_cast<int>(rows.size()), vertices = static_cast<int>(rows[0].size());
    const int groups = kernel::group_count(vertices);
    const auto size = static_cast<std::size_t>(groups * channels);
    std::vector<T> means(size), squares(size), maxima(size);
    npt::AlignedBuffer<T> tile(kernel::tile_size(channels));
    for (int g = 0; g < groups; ++g) {
      std::fill(tile.span().begin(), tile.span().end(), std::numeric_limits<T>::quiet_NaN());  // padding must not count
      const int valid = std::min(kernel::group_width, vertices - g * kernel::group_width);
      for (int c = 0; c < channels; ++c)
        for (int v = 0; v < valid; ++v)
          tile[kernel::panel_stride<T>(channels) * static_cast<std::size_t>(v / kernel::panel_width<T>) +
               static_cast<std::size_t>(c * kernel::panel_width<T> + v % kernel::panel_width<T>)] =
              rows[static_cast<std::size_t>(c)][static_cast<std::size_t>(g * kernel::group_width + v)];
      const auto at = static_cast<std::ptrdiff_t>(g * channels);
      kernel::gather_moments(tile.data(), kernel::panel_stride<T>(channels), valid, channels, means.data() + at,
                             squares.data() + at);
      kernel::gather_maxima(tile.data(), kernel::panel_stride<T>(channels), valid, channels, maxima.data() + at);
    }
    std::vector<double> sums(2 * rows.size());
    mean.resize(rows.size());
    inverse.resize(rows.size());
    kernel::merge_moments(means.data(), squares.data(), vertices, channels, sums.data(), mean.data(), inverse.data());
    maximum.assign(maxima.begin(), maxima.begin() + channels);
    for (int g = 1; g < groups; ++g)
      for (int c = 0; c < channels; ++c) {
        T& m = maximum[static_cast<std::size_t>(c)];
        const T x = maxima[static_cast<std::size_t>(g * channels + c)];
        if (!(m >= x) && m == m) m = x;
      }
  }
};

}  // namespace

TEST_CASE_TEMPLATE("moments equal two-pass sums in double, also where the mean is large beside the deviation", T, float,
                   double) {
  npt::Random random(4);
  for (const std::size_t vertices :
       std::initializer_list<std::size_t>{1, 2, 15, 16, 17, 31, 32, 33, 95, 96, 97, 1000, 6890}) {
    std::vector<std::vector<T>> rows(5, std::vector<T>(vertices));
    const double means[] = {0, 1, 30, 1000, -5}, deviations[] = {1, 0.1, 0.01, 1, 0};
    for (std::size_t c = 0; c < 5; ++c)
      for (T& x : rows[c]) x = static_cast<T>(means[c] + deviations[c] * random.normal());
    const Moments<T> found(rows);
    for (std::size_t c = 0; c < 5; ++c) {
      long double sum = 0, squares = 0;  // wider than T = double
      for (const T x : rows[c]) sum += x;
      for (const T x : rows[c]) squares += (x - sum / vertices) * (x - sum / vertices);
      const auto mean = static_cast<double>(sum / vertices), variance = static_cast<double>(squares / vertices);
      const double eps = static_cast<double>(std::numeric_limits<T>::epsilon());
      CAPTURE(vertices);
      CAPTURE(c);
      CHECK(std::abs(static_cast<double>(found.mean[c]) - mean) <= 4 * eps * (std::abs(mean) + std::sqrt(variance)));
      CHECK(std::abs(static_cast<double>(found.inverse[c]) * std::sqrt(variance + 1e-5) - 1) < 100 * eps);
      CHECK(found.maximum[c] == *std::max_element(rows[c].begin(), rows[c].end()));
    }
  }
}

TEST_CASE("a NaN in a row makes its moments and its maximum NaN, and no others") {
  for (const std::size_t where : std::initializer_list<std::size_t>{0, 50, 95, 96, 149}) {
    std::vector<std::vector<float>> rows(3, std::vector<float>(150, 1.0F));
    rows[1][where] = std::numeric_limits<float>::quiet_NaN();
    const Moments<float> found(rows);
    CHECK(std::isnan(found.mean[1]));
    CHECK(std::isnan(found.inverse[1]));
    CHECK(std::isnan(found.maximum[1]));
    for (const std::size_t c : std::initializer_list<std::size_t>{0, 2}) {
      CHECK(found.mean[c] == 1.0F);
      CHECK(found.maximum[c] == 1.0F);
    }
  }
}
