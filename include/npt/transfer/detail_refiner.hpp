/// Gives positions that are right as a whole but rough in detail, such as a network's, the surface detail of the mesh
/// that they belong to: hands, faces, cloth and hair come out crisp, limbs where the positions put them.
///   minimise over x, R   sum over points of area_i / radius^2 |x_i - t_i|^2 +
///                        sum over edges of w_ij |(x_i - x_j) - (R_i + R_j)/2 (p_i - p_j)|^2
/// The first sum follows the positions, the second keeps the shape:
/// t are the positions, p the unmodified mesh, R_i a rotation for each point and w cotangents. x and R are found in
/// turn; for x this is a linear system that depends on the mesh only and is factored once. The first rotations are
/// those of neighbourhoods of about `radius`, since single points of rough positions know none.
/// The one weight is `radius`: what is smaller than it is taken from the mesh, what is larger from the positions.
/// Shapes    mesh, positions, result: [V, 3] floats, row major, the same vertex order
/// Meshes    Several pieces, open borders, edges of more than two faces, faces without area, vertices in no face (which
///           keep the positions they are given). Vertices at one point of the mesh, as along seams, are one point here
///           and stay together
/// Numerics  double; the same bits at every call. Moved and turned positions give the result moved and turned, up to
///           rounding. NaN in, NaN out
/// Threads   a refiner may be used by several threads at a time
/// Memory    a second call allocates nothing
/// Errors    npt::Error for a mesh without a face that has an area, for corners that are no vertices, for positions of
///           another vertex count, and for options out of range
/// Source    Sorkine and Alexa, "As-rigid-as-possible surface modeling", 2007, with the positions as soft constraints
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/pool.hpp>
#include <npt/base/quaternion.hpp>
#include <npt/base/vec3.hpp>
#include <npt/config.hpp>
#include <npt/mesh/cotangent.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/piece_links.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/weld.hpp>
#include <npt/solve/nearest_rotation.hpp>
#include <npt/solve/sparse_cholesky.hpp>
#include <npt/transfer/refinement.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct DetailOptions {
  /// Detail below it comes from the mesh: a share of the root of the mesh's area (1.3 m for a person, however posed).
  double radius = default_refine_radius;
  int iterations = 4;
  /// Hold pieces together that lie on each other, as hair on a head; see piece_links.hpp.
  bool link_pieces = true;
};

class DetailRefiner {
 public:
  /// `name` stands in messages of errors.
  DetailRefiner(std::span<const float> mesh, std::span<const Triangle> triangles, const DetailOptions& options = {},
                const std::string& name = "mesh to refine")
      : iterations_(options.iterations) {
    check(mesh, triangles, options, name);
    Welding welding = weld(mesh);
    for (const std::uint32_t v : welding.vertex_of) rest_.push_back(point_at(mesh, v));
    vertices_at_.resize(welding.point_count());
    for (const std::uint32_t point : welding.point_of) ++vertices_at_[point];
    const std::vector<Triangle> welded = welding.welded(triangles);
    point_of_ = std::move(welding.point_of);
    CotangentWeights weights = cotangent_weights(rest_, welded);
    if (!(weights.total_area > 0))
      throw Error({.file = name,
                   .found = triangles.empty() ? "no faces" : "no face with an area",
                   .expected = "a mesh with a surface, to keep its detail"});
    if (options.link_pieces) add_links(welded, weights);
    list_spokes(weights);
    factor(weights, options.radius);
  }
  explicit DetailRefiner(const Mesh& mesh, const DetailOptions& options = {},
                         const std::string& name = "mesh to refine")
      : DetailRefiner(mesh.coordinates(), triangulate(mesh), options, name) {}

  std::size_t vertex_count() const noexcept { return point_of_.size(); }

