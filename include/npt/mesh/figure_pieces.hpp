/// Which pieces (connected components) of a mesh may be the figure in it, where others are a floor, a pedestal, strays
/// or a second figure. These are guesses: whoever knows figures tells which one holds.
///   for (const std::vector<bool>& own : figure_pieces(mesh)) ...
///   const std::vector<bool> second = figures(mesh).at(1);
/// Shapes      each guess: [T], whether a triangle is the figure's; the likeliest first; none that is the whole mesh
/// Complexity  quadratic in the pieces; no guess, and one figure, beyond 4096 of them
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/union_find.hpp>
#include <npt/mesh/weld.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

/// Points along a mesh's axes from `low` to `high`.
struct Box {
  Vec3d low{1, 1, 1}, high{-1, -1, -1};

  void add(Vec3d p) {
    const bool first = low.x > high.x;
    low = first ? p : Vec3d{std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = first ? p : Vec3d{std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Box grown(double by) const { return {low - Vec3d{by, by, by}, high + Vec3d{by, by, by}}; }
  double size() const { return length(high - low); }
  bool meets(const Box& b) const {
    return low.x <= b.high.x && low.y <= b.high.y && low.z <= b.high.z && b.low.x <= high.x && b.low.y <= high.y &&
           b.low.z <= high.z;
  }
  bool holds(const Box& b) const {
    return low.x <= b.low.x && low.y <= b.low.y && low.z <= b.low.z && b.high.x <= high.x && b.high.y <= high.y &&
           b.high.z <= high.z;
  }
};

struct Piece {
  Box box{};
  std::size_t points = 0;
};

class FigurePieces {
 public:
  explicit FigurePieces(const MeshView& mesh) {
    const Welding welding = weld(mesh.xyz);
    const std::vector<Triangle> triangles = welding.welded(mesh.triangles);
    UnionFind joined(welding.point_count());
    std::vector<bool> used(welding.point_count());
    for (const Triangle& t : triangles) {
      joined.unite(t[0], t[1]), joined.unite(t[0], t[2]);
      for (const std::uint32_t p : t) used[p] = true;
    }
    const std::vector<std::uint32_t> sets = joined.sets();
    std::vector<std::uint32_t> number(sets.size(), no_index);
    for (std::uint32_t p = 0; p < sets.size(); ++p) {
      if (!used[p]) continue;
      std::uint32_t& piece = number[sets[p]];
      if (piece == no_index) piece = static_cast<std::uint32_t>(pieces_.size()), pieces_.emplace_back();
      pieces_[piece].box.add(point_at(mesh.xyz, welding.vertex_of[p]));
      ++pieces_[piece].points;
    }
    for (const Triangle& t : triangles) piece_of_.push_back(number[sets[t[0]]]);
  }

  std::vector<std::vector<bool>> guesses() const {
    std::vector<std::vector<bool>> all;
    if (pieces_.size() < 2 || pieces_.size() > most_pieces) return all;
    for (const std::vector<bool>& chosen : {groups().front().pieces, largest_piece()}) {
      std::vector<bool> own = triangles_of(chosen);
      const bool part = std::find(chosen.begin(), chosen.end(), false) != chosen.end();
      if (part && std::find(all.begin(), all.end(), own) == all.end()) all.push_back(std::move(own));
    }
    return all;
  }

  /// Of groups of pieces that have points enough for limbs that bend; at least one.
  std::vector<std::vector<bool>> figures() const {
    if (pieces_.size() < 2 || pieces_.size() > most_pieces) return {std::vector<bool>(piece_of_.size(), true)};
    std::vector<std::vector<bool>> all;
    for (const Group& group : groups())
      if (all.empty() || group.points >= few_points) all.push_back(triangles_of(group.pieces));
    return all;
  }

 private:
  static constexpr std::size_t most_pieces = 4096;
  /// A floor or a pedestal is large and has few points; limbs that bend have more.
  static constexpr std::size_t few_points = 32;
  static constexpr double large = 0.25;  ///< of the size of the piece with the most points
  static constexpr double near = 0.02;   ///< the same: pieces of one figure touch or overlap, or nearly

  std::size_t most_points() const {
    const auto fewer = [](const Piece& a, const Piece& b) { return a.points < b.points; };
    return static_cast<std::size_t>(std::max_element(pieces_.begin(), pieces_.end(), fewer) - pieces_.begin());
  }

  std::vector<bool> triangles_of(const std::vector<bool>& chosen) const {
    std::vector<bool> own;
    for (const std::uint32_t piece : piece_of_) own.push_back(chosen[piece]);
    return own;
  }
  struct Group {
    std::vector<bool> pieces;
    std::size_t points = 0;
  };

  /// Without floors and pedestals, the pieces that lie at each other; the group with the most points first.
  std::vector<Group> groups() const {
    const double size = pieces_[most_points()].box.size();
    const auto is_scenery = [&](const Piece& p) { return p.points < few_points && p.box.size() > large * size; };
    UnionFind groups(pieces_.size());
    for (std::uint32_t a = 0; a < pieces_.size(); ++a) {
      if (is_scenery(pieces_[a])) continue;
      const Box around = pieces_[a].box.grown(near * size);
      for (std::uint32_t b = a + 1; b < pieces_.size(); ++b)
        if (!is_scenery(pieces_[b]) && around.meets(pieces_[b].box)) groups.unite(a, b);
    }
    std::vector<Group> all;
    std::vector<std::uint32_t> number(pieces_.size(), no_index);
    for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
      std::uint32_t& own = number[groups.find(p)];
      if (own == no_index)
        own = static_cast<std::uint32_t>(all.size()), all.push_back({std::vector<bool>(pieces_.size())});
      all[own].pieces[p] = true;
      all[own].points += pieces_[p].points;
    }
    std::ranges::stable_sort(all, std::ranges::greater{}, &Group::points);
    return all;
  }

  /// The piece with the most points and what lies within its box, a tenth larger: eyes, hair, clothes.
  std::vector<bool> largest_piece() const {
    const Box& box = pieces_[most_points()].box;
    const Box around = box.grown(0.1 * box.size());
    std::vector<bool> chosen;
    for (const Piece& p : pieces_) chosen.push_back(around.holds(p.box));
    return chosen;
  }

  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> piece_of_;  ///< [T]
};

}  // namespace internal

NPT_INLINE std::vector<std::vector<bool>> figure_pieces(const MeshView& mesh) {
  return internal::FigurePieces(mesh).guesses();
}

/// The figures in a mesh: pieces that touch or nearly do, of each [T], whether a triangle is its; the one with the most
/// points first. At least one; floors, pedestals and strays are none.
NPT_INLINE std::vector<std::vector<bool>> figures(const MeshView& mesh) {
  return internal::FigurePieces(mesh).figures();
}

/// The triangles that are the figure's, in `kept` where they aren't all. figure: [T], or empty for all
NPT_INLINE std::span<const Triangle> figure_triangles(const MeshView& mesh, const std::vector<bool>& figure,
                                                      std::vector<Triangle>& kept) {
  if (figure.empty()) return mesh.triangles;
  kept.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (figure[t]) kept.push_back(mesh.triangles[t]);
  return as_span(kept);
}

}  // namespace npt::inline NPT_ABI
