/// Skin weights of a mesh from the body that was fitted to it, as one least squares problem. The weights W[p] are near
/// those D[p] of the body's surface where it lies closest and faces the same way, and are smooth along the mesh:
///   sum_p c[p] |W[p] - D[p]|^2 + sum_edges |W[p] - W[q]|^2
/// The certainty c[p] is 0 where D[p] is doubtful: in patches that belong elsewhere on the body than all that surrounds
/// them, as where limbs touch; along tears, where neighbours belong to distant places; and on what stands off the body
/// (tails, wings, horns, brims). Elsewhere it makes weights spread equally far on meshes of any fineness. Solved by
/// Gauss-Seidel sweeps in a fixed order, from what is certain outwards. Weights of closed hands are then found along
/// the skin, hands without fingers stay stiff (hand_skin.hpp), and loose or misplaced pieces follow what they touch
/// (rigid_pieces.hpp).
/// Meshes    any number of pieces, open borders, edges of many faces, triangles without area and unused vertices.
///           Vertices in one place, as along seams, count as one
/// Shapes    points: [V]; weights: [V, J], not negative, each row sums to 1; those below 1e-3 are left out
/// Numerics  one look-up a vertex, and sweeps over the edges. What doubt is worth: docs/notes/tuned-numbers.md
#pragma once

#include <npt/base/as_span.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/vec3.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/fitted_body.hpp>
#include <npt/body/sparse_matrix.hpp>
#include <npt/config.hpp>
#include <npt/estimate/body_look_up.hpp>
#include <npt/estimate/place_patches.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/topology.hpp>
#include <npt/mesh/union_find.hpp>
#include <npt/mesh/weld.hpp>
#include <npt/skin/hand_skin.hpp>
#include <npt/skin/rigid_pieces.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

struct BodyWeightsOptions {
  double facing = 1;  ///< as CorrespondenceFit's
  /// Whether the left and the right hand are closed; for a kind with hands.
  std::array<bool, 2> closed{};
};

namespace skeleton::internal {
NPT_INLINE_CLASS(class, BodyWeights);
template <class>
class BasicBodyWeights {
 public:
  template <Executor Exec>
  BasicBodyWeights(const BodyKind& kind, const BodyFit& fit, std::vector<Vec3d> points, std::vector<Triangle> triangles,
                   const BodyWeightsOptions& options, const Exec& executor)
      : kind_(kind),
        model_(kind.bound_body()),
        fit_(fit),
        points_(std::move(points)),
        triangles_(std::move(triangles)),
        options_(options),
        joints_(model_.joint_count()),
        stride_((joints_ + lanes - 1) / lanes * lanes) {
    executor.for_each(2, [&](int i, int) {
      if (i == 0) return locate(executor);
      edges_ = edges_of_triangles(as_span(triangles_));
      around_ = neighbours(as_span(edges_), points_.size());
    });
    doubt_patches();
    doubt_far();
    solve();
    if (kind_.hands) bind_hands();
    RigidPieces(points_, triangles_, model_.tables().parents, certain_).move(rows(), stride_);
  }

  /// Whether the left and the right hand have fingers.
  const std::array<bool, 2>& fingers() const { return fingers_; }

  /// [P, J]
  SparseMatrix weights() const {
    SparseMatrix result;
    result.columns = joints_;
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const float* row = &weights_[p * stride_];
      float sum = 0;
      for (std::size_t j = 0; j < joints_; ++j) sum += row[j] > least_kept ? row[j] : 0;
      for (std::uint32_t j = 0; j < joints_; ++j)
        if (row[j] > least_kept) result.append(j, row[j] / sum);
      result.end_row();
    }
    return result;
  }

 private:
  static constexpr float least_kept = 1e-3F;
  /// Distance from the body, in metres, from which on a vertex is attached to the mesh and not on the nearest limb, and
  /// that down to which what is connected to it does. Clothes keep up to 0.1; tails, wings and blades end 0.2 to 0.4
  /// away.
  static constexpr double far = 0.1, off = far / 2;
  static constexpr std::size_t lanes = 8;

  /// Adds a row to another, in blocks that a compiler takes to registers at -O2.
  void add(const float* from, float* to) const {
    for (std::size_t j = 0; j < stride_; j += lanes) {
      std::array<float, lanes> sum;
      for (std::size_t lane = 0; lane < lanes; ++lane) sum[lane] = to[j + lane] + from[j + lane];
      for (std::size_t lane = 0; lane < lanes; ++lane) to[j + lane] = sum[lane];
    }
  }

  std::span<float> rows() const { return {weights_.get(), points_.size() * stride_}; }

