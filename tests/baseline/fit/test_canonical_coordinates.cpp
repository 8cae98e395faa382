#include <doctest/doctest.h>

#include <npt/baseline/fit/canonical_coordinates.hpp>
#include <npt/body/body_file.hpp>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "support/needs.hpp"

TEST_CASE("the mannequin's canonical coordinates are its own resting vertices") {
  CHECK(npt::canonical_coordinates(npt::mannequin()) == npt::mannequin().tables().v_template);
}

TEST_CASE("another body's lie on the mannequin, left on the left and feet at the feet" *
          support::needs_shared("data/human_6890.safetensors")) {
  const npt::BodyModel body = npt::load_body(std::filesystem::path(NPT_SHARED) / "data/human_6890.safetensors");
  const std::vector<float> canonical = npt::canonical_coordinates(body);
  REQUIRE(canonical.size() == 3 * body.vertex_count());
  const std::vector<float>& rest = body.tables().v_template;
  std::size_t same_side = 0, wide = 0;
  for (std::size_t v = 0; v < body.vertex_count(); ++v) {
    if (std::abs(rest[3 * v]) < 0.05F) continue;
    ++wide;
    same_side += (rest[3 * v] > 0) == (canonical[3 * v] > 0) ? 1U : 0U;
  }
  CHECK(same_side > wide * 99 / 100);
}
