/// Opens the domain of a weights file: that of the kind of body which the file holds (kind_file.hpp), or people's.
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/executor.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/config.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/kind_domain.hpp>
#include <npt/transfer/options.hpp>

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace npt::inline NPT_ABI {

namespace transfer::internal {

NPT_INLINE std::shared_ptr<const BodyDomain> open_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                         int threads) {
  if (file.part("correspondence/").tensors().empty()) return nullptr;
  if constexpr (std::is_same_v<DefaultExecutor, SerialExecutor>) threads = 1;
  const DefaultExecutor executor(threads);
  std::shared_ptr<const BodyKind> kind;
  std::optional<CorrespondenceEstimator> reader;
  executor.for_each(2, [&](int i, int) {  // of 40 and 15 ms
    if (i > 0) return void(reader.emplace(file.part("correspondence/"), executor));
    kind = load_body_kind(file);
    if (!kind) kind = people_kind();
  });
  return std::make_shared<const KindDomain<>>(file, *std::move(reader), std::move(kind), options);
}

}  // namespace transfer::internal

#ifndef NPT_COMPILED
template <class>
std::shared_ptr<const BodyDomain> open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                   int threads) {
  return transfer::internal::open_domain(file, options, threads);
}
#endif

}  // namespace npt::inline NPT_ABI
