#include <doctest/doctest.h>

#include <npt/body/people_plan.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/estimate/place_patches.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

constexpr npt::BodyPlace left_thigh{{0.05, -0.3, 0}, 1}, right_thigh{{-0.05, -0.3, 0}, 2}, left_shin{{0.1, -0.7, 0}, 4},
    right_shin{{-0.1, -0.7, 0}, 5};

/// A strip of squares of 2 cm, two triangles each; points 2 i and 2 i + 1 share a place.
struct Strip {
  std::vector<npt::Vec3d> points;
  std::vector<npt::Triangle> triangles;
  std::vector<npt::BodyPlace> places;

  void add(const npt::BodyPlace& place, bool new_piece = false) {
    const auto next = static_cast<std::uint32_t>(points.size());
    const double x = 0.02 * next / 2;
    points.insert(points.end(), {{x, 0, 0}, {x, 0.02, 0}});
    places.insert(places.end(), 2, place);
    if (next == 0 || new_piece) return;
    triangles.push_back({next - 2, next, next - 1});
    triangles.push_back({next - 1, next, next + 1});
  }
  npt::PlacePatches patches() const {
    return {npt::people_plan(), points, triangles, npt::edges_of_triangles(triangles), places};
  }
};

bool continuous(const npt::BodyPlace& a, const npt::BodyPlace& b, double distance) {
  return npt::continuous_places(npt::people_plan(), npt::smpl_parents, a, b, distance);
}

}  // namespace

TEST_CASE("places are continuous along a limb and between thighs, not from leg to leg") {
  CHECK(continuous(left_thigh, left_thigh, 0));
  CHECK(continuous(left_thigh, {{0.06, -0.38, 0}, 4}, 0.02));
  CHECK(continuous({{0.01, -0.1, 0}, 1}, {{-0.01, -0.1, 0}, 2}, 0.02));
  CHECK_FALSE(continuous(left_thigh, right_thigh, 0.02));
  CHECK_FALSE(continuous(left_shin, right_thigh, 0.3));
  CHECK_FALSE(continuous(left_shin, right_shin, 0.01));
  CHECK_FALSE(continuous(left_thigh, left_shin, 0.02));
}

TEST_CASE("patches end where places jump; what is cut off from most of its piece is torn") {
  Strip s;
  for (int i = 0; i < 9; ++i) s.add(left_shin);
  for (int i = 0; i < 3; ++i) s.add(right_shin);
  const npt::PlacePatches patches = s.patches();
  CHECK(patches.patch(17) == 0);
  CHECK(patches.patch(23) == 18);
  CHECK_FALSE(patches.broken().empty());
  for (const npt::Edge& e : patches.broken()) CHECK(patches.patch(e[0]) != patches.patch(e[1]));
  CHECK(patches.share(0) + patches.share(20) == doctest::Approx(1));
  CHECK(patches.most_of_piece(3));
  CHECK_FALSE(patches.most_of_piece(20));
  CHECK(patches.torn() == doctest::Approx(patches.share(20)));
  CHECK(patches.torn() > 0.15);
}

TEST_CASE("pieces are judged each for itself") {
  Strip s;
  for (int i = 0; i < 8; ++i) s.add(left_shin);
  for (int i = 0; i < 4; ++i) s.add(right_shin, i == 0);
  const npt::PlacePatches patches = s.patches();
  CHECK(patches.broken().empty());
  CHECK(patches.torn() == doctest::Approx(0));
  CHECK(patches.piece_share(0) == doctest::Approx(0.7));
  CHECK(patches.most_of_piece(20));
}
