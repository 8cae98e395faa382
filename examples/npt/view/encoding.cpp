#include <view/encoding.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace view {

namespace {

/// 0, -1, 1, -2 to 0, 1, 2, 3.
std::uint64_t folded(std::int64_t v) {
  return v >= 0 ? 2 * static_cast<std::uint64_t>(v) : 2 * static_cast<std::uint64_t>(-(v + 1)) + 1;
}
std::uint16_t folded16(std::uint16_t difference) {
  return static_cast<std::uint16_t>(folded(static_cast<std::int16_t>(difference)));
}

/// Writes values into planes of bytes, lowest first.
class Planes {
 public:
  Planes(std::string& bytes, std::size_t count, int planes)
      : bytes_(bytes), begin_(bytes.size()), count_(count), planes_(planes) {
    bytes.resize(begin_ + count * static_cast<std::size_t>(planes));
  }
  void put(std::size_t i, std::uint64_t value) {
    for (int p = 0; p < planes_; ++p)
      bytes_[begin_ + static_cast<std::size_t>(p) * count_ + i] =
          static_cast<char>(static_cast<unsigned char>(value >> (8 * p) & 0xFFU));
  }

 private:
  std::string& bytes_;
  std::size_t begin_, count_;
  int planes_;
};

std::uint16_t step_of(double value, double low, double high) {
  if (!(high > low) || !std::isfinite(value)) return 0;
  return static_cast<std::uint16_t>(std::clamp(std::round((value - low) / (high - low) * 65535), 0.0, 65535.0));
}

}  // namespace

Box box_of(std::span<const std::vector<Vec3f>> frames) {
  Box box{};
  bool first = true;
  for (const std::vector<Vec3f>& frame : frames)
    for (const Vec3f p : frame) {
      if (!npt::is_finite(p)) continue;
      if (first) box = {p, p};
      first = false;
      box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
      box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
  return box;
}

std::string encode_positions(std::span<const std::vector<Vec3f>> frames, const Box& box) {
  std::string bytes;
  const std::array<float, 3> low{box.low.x, box.low.y, box.low.z}, high{box.high.x, box.high.y, box.high.z};
  std::vector<std::uint16_t> last, now;
  for (const std::vector<Vec3f>& frame : frames) {
    const std::size_t count = 3 * frame.size();
    now.resize(count);
    Planes planes(bytes, count, 2);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f p = frame[i / 3];
      const std::size_t axis = i % 3;
      const float value = axis == 0 ? p.x : axis == 1 ? p.y : p.z;
      now[i] = step_of(static_cast<double>(value), static_cast<double>(low[axis]), static_cast<double>(high[axis]));
      const std::uint16_t before = !last.empty() ? last[i] : i >= 3 ? now[i - 3] : std::uint16_t{0};
      planes.put(i, folded16(static_cast<std::uint16_t>(now[i] - before)));
    }
    last = now;
  }
  return bytes;
}

EncodedIndices encode_indices(std::span<const std::uint32_t> indices) {
  EncodedIndices encoded;
  std::vector<std::uint64_t> differences;
  differences.reserve(indices.size());
  std::int64_t last = 0;
  std::uint64_t largest = 0;
  for (const std::uint32_t index : indices) {
    differences.push_back(folded(static_cast<std::int64_t>(index) - last));
    largest = std::max(largest, differences.back());
    last = static_cast<std::int64_t>(index);
  }
  encoded.planes = std::max(1, (static_cast<int>(std::bit_width(largest)) + 7) / 8);
  Planes planes(encoded.bytes, differences.size(), encoded.planes);
  for (std::size_t i = 0; i < differences.size(); ++i) planes.put(i, differences[i]);
  return encoded;
}

std::string encode_values(std::span<const std::vector<double>> frames, double high) {
  std::string bytes;
  for (const std::vector<double>& frame : frames) {
    Planes planes(bytes, frame.size(), 2);
    for (std::size_t i = 0; i < frame.size(); ++i)
      planes.put(i, std::isfinite(frame[i]) ? step_of(frame[i], 0, high) : std::uint16_t{65535});
  }
  return bytes;
}

std::string base64(std::string_view bytes) {
  static constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  const auto byte = [&](std::size_t i) { return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U; };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::uint32_t three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    text += letters[three >> 18U];
    text += letters[three >> 12U & 63U];
    text += i + 1 < bytes.size() ? letters[three >> 6U & 63U] : '=';
    text += i + 2 < bytes.size() ? letters[three & 63U] : '=';
  }
  return text;
}

}  // namespace view
