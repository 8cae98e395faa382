#define NPT_PREBUILDING
#include <npt/transfer/body_method.hpp>

std::shared_ptr<const npt::BodyMethod> npt::body_method(const std::filesystem::path& reader, int threads) {
  return skeleton::internal::open_body_method(reader, threads);
}