  template <Executor Exec>
  void locate(const Exec& executor) {
    const BodyLookUp look_up(model_, fit_, options_.facing, kind_.joint_count());
    body_.assign(look_up.body().begin(), look_up.body().end());
    weights_.reset(new float[points_.size() * stride_]);  // not zeroed here: 99 MB for 440,834 points
    places_.resize(points_.size());
    distances_.resize(points_.size());
    certain_.assign(points_.size(), true);
    const std::vector<Vec3d> outward = area_vectors(as_span(points_), as_span(triangles_));
    look_up.for_each(as_span(points_), as_span(outward), executor, [&](std::size_t p, const ClosestPoint& c) {
      places_[p] = look_up.place(c);
      // To the surface as such: what faces another way, as a coat's lining, is no farther for that.
      distances_[p] = std::sqrt(c.squared_distance);
      if (distances_[p] > off) distances_[p] = look_up.distance(points_[p]);
      float* const row = &weights_[p * stride_];
      std::fill_n(row, stride_, 0.0F);
      look_up.for_each_weight(c,
                              [row](std::uint32_t joint, double weight) { row[joint] += static_cast<float>(weight); });
    });
  }

  /// Points beside tears, and small patches with others around, but where one is the most of its piece and lies on the
  /// body: of a shoe that touches the other leg, what was looked up on its own foot. Without that exception 1 of 60
  /// dressed mannequins is off by 66 instead of 29 mm.
  void doubt_patches() {
    const PlacePatches patches(kind_.plan, points_, triangles_, edges_, places_);
    std::vector<double> distance(points_.size()), count(points_.size());
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      distance[patches.patch(p)] += distances_[p], ++count[patches.patch(p)];
    std::vector<bool> doubted(points_.size(), false);
    for (const Edge& e : patches.broken())
      for (const std::uint32_t v : e) {
        const std::uint32_t patch = patches.patch(v);
        const bool worn = patches.most_of_piece(v) && distance[patch] < off / 2 * count[patch];
        if (patches.share(v) < small_share && !worn) doubted[patch] = true;
      }
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (doubted[patches.patch(p)]) certain_[p] = false;
    for (const Edge& e : patches.broken()) certain_[e[0]] = certain_[e[1]] = false;
  }

  /// What is far from the body, with what is off it in between; and the tips of those that come near another limb,
  /// small islands in what is left: a tail's along a calf.
  void doubt_far() {
    if (std::ranges::none_of(distances_, [](double d) { return d > far; })) return;
    const std::size_t count = points_.size();
    UnionFind regions(count);
    for (const Edge& e : edges_)
      if ((distances_[e[0]] > off) == (distances_[e[1]] > off)) regions.unite(e[0], e[1]);
    const std::vector<std::uint32_t> region = regions.sets();
    const std::vector<double> share = area_shares(as_span(points_), as_span(triangles_), as_span(region));
    std::vector<bool> away(count, false), island(count, false);
    for (std::uint32_t p = 0; p < count; ++p)
      if (distances_[p] > far) away[region[p]] = true;
    for (const Edge& e : edges_) {
      const std::uint32_t a = region[e[0]], b = region[e[1]];
      if (a == b) continue;
      if (away[a] && share[b] < tiny_share) island[b] = true;
      if (away[b] && share[a] < tiny_share) island[a] = true;
    }
    for (std::uint32_t p = 0; p < count; ++p)
      if (away[region[p]] || island[region[p]]) certain_[p] = false;
  }

  /// The first sweep reaches what is uncertain from its border inwards: it gives each point the mean of the neighbours
  /// that are nearer to certain ones. What no path reaches keeps D.
  void solve() {
    std::vector<std::uint32_t> layer(points_.size(), no_index), order;
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (certain_[p]) layer[p] = 0, order.push_back(p);
    for (std::size_t i = 0; i < order.size(); ++i)
      for (const std::uint32_t n : around_.of(order[i]))
        if (layer[n] == no_index) layer[n] = layer[order[i]] + 1, order.push_back(n);
    // On meshes finer than 1 cm D is smooth already at the length of an edge: one sweep, which finds D in place.
    constexpr std::size_t sweeps = 4, coarse = 30000;
    std::vector<float> data;
    if (points_.size() < sweeps * coarse) data.assign(rows().begin(), rows().end());
    const auto data_of = [&](std::uint32_t p) { return &(data.empty() ? weights_.get() : data.data())[p * stride_]; };
    for (const std::uint32_t p : order) relax(p, data_of(p), 0, [&](std::uint32_t n) { return layer[n] < layer[p]; });
    std::vector<float> certainties;
    for (std::uint32_t p = 0; p < points_.size(); ++p) certainties.push_back(certain_[p] ? certainty(p) : 0.0F);
    for (std::size_t i = 0; i < sweeps && i * points_.size() < sweeps * coarse; ++i) {
      for (const std::uint32_t p : order) relax(p, data_of(p), certainties[p], [](std::uint32_t) { return true; });
      std::ranges::reverse(order);
    }
  }

