/// How well meshes are transferred: pairs with a known truth, and the errors of their results.
///   pmd             eq. 7 with both bounding boxes centred: what the paper's public evaluation computes, times three
///   pmd_in_place    eq. 7 with the result left where the network puts it, beside the identity's centre: what the
///                   reconstruction loss sees
///   edge_error      mean over the identity's edges of |length / true length - 1|
/// Alignment of all errors but pmd_in_place: both bounding boxes are centred; nothing is turned or scaled.
/// Unit of accuracy: millimetres, the root mean square over the vertices (root_mm), at the identity's own size. Meshes
/// whose unit is known are in metres. Rigs come in units of the longest side of their box as bound; in_metres() makes
/// that assumed_size.
/// Shapes    pose: [Vp, 3]; identity, truth, result: [V, 3], row major
/// Units     metres for bodies: pmd in square metres
/// Numerics  sums in double, in a fixed order; a result with a NaN has errors that are NaN
/// Source    Wang et al., CVPR 2020, eq. 7
#pragma once

#include <npt/base/error.hpp>
#include <npt/base/executor.hpp>
#include <npt/base/random.hpp>
#include <npt/config.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/draws.hpp>
#include <npt/mesh/metrics.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/topology.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A transfer whose result is known. Meshes are in their own unit and place.
struct EvaluationPair {
  std::string name;
  std::vector<float> pose;      ///< [Vp, 3]
  std::vector<float> identity;  ///< [V, 3]
  std::vector<float> truth;     ///< [V, 3]: vertex v is the identity's vertex v
  std::vector<Triangle> pose_triangles;
  std::vector<Edge> edges;  ///< of the identity, each once
  std::vector<Triangle> identity_triangles{};
};

/// A named list of pairs, each made when it is asked for. `pair(i)`, i < count, always gives the same and may be called
/// by several threads at a time.
struct EvaluationSet {
  std::string name;
  std::size_t count = 0;
  std::function<EvaluationPair(std::size_t)> pair{};
};

/// A set's pairs with normal noise of standard deviation `sigma` on every coordinate of the pose mesh.
/// Errors  npt::Error for a `sigma` that is negative or not finite
inline EvaluationSet with_noise(EvaluationSet set, double sigma, std::uint64_t seed) {
  if (!(sigma >= 0) || !std::isfinite(sigma))
    throw Error({.file = "noise", .found = std::to_string(sigma), .expected = "a number from 0"});
  if (sigma == 0) return set;
  set.pair = [pair = std::move(set.pair), sigma, seed](std::size_t i) {
    EvaluationPair result = pair(i);
    Random random = data::random_for(data::Purpose::evaluation, seed, 0, i, data::Part::noise);
    data::add_noise(result.pose, sigma, random);
    return result;
  };
  return set;
}

/// What the longest side of a rigged character's box as bound counts as, in metres: a person's height.
inline constexpr double assumed_size = 1.7;

/// A set's pairs in metres: `metres` are in one unit of its meshes.
/// Errors  npt::Error for `metres` that are not above 0, or not finite
inline EvaluationSet in_metres(EvaluationSet set, double metres) {
  if (!(metres > 0) || !std::isfinite(metres))
    throw Error({.file = "metres in a unit", .found = std::to_string(metres), .expected = "a number above 0"});
  set.pair = [pair = std::move(set.pair), metres](std::size_t i) {
    EvaluationPair result = pair(i);
    for (std::vector<float>* xyz : {&result.pose, &result.identity, &result.truth})
      for (float& x : *xyz) x = static_cast<float>(metres * static_cast<double>(x));
    return result;
  };
  return set;
}

struct PairErrors {
  std::string name;
  double pmd = 0, pmd_in_place = 0, edge_error = 0;
  std::size_t number = 0;  ///< in its set

  double per_coordinate() const { return pmd / 3; }
  double root_mm() const { return root_pmd_mm(pmd); }
};

/// The errors of a set. Means over pairs, each pair counting once; root_mm is the root of the mean.
struct Evaluation {
  std::string name;
  std::vector<PairErrors> pairs;       ///< those with a result; without any, all means are NaN
  std::vector<std::string> refused{};  ///< messages of the others, whose meshes the transfer doesn't recognise

  double pmd() const { return mean(&PairErrors::pmd); }
  double pmd_in_place() const { return mean(&PairErrors::pmd_in_place); }
  double edge_error() const { return mean(&PairErrors::edge_error); }
  double per_coordinate() const { return pmd() / 3; }
  double root_mm() const { return root_pmd_mm(pmd()); }

  /// The median of the pairs' PMD; of an even number of pairs the mean of the two in the middle. NaN counts as
  /// infinite.
  double median_pmd() const {
    const std::vector<std::size_t> order = worst(pairs.size());
    if (order.empty()) return std::numeric_limits<double>::quiet_NaN();
    return (badness(order[(order.size() - 1) / 2]) + badness(order[order.size() / 2])) / 2;
  }
  /// Mean and median of the pairs' root_mm. The mean is NaN where a pair's is.
  double mean_mm() const {
    double sum = 0;
    for (const PairErrors& pair : pairs) sum += pair.root_mm();
    return sum / static_cast<double>(pairs.size());
  }
  double median_mm() const {
    const std::vector<std::size_t> order = worst(pairs.size());
    if (order.empty()) return std::numeric_limits<double>::quiet_NaN();
    return (root_pmd_mm(badness(order[(order.size() - 1) / 2])) + root_pmd_mm(badness(order[order.size() / 2]))) / 2;
  }
  /// The largest PMD of a pair.
  double worst_pmd() const {
    return pairs.empty() ? std::numeric_limits<double>::quiet_NaN() : pairs[worst(1).front()].pmd;
  }

