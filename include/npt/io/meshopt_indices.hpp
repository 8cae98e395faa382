/// The modes TRIANGLES and INDICES of EXT_meshopt_compression: corners of triangles by the edges and vertices before
/// them, and other numbers by differences.
/// Errors    npt::Error for bytes that end early or are too many
/// Source    Khronos, EXT_meshopt_compression, appendix A, modes 1 and 2
#pragma once

#include <npt/config.hpp>
#include <npt/io/meshopt_input.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

class MeshoptTriangles {
 public:
  explicit MeshoptTriangles(const MeshoptInput& input) : input_(input) {}

  /// count: of corners
  std::vector<std::uint32_t> decode(std::size_t count) {
    const std::string_view table = input_.take_tail(16), codes = input_.take(count / 3);
    result_.reserve(count);
    for (const char c : codes) {
      const auto code = static_cast<unsigned char>(c);
      if (code < 0xF0)
        beside_edge(code);
      else if (code < 0xFE)
        apart(code, static_cast<unsigned char>(table[code & 15U]));
      else
        apart(code, input_.byte());
    }
    input_.expect_end();
    return std::move(result_);
  }

 private:
  struct Edge {
    std::uint32_t a = 0, b = 0;
  };

  /// What was pushed `back` pushes before the last one.
  template <class T>
  struct Recent {
    std::array<T, 16> items{};
    std::size_t next = 0;
    void push(T item) { items[next++ & 15U] = item; }
    const T& operator[](std::size_t back) const { return items[(next - 1 - back) & 15U]; }
  };

  std::uint32_t far_vertex() {
    const std::uint32_t v = input_.varint();
    return last_ += (v & 1U) != 0 ? ~(v >> 1) : v >> 1;
  }

  /// A triangle at an edge of those before it.
  void beside_edge(unsigned code) {
    const Edge edge = edges_[code >> 4];
    const unsigned kind = code & 15U;
    const bool known = kind > 0 && kind < 13;
    const std::uint32_t c = kind == 0    ? next_++
                            : known      ? vertices_[kind]
                            : kind == 13 ? --last_
                            : kind == 14 ? ++last_
                                         : far_vertex();
    result_.insert(result_.end(), {edge.a, edge.b, c});
    edges_.push({c, edge.b});
    edges_.push({edge.a, c});
    if (!known) vertices_.push(c);
  }

  /// A triangle of three vertices. sources: for the second and the third, 0 the next one, 15 one that is written out
  void apart(unsigned code, unsigned sources) {
    const bool written = code >= 0xFE;
    if (written && sources == 0) next_ = 0;
    const unsigned second = sources >> 4, third = sources & 15U;
    const auto vertex = [&](unsigned source) {
      return source == 0 ? next_++ : source == 15 ? far_vertex() : vertices_[source - 1];
    };
    const std::uint32_t a = code == 0xFF ? far_vertex() : next_++;
    const std::uint32_t b = vertex(second);
    const std::uint32_t c = vertex(third);
    result_.insert(result_.end(), {a, b, c});
    edges_.push({b, a});
    edges_.push({c, b});
    edges_.push({a, c});
    vertices_.push(a);
    if (second == 0 || second == 15) vertices_.push(b);
    if (third == 0 || third == 15) vertices_.push(c);
  }

  MeshoptInput input_;
  std::vector<std::uint32_t> result_;
  std::uint32_t next_ = 0, last_ = 0;
  Recent<Edge> edges_;
  Recent<std::uint32_t> vertices_;
};

/// Numbers, each by its difference from one of two before it.
inline std::vector<std::uint32_t> decode_meshopt_indices(MeshoptInput input, std::size_t count) {
  input.take_tail(4);
  std::array<std::uint32_t, 2> last{};
  std::vector<std::uint32_t> result;
  result.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t v = input.varint();
    result.push_back(last[v & 1U] += (v & 2U) != 0 ? ~(v >> 2) : v >> 2);
  }
  input.expect_end();
  return result;
}

}  // namespace npt::inline NPT_ABI::internal