  /// c[p] for each neighbour, of those at distance h: W - reach^2 laplace(W) = D, where the neighbours' mean less W is
  /// h^2 / 4 times the Laplacian. Other people and clothes are best with 2.5 cm. The mannequin, whose weights these
  /// are, would be 3 % better with 1.5 cm.
  float certainty(std::uint32_t p) const {
    constexpr double reach = 0.025;
    double squares = 0;
    for (const std::uint32_t n : around_.of(p)) squares += dot(points_[n] - points_[p], points_[n] - points_[p]);
    const double mean = squares / static_cast<double>(std::max<std::size_t>(1, around_.of(p).size()));
    return static_cast<float>(mean / (4 * reach * reach));
  }

  /// A point's weights from its D and those neighbours that `use(n)` accepts.
  template <class Use>
  void relax(std::uint32_t p, const float* from, float certainty, const Use& use) {
    sum_.assign(stride_, 0.0F);
    float count = 0;
    for (const std::uint32_t n : around_.of(p))
      if (use(n)) add(&weights_[n * stride_], sum_.data()), ++count;
    if (count == 0) return;
    const float own = certainty / (1 + certainty), others = 1 / ((1 + certainty) * count);
    float* to = &weights_[p * stride_];
    for (std::size_t j = 0; j < stride_; j += lanes)
      for (std::size_t lane = 0; lane < lanes; ++lane) to[j + lane] = own * from[j + lane] + others * sum_[j + lane];
  }

  void bind_hands() {
    std::vector<float> skin = model_.tables().weights.to_dense();
    const Neighbours around = neighbours(as_span(edges_of_triangles(model_.triangles())), model_.vertex_count());
    for (std::size_t side = 0; side < 2; ++side) {
      const HandJoints& joints = kind_.hands->joints[side];
      const HandSkin of_body({body_, &around, skin, joints_}, joints);
      HandSkin hand({points_, &around_, rows(), stride_}, joints);
      fingers_[side] = hand.like(of_body);
      if (!fingers_[side])
        hand.stiffen();
      else if (options_.closed[side])
        hand.take(of_body);
    }
  }

  const BodyKind& kind_;
  const BodyModel& model_;  ///< the kind's that characters are bound to
  const BodyFit& fit_;
  std::array<bool, 2> fingers_{};
  std::vector<Vec3d> body_;  ///< its vertices as fitted
  std::vector<Vec3d> points_;
  std::vector<Triangle> triangles_;
  BodyWeightsOptions options_;
  std::size_t joints_, stride_;
  std::vector<Edge> edges_;
  Neighbours around_;
  std::unique_ptr<float[]> weights_;  ///< [P, stride], rows in whole registers
  std::vector<float> sum_;            ///< [stride] of the neighbours that a point is relaxed to
  std::vector<BodyPlace> places_;     ///< [P]
  std::vector<double> distances_;     ///< [P] from the body
  std::vector<bool> certain_;         ///< [P] whether a point's look-up is
};

}  // namespace skeleton::internal

struct BoundWeights {
  SparseMatrix weights;           ///< [V, J]
  std::array<bool, 2> fingers{};  ///< whether the left and the right hand have any, for a kind with hands
};

/// Requires  finite points, triangles of numbers below V, a fit of the body that characters are bound to
template <Executor Exec = SerialExecutor>
BoundWeights body_weights(const BodyKind& kind, const BodyFit& fit, std::span<const Vec3d> points,
                          std::span<const Triangle> triangles, const BodyWeightsOptions& options = {},
                          const Exec& executor = Exec()) {
  std::vector<float> xyz;
  xyz.reserve(3 * points.size());
  for (const Vec3d p : points)
    xyz.insert(xyz.end(), {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  const Welding welding = weld(as_span(xyz));
  std::vector<Vec3d> welded;
  welded.reserve(welding.vertex_of.size());
  for (const std::uint32_t v : welding.vertex_of) welded.push_back(points[v]);
  const skeleton::internal::BodyWeights bound(kind, fit, std::move(welded), welding.welded(triangles), options,
                                              executor);
  return {bound.weights().gathered(as_span(welding.point_of)), bound.fingers()};
}

}  // namespace npt::inline NPT_ABI