  /// The places in `pairs` of the `count` pairs with the largest PMD, worst first; NaN is worst of all.
  std::vector<std::size_t> worst(std::size_t count) const {
    std::vector<std::size_t> order(pairs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return badness(a) > badness(b); });
    order.resize(std::min(count, order.size()));
    return order;
  }

 private:
  double badness(std::size_t i) const {
    return std::isnan(pairs[i].pmd) ? std::numeric_limits<double>::infinity() : pairs[i].pmd;
  }
  double mean(double PairErrors::*error) const {
    double sum = 0;
    for (const PairErrors& pair : pairs) sum += pair.*error;
    return sum / static_cast<double>(pairs.size());
  }
};

/// Mean over `edges` of |length / true length - 1|. Edges without length in the truth don't count; 0 where none does.
inline double edge_error(std::span<const float> result, std::span<const float> truth, std::span<const Edge> edges) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& [a, b] : edges) {
    const double wanted = length(point_at(truth, a) - point_at(truth, b));
    if (wanted == 0) continue;
    sum += std::abs(length(point_at(result, a) - point_at(result, b)) / wanted - 1);
    ++count;
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

/// The errors of one result, [V, 3] in the identity's unit and place.
/// Errors  npt::Error for a truth or result of another vertex count than the identity
inline PairErrors pair_errors(const EvaluationPair& pair, std::span<const float> result) {
  expect_comparable(pair.identity, pair.truth);
  expect_comparable(result, pair.truth);
  const auto centred = [](std::span<const float> xyz, Vec3d centre) {
    std::vector<float> moved(xyz.size());
    NormalisingTransform{centre, 1}.apply(xyz, moved);
    return moved;
  };
  const std::vector<float> truth = centred(pair.truth, bounding_box(pair.truth).centre());
  return {.name = pair.name,
          .pmd = pmd(centred(result, bounding_box(result).centre()), truth),
          .pmd_in_place = pmd(centred(result, bounding_box(pair.identity).centre()), truth),
          .edge_error = edge_error(result, truth, pair.edges)};
}

/// Runs `transfer(pair, result)`, or `transfer(number, pair, result)`, on every pair of the set; it writes the result,
/// [V, 3], in the identity's unit and place. With an executor of several slots, `transfer` and `after_pair` are called
/// by several threads at a time. A pair that it refuses with ErrorCode::not_recognised is counted, and has no errors.
/// Errors  npt::Error for an empty set, and what else the pairs or the transfer throw
template <class Transfer, Executor Exec = SerialExecutor>
Evaluation evaluate(const EvaluationSet& set, const Transfer& transfer, const Exec& executor = Exec(),
                    const std::function<void()>& after_pair = {}) {
  if (set.count == 0) throw Error({.file = set.name, .found = "no pairs to evaluate", .expected = "at least one"});
  std::vector<PairErrors> errors(set.count);
  std::vector<std::string> refusals(set.count);
  executor.for_each(static_cast<int>(set.count), [&](int i, int) {
    const auto number = static_cast<std::size_t>(i);
    const EvaluationPair pair = set.pair(number);
    std::vector<float> result(pair.identity.size());
    try {
      if constexpr (std::is_invocable_v<const Transfer&, std::size_t, const EvaluationPair&, std::span<float>>)
        transfer(number, pair, std::span<float>(result));
      else
        transfer(pair, std::span<float>(result));
      errors[number] = pair_errors(pair, result);
      errors[number].number = number;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::not_recognised) throw;
      refusals[number] = pair.name + ": " + error.what();
    }
    if (after_pair) after_pair();
  });
  Evaluation evaluation{.name = set.name, .pairs = {}};
  for (std::size_t i = 0; i < set.count; ++i)
    if (refusals[i].empty())
      evaluation.pairs.push_back(std::move(errors[i]));
    else
      evaluation.refused.push_back(std::move(refusals[i]));
  return evaluation;
}

/// A transfer for evaluate() from a network in its own coordinates, `network(pose, identity, result)`: pose and
/// identity are normalised each by itself, the result goes back to the identity's unit and place.
template <class Network>
auto normalised_transfer(Network network, Normalisation normalisation) {
  return [network = std::move(network), normalisation](const EvaluationPair& pair, std::span<float> result) {
    const NormalisingTransform transform = normalising_transform(pair.identity, normalisation, "identity");
    std::vector<float> identity(pair.identity.size()), pose(pair.pose.size());
    transform.apply(pair.identity, identity);
    normalising_transform(pair.pose, normalisation, "pose").apply(pair.pose, pose);
    network(std::span<const float>(pose), std::span<const float>(identity), result);
    transform.apply_inverse(result, result);
  };
}

}  // namespace npt::inline NPT_ABI
