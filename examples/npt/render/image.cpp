#include <render/image.hpp>

#include <array>

namespace render {

Image shrunk(const Image& image, int width, int height) {
  Image small(width, height);
  const auto span_of = [](int i, int count, int size) {
    const int first = static_cast<int>(static_cast<long long>(i) * size / count);
    const int last = static_cast<int>(static_cast<long long>(i + 1) * size / count);
    return std::array<int, 2>{first, std::max(last, first + 1)};
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto [top, bottom] = span_of(y, height, image.height);
      const auto [left, right] = span_of(x, width, image.width);
      std::array<double, 4> sum{};
      for (int j = top; j < bottom; ++j)
        for (int i = left; i < right; ++i) {
          const Pixel p = image.at(i, j);
          sum[0] += p.r * p.a, sum[1] += p.g * p.a, sum[2] += p.b * p.a, sum[3] += p.a;
        }
      const double count = (bottom - top) * (right - left), weight = sum[3] > 0 ? sum[3] : 1;
      const auto byte = [](double v) { return static_cast<std::uint8_t>(v + 0.5); };
      small.at(x, y) = {byte(sum[0] / weight), byte(sum[1] / weight), byte(sum[2] / weight), byte(sum[3] / count)};
    }
  return small;
}

}  // namespace render