  /// `positions` with the mesh's detail. `result` may be the same memory.
  void operator()(std::span<const float> positions, std::span<float> result) const {
    if (positions.size() != 3 * vertex_count() || result.size() != positions.size())
      throw Error({.file = "positions to refine",
                   .found = std::to_string(positions.size() / 3) + " vertices",
                   .expected = std::to_string(vertex_count()) + ", as many as the mesh has"});
    const auto lease = pool_.lease();
    Scratch& memory = *lease;
    gather(positions, memory.targets);
    std::vector<Vec3d>& x = memory.x;
    x.assign(memory.targets.begin(), memory.targets.end());
    memory.rotations.assign(x.size(), {});
    for (int i = 0; i < iterations_; ++i) {
      turn(memory, i == 0);
      move(memory);
    }
    for (std::size_t v = 0; v < point_of_.size(); ++v) {
      const Vec3f p = x[point_of_[v]].as<float>();
      result[3 * v] = p.x;
      result[3 * v + 1] = p.y;
      result[3 * v + 2] = p.z;
    }
  }
  /// Refines the positions of a mesh in place; normals are renewed if it has any.
  void operator()(Mesh& mesh) const {
    (*this)(mesh.coordinates(), mesh.coordinates());
    recompute_normals(mesh);
  }

 private:
  using Columns = std::array<Vec3d, 3>;

  /// The memory of one call. [P] each
  struct Scratch {
    std::vector<Vec3d> targets, x;
    std::vector<Quaternion> rotations;
    std::array<std::vector<Vec3d>, 3> columns;
    std::vector<Columns> halves;
    std::vector<double> solve;
  };

  /// 27 mm on a person: shirts lie as far from the body. As stiff as the edge between two equilateral triangles.
  static constexpr double link_reach = 0.02, link_weight = std::numbers::inv_sqrt3;

  static void check(std::span<const float> mesh, std::span<const Triangle> triangles, const DetailOptions& options,
                    const std::string& name) {
    if (!(options.radius > 0) || !(options.radius <= 10))
      throw Error(
          {.file = "detail radius", .found = std::to_string(options.radius), .expected = "above 0, at most 10"});
    if (options.iterations < 1 || options.iterations > 1000)
      throw Error({.file = "iterations", .found = std::to_string(options.iterations), .expected = "1 to 1000"});
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (!std::isfinite(mesh[i]))
        throw Error({.file = name,
                     .place = "vertex " + std::to_string(i / 3),
                     .found = std::to_string(mesh[i]),
                     .expected = "finite coordinates"});
    for (const Triangle& t : triangles)
      for (const std::uint32_t corner : t)
        if (corner >= mesh.size() / 3)
          throw Error({.file = name,
                       .place = "a face",
                       .found = "vertex " + std::to_string(corner),
                       .expected = "vertices below " + std::to_string(mesh.size() / 3)});
  }

  /// Pieces that lie on each other hold on to each other.
  void add_links(std::span<const Triangle> triangles, CotangentWeights& weights) const {
    for (const Edge& link : piece_links(rest_, triangles, link_reach * std::sqrt(weights.total_area))) {
      weights.edges.push_back(link);
      weights.weights.push_back(link_weight);
    }
  }

