#define NPT_COMPILING
#include <npt/transfer/open_domain.hpp>

std::shared_ptr<const npt::BodyDomain> npt::open_body_domain(const SafetensorsFile& file, const BodyOptions& options,
                                                             int threads) {
  return transfer::internal::open_domain(file, options, threads);
}
