/// The neighbours of a sheet's triangles, and changes of them: splits, flips and collapses of edges.
#pragma once

#include <npt/body/mannequin/surface.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace sculpt {

using npt::anatomy::TriangleSheet;

/// Triangles with neighbours. Half-edge h = 3 t + i runs from corner i of triangle t to its next corner.
class SheetTopology {
 public:
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  explicit SheetTopology(const TriangleSheet& sheet) {
    std::unordered_map<std::uint64_t, std::uint32_t> directed;
    directed.reserve(3 * sheet.triangles.size());
    for (const auto& t : sheet.triangles) corner_.insert(corner_.end(), t.begin(), t.end());
    opposite_.assign(corner_.size(), none);
    leaving_.assign(sheet.positions.size(), none);
    for (std::uint32_t h = 0; h < corner_.size(); ++h) {
      leaving_[from(h)] = h;
      directed.emplace(std::uint64_t{from(h)} << 32 | to(h), h);
    }
    for (std::uint32_t h = 0; h < corner_.size(); ++h) {
      const auto at = directed.find(std::uint64_t{to(h)} << 32 | from(h));
      if (at != directed.end()) opposite_[h] = at->second;
    }
  }

  static std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static std::uint32_t previous(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  std::uint32_t from(std::uint32_t h) const { return corner_[h]; }
  std::uint32_t to(std::uint32_t h) const { return corner_[next(h)]; }
  std::uint32_t apex(std::uint32_t h) const { return corner_[previous(h)]; }
  std::uint32_t opposite(std::uint32_t h) const { return opposite_[h]; }
  bool removed(std::uint32_t h) const { return corner_[h] == none; }
  bool vertex_removed(std::uint32_t v) const { return leaving_[v] == none; }
  std::uint32_t half_edges() const { return static_cast<std::uint32_t>(corner_.size()); }
  std::uint32_t vertices() const { return static_cast<std::uint32_t>(leaving_.size()); }

  /// Calls f(h) for each half-edge that leaves v, counter-clockwise; at the border from its first to its last triangle.
  template <class F>
  void around(std::uint32_t v, F&& f) const {
    std::uint32_t first = leaving_[v];
    for (std::uint32_t h = first; opposite_[h] != none;) {
      h = next(opposite_[h]);
      first = h;
      if (h == leaving_[v]) break;
    }
    for (std::uint32_t h = first; h != none;) {
      f(h);
      h = opposite_[previous(h)];
      if (h == first) break;
    }
  }

  /// The vertices joined to v by an edge.
  void neighbours(std::uint32_t v, std::vector<std::uint32_t>& result) const {
    result.clear();
    std::uint32_t last = none;
    around(v, [&](std::uint32_t h) {
      result.push_back(to(h));
      last = h;
    });
    if (opposite_[previous(last)] == none) result.push_back(apex(last));
  }

  bool on_border(std::uint32_t v) const {
    bool border = false;
    around(v, [&](std::uint32_t h) { border = border || opposite_[h] == none || opposite_[previous(h)] == none; });
    return border;
  }

  /// Cuts edge h in two by a new vertex, the last one, and the triangles beside it.
  void split(std::uint32_t h) {
    const std::uint32_t o = opposite_[h], m = vertices();
    leaving_.push_back(none);
    const std::uint32_t far = halve(h, m);
    if (o != none) {
      const std::uint32_t other = halve(o, m);
      glue(h, other);
      glue(o, far);
    }
  }

  /// Replaces the diagonal h of the quad around it by the other one.
  void flip(std::uint32_t h) {
    const std::uint32_t o = opposite_[h], a = from(h), b = to(h), c = apex(h), d = apex(o);
    const std::uint32_t bc = opposite_[next(h)], ca = opposite_[previous(h)], ad = opposite_[next(o)],
                        db = opposite_[previous(o)];
    const std::uint32_t t = h / 3 * 3, s = o / 3 * 3;
    set_triangle(t, c, d, b);
    set_triangle(s, d, c, a);
    glue(t, s);
    glue(t + 1, db);
    glue(t + 2, bc);
    glue(s + 1, ca);
    glue(s + 2, ad);
  }

  /// Whether removing edge h by moving its start into its end keeps a manifold.
  bool can_collapse(std::uint32_t h) {
    const std::uint32_t a = from(h), b = to(h);
    const bool border = opposite_[h] == none;
    if (on_border(a) && !border) return false;
    neighbours(a, ring_a_);
    neighbours(b, ring_b_);
    std::size_t common = 0;
    for (const std::uint32_t v : ring_a_) common += static_cast<std::size_t>(std::ranges::count(ring_b_, v));
    return common == (border ? 1U : 2U) && ring_b_.size() > 3 && ring_a_.size() > 3;
  }

  /// Merges the start of edge h into its end; its one or two triangles vanish. Requires can_collapse(h).
  void collapse(std::uint32_t h) {
    const std::uint32_t a = from(h), b = to(h), o = opposite_[h];
    moved_.clear();
    around(a, [this](std::uint32_t e) { moved_.push_back(e); });
    for (const std::uint32_t e : moved_) corner_[e] = b;
    zip(h);
    if (o != none) zip(o);
    leaving_[a] = none;
  }

  std::vector<npt::Triangle> triangles() const {
    std::vector<npt::Triangle> result;
    for (std::uint32_t t = 0; t < half_edges(); t += 3) {
      if (!removed(t)) result.push_back({corner_[t], corner_[t + 1], corner_[t + 2]});
    }
    return result;
  }

 private:
  void glue(std::uint32_t a, std::uint32_t b) {
    if (a != none) opposite_[a] = b;
    if (b != none) opposite_[b] = a;
  }
  void set_triangle(std::uint32_t t, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t v[3] = {a, b, c};
    for (std::uint32_t i = 0; i < 3; ++i) {
      corner_[t + i] = v[i];
      leaving_[v[i]] = t + i;
    }
  }
  /// The triangle (a, b, c) of h = a -> b becomes (a, m, c), and h a -> m. A new triangle (m, b, c) follows; returns
  /// its half-edge m -> b.
  std::uint32_t halve(std::uint32_t h, std::uint32_t m) {
    const std::uint32_t b = to(h), c = apex(h), bc = opposite_[next(h)];
    const std::uint32_t t = half_edges();
    corner_.resize(corner_.size() + 3);
    opposite_.resize(opposite_.size() + 3, none);
    corner_[next(h)] = m;
    set_triangle(t, m, b, c);
    leaving_[m] = t;
    leaving_[from(h)] = h;
    glue(t + 1, bc);
    glue(next(h), t + 2);
    return t;
  }

  /// Removes the triangle of e, whose edges other than e have become one, and joins what lies beyond them.
  void zip(std::uint32_t e) {
    const std::uint32_t x = opposite_[next(e)], y = opposite_[previous(e)];
    glue(x, y);
    const std::uint32_t alive = x != none ? x : y;
    leaving_[from(alive)] = alive;
    leaving_[to(alive)] = next(alive);
    const std::uint32_t t = e / 3 * 3;
    corner_[t] = corner_[t + 1] = corner_[t + 2] = none;
  }

  std::vector<std::uint32_t> corner_, opposite_;  ///< [half-edges] start of each, and its twin or none
  std::vector<std::uint32_t> leaving_;            ///< [vertices] some half-edge that leaves it; none: removed
  std::vector<std::uint32_t> ring_a_, ring_b_, moved_;
};

}  // namespace sculpt