  /// The edges of each point in compressed rows: a point's own loops then read its neighbours and write itself.
  void list_spokes(const CotangentWeights& weights) {
    start_.assign(rest_.size() + 1, 0);
    for (const Edge& edge : weights.edges)
      for (const std::uint32_t p : edge) ++start_[p + 1];
    for (std::size_t p = 0; p < rest_.size(); ++p) start_[p + 1] += start_[p];
    spokes_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t e = 0; e < weights.edges.size(); ++e) {
      const auto [a, b] = weights.edges[e];
      const Vec3d along = (rest_[a] - rest_[b]) * weights.weights[e];
      spokes_[next[a]++] = {b, along};
      spokes_[next[b]++] = {a, -along};
    }
  }

  void factor(const CotangentWeights& weights, double radius) {
    const double length2 = radius * radius * weights.total_area;
    // A point without area follows its neighbours; alone it stays where it is put.
    const double least = negligible * weights.total_area / static_cast<double>(rest_.size());
    pull_.resize(rest_.size());
    for (std::size_t p = 0; p < rest_.size(); ++p) pull_[p] = std::max(weights.areas[p], least) / length2;
    std::vector<SymmetricEntry> entries;
    entries.reserve(rest_.size() + 3 * weights.edges.size());
    for (std::uint32_t p = 0; p < rest_.size(); ++p) entries.push_back({p, p, pull_[p]});
    for (std::size_t e = 0; e < weights.edges.size(); ++e) {
      const auto [a, b] = weights.edges[e];
      const double w = weights.weights[e];
      entries.push_back({a, a, w});
      entries.push_back({b, b, w});
      entries.push_back({b, a, -w});
    }
    system_ = std::make_unique<const SparseCholesky>(rest_.size(), entries);
  }

  /// Where the positions put each point: the mean of its vertices.
  void gather(std::span<const float> positions, std::vector<Vec3d>& targets) const {
    targets.assign(rest_.size(), {});
    for (std::size_t v = 0; v < point_of_.size(); ++v)
      targets[point_of_[v]] += Vec3f{positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}.as<double>();
    for (std::size_t p = 0; p < targets.size(); ++p)
      if (vertices_at_[p] > 1) targets[p] = targets[p] / static_cast<double>(vertices_at_[p]);
  }

  /// The rotations that carry the mesh's edges best onto those of x.
  void turn(Scratch& memory, bool first) const {
    const std::vector<Vec3d>& x = memory.x;
    std::vector<Quaternion>& rotations = memory.rotations;
    auto& columns = memory.columns;
    for (auto& column : columns) column.resize(x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
      Columns sum{};
      for (std::size_t s = start_[p]; s < start_[p + 1]; ++s) {
        const Vec3d edge = x[p] - x[spokes_[s].to], along = spokes_[s].along;
        sum[0] += edge * along.x;
        sum[1] += edge * along.y;
        sum[2] += edge * along.z;
      }
      for (std::size_t c = 0; c < 3; ++c) columns[c][p] = sum[c];
    }
    // The system's inverse is a mean over neighbourhoods of about the radius.
    if (first)
      for (auto& column : columns) system_->solve(column, memory.solve);
    for (std::size_t p = 0; p < x.size(); ++p)
      rotations[p] = nearest_rotation({columns[0][p], columns[1][p], columns[2][p]}, rotations[p], first ? 60 : 4);
  }

  /// The points that fit these rotations and the positions best.
  void move(Scratch& memory) const {
    const std::vector<Vec3d>& targets = memory.targets;
    const std::vector<Quaternion>& rotations = memory.rotations;
    std::vector<Vec3d>& x = memory.x;
    std::vector<Columns>& halves = memory.halves;
    halves.resize(x.size());
    for (std::size_t p = 0; p < x.size(); ++p) {
      halves[p] = matrix_of(rotations[p]).columns();
      for (Vec3d& column : halves[p]) column *= 0.5;
    }
    for (std::size_t p = 0; p < x.size(); ++p) {
      Vec3d sum = targets[p] * pull_[p];
      for (std::size_t s = start_[p]; s < start_[p + 1]; ++s) {
        const auto& [to, along] = spokes_[s];
        const Columns &own = halves[p], &other = halves[to];
        sum += (own[0] + other[0]) * along.x + (own[1] + other[1]) * along.y + (own[2] + other[2]) * along.z;
      }
      x[p] = sum;
    }
    system_->solve(x, memory.solve);
  }

  struct Spoke {
    std::uint32_t to = 0;
    Vec3d along{};  ///< from the other point to this one on the mesh, times the edge's weight
  };

  int iterations_;
  std::vector<std::uint32_t> point_of_;     ///< [V]
  std::vector<std::uint32_t> vertices_at_;  ///< [P]
  std::vector<Vec3d> rest_;                 ///< [P]
  std::vector<double> pull_;                ///< [P] area / radius^2
  std::vector<std::size_t> start_;          ///< [P + 1]
  std::vector<Spoke> spokes_;
  std::unique_ptr<const SparseCholesky> system_;
  Pool<Scratch> pool_;
};

/// The refinement that transfers use: TransferOptions::refinement = npt::detail_refinement.
/// Errors    those of DetailRefiner, named by the identity
inline std::unique_ptr<const Refinement> detail_refinement(const MeshView& identity, double radius) {
  struct Detail : Refinement {
    explicit Detail(DetailRefiner r) : refiner(std::move(r)) {}
    void refine(std::span<float> positions) const override { refiner(positions, positions); }
    DetailRefiner refiner;
  };
  return std::make_unique<Detail>(
      DetailRefiner(identity.xyz, identity.triangles, {.radius = radius}, std::string(identity.name)));
}

}  // namespace npt::inline NPT_ABI
