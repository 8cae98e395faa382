/// The domain of people: that of their kind of body (kind_domain.hpp).
#pragma once

#include <npt/base/default_executor.hpp>
#include <npt/base/executor.hpp>
#include <npt/body/people_kind.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/kind_domain.hpp>
#include <npt/transfer/options.hpp>

#include <memory>
#include <type_traits>

namespace npt::inline NPT_ABI {

namespace transfer::internal {

NPT_INLINE std::shared_ptr<const BodyDomain> open_people(const SafetensorsFile& file, const BodyOptions& options,
                                                         int threads) {
  if (file.part("correspondence/").tensors().empty()) return nullptr;
  if constexpr (std::is_same_v<DefaultExecutor, SerialExecutor>) threads = 1;
  return std::make_shared<const KindDomain<>>(file, people_kind(), options, threads);
}

}  // namespace transfer::internal

#ifndef NPT_PREBUILT
template <class>
std::shared_ptr<const BodyDomain> open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                   int threads) {
  return transfer::internal::open_people(file, options, threads);
}
#endif

}  // namespace npt::inline NPT_ABI
