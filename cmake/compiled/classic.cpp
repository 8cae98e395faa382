// Transfer without networks: what its commands, which are compiled at -O1, and its tests, at -O0, take from here.
#include <npt/base/default_executor.hpp>
#include <npt/base/executor.hpp>
#include <npt/baseline.hpp>
#include <npt/baseline/deformation/deformation_evaluation.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh.hpp>

#include <memory>
#include <vector>

namespace npt::compiled {

/// Never called: naming the ways in has what lies behind them compiled here, for both executors.
template <class Exec>
std::vector<float> classic(const std::shared_ptr<const BodyFitter>& fitter, const EvaluationSet& set,
                           const DeformationCase& given, const Exec& executor) {
  const SkeletonTransfer transfer(fitter, given.target);
  const Mesh posed = transfer(given.source);
  evaluate(set, skeleton_system(fitter), executor);
  const DeformationTransfer deformation(given.source, given.target, identical_pairs(1));
  deform(deformation, given.target, given.source, executor);
  std::vector<float> result = run_deformation_case(given, {}, executor);
  result.insert(result.end(), posed.coordinates().begin(), posed.coordinates().end());
  return result;
}

template std::vector<float> classic(const std::shared_ptr<const BodyFitter>&, const EvaluationSet&,
                                    const DeformationCase&, const DefaultExecutor&);
template std::vector<float> classic(const std::shared_ptr<const BodyFitter>&, const EvaluationSet&,
                                    const DeformationCase&, const SerialExecutor&);

}  // namespace npt::compiled
