#include <doctest/doctest.h>

#include <io/scratch.hpp>
#include <mesh/shapes.hpp>
#include <npt/base/thread_executor.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/markers.hpp>
#include <npt/mesh/permute.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace {

using npt::Marker;
using npt::Mesh;
using npt::Vec3d;

constexpr std::uint32_t ring_count = 24, sector_count = 36;

/// The ends of the four limbs and the two poles.
std::vector<std::uint32_t> ends() {
  const std::uint32_t middle = 1 + (ring_count / 2 - 1) * sector_count;
  return {0,
          1 + (ring_count - 1) * sector_count,
          middle,
          middle + sector_count / 4,
          middle + sector_count / 2,
          middle + 3 * sector_count / 4};
}

std::vector<Marker> markers_between(const std::vector<std::uint32_t>& source,
                                    const std::vector<std::uint32_t>& target) {
  std::vector<Marker> markers;
  for (std::size_t i = 0; i < source.size(); ++i) markers.push_back({source[i], target[i]});
  return markers;
}

std::vector<std::uint32_t> at(const std::vector<std::uint32_t>& places, std::vector<std::uint32_t> vertices) {
  for (std::uint32_t& v : vertices) v = places[v];
  return vertices;
}

double mean_distance(const std::vector<npt::Vec3f>& a, const std::vector<npt::Vec3f>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += length(a[i].as<double>() - b[i].as<double>());
  return sum / static_cast<double>(a.size());
}

}  // namespace

TEST_CASE("the same body in another vertex order, place, direction and size: each triangle finds itself") {
  const Mesh source = shapes::starfish(ring_count, sector_count);
  const auto order = shapes::some_order(source, 3);
  Mesh target = npt::permute_vertices(source, order);
  for (npt::Vec3f& p : target.positions) p = {3 - 2 * p.y, 2 * p.x, 2 * p.z};
  const auto markers = markers_between(ends(), at(npt::inverse_order(order), ends()));
  const npt::Correspondence found = npt::find_correspondence(source, target, markers);
  CHECK(found.pairs == npt::identical_pairs(source.face_count()));
  CHECK(std::abs(found.similarity.scale - 2) < 1e-6);
  CHECK(length(found.similarity.rotation * Vec3d{1, 0, 0} - Vec3d{0, 1, 0}) < 1e-6);
  for (std::size_t v = 0; v < order.size(); ++v)
    REQUIRE(length(found.registered[order[v]].as<double>() - target.positions[v].as<double>()) < 1e-5);
}

TEST_CASE("another body: the source lies on it, corresponding vertices near each other, markers on markers") {
  const Mesh source = shapes::starfish(ring_count, sector_count),
             target = shapes::starfish(ring_count, sector_count, 0.3);
  const auto order = shapes::some_order(source, 5);
  const Mesh shuffled = npt::permute_vertices(target, order);
  const auto markers = markers_between(ends(), at(npt::inverse_order(order), ends()));
  std::vector<npt::RegistrationStep> steps;
  const npt::Correspondence found = npt::find_correspondence(
      source, shuffled, markers, {}, [&steps](const npt::RegistrationStep& step) { steps.push_back(step); });
  REQUIRE(steps.size() == 11);
  CHECK(steps.front().weight == 0);
  CHECK(steps[1].weight == 1);
  CHECK(std::abs(steps.back().weight - 5000) < 1e-6);
  CHECK(steps.back().distance < 0.2 * steps[1].distance);
  CHECK(steps.back().step == steps.back().steps);
  for (const std::uint32_t v : ends())
    CHECK(length(found.registered[v].as<double>() - target.positions[v].as<double>()) < 1e-6);
  CHECK(mean_distance(found.registered, target.positions) < 0.03);  // of a size of 3.4
  CHECK(mean_distance(source.positions, target.positions) > 0.1);

  // Every triangle of either has a partner, and partners are near each other.
  std::vector<char> has_source(source.face_count()), has_target(source.face_count());
  const npt::deformation::Surface surface = npt::deformation::surface_of(target, "target");
  for (const auto& [s, t] : found.pairs) {
    has_source[s] = has_target[t] = 1;
    CHECK(length(surface.centroid(s) - surface.centroid(t)) < 0.4);  // permuted vertices, but the same faces
  }
  CHECK(std::ranges::count(has_source, 1) == std::ssize(has_source));
  CHECK(std::ranges::count(has_target, 1) == std::ssize(has_target));
  CHECK(std::ranges::is_sorted(found.pairs));
  const npt::Correspondence again = npt::find_correspondence(source, shuffled, markers, {}, {}, npt::ThreadExecutor(2));
  CHECK(again.pairs == found.pairs);
  CHECK(again.registered == found.registered);
}

TEST_CASE("bodies of different resolution") {
  const Mesh source = shapes::starfish(16, 24), target = shapes::starfish(ring_count, sector_count, 0.2);
  const std::uint32_t middle = 1 + 7 * 24;
  const std::vector<std::uint32_t> own{0, 1 + 15 * 24, middle, middle + 6, middle + 12, middle + 18};
  const npt::Correspondence found = npt::find_correspondence(source, target, markers_between(own, ends()));
  std::vector<char> paired(target.face_count());
  for (const auto& [s, t] : found.pairs) paired[t] = 1;
  CHECK(std::ranges::count(paired, 1) == std::ssize(paired));
  CHECK(found.registered.size() == source.vertex_count());
}

TEST_CASE("bad meshes are registered, or the error says what is wrong") {
  const Mesh source = shapes::bad_mesh(), target = shapes::bad_mesh(0.2);
  std::vector<Marker> markers;
  for (const std::uint32_t v : {0U, 170U, 176U, 182U, 5U}) markers.push_back({v, v});
  const auto finite = [](const npt::Correspondence& found) {
    return std::ranges::all_of(found.registered, [](npt::Vec3f p) { return npt::is_finite(p); });
  };
  const auto found = npt::find_correspondence(source, target, markers);
  CHECK(finite(found));
  CHECK(found.pairs.size() > 600);
  // The piece apart (the last vertices but two) came along with the body.
  const std::size_t apart = source.vertex_count() - 10;
  CHECK(length(found.registered[apart].as<double>() - target.positions[apart].as<double>()) < 0.3);
  npt::CorrespondenceOptions open;
  open.weld = false;
  CHECK(finite(npt::find_correspondence(source, target, markers, open)));
  // Markers on the small piece only: the body hangs on it.
  const auto last = static_cast<std::uint32_t>(source.vertex_count() - 3);
  CHECK(finite(npt::find_correspondence(source, target, std::vector<Marker>{{last, last}})));
  CHECK(finite(npt::find_correspondence(source, target, std::vector<Marker>{{0, 0}})));

  const auto error = [&](const std::vector<Marker>& list) {
    return scratch::error_of([&] { npt::find_correspondence(source, target, list); });
  };
  const auto count = static_cast<std::uint32_t>(source.vertex_count());
  CHECK(error({}).find("markers: found none") != std::string::npos);
  CHECK(error({{0, 0}, {count, 1}}).find("marker 2: found vertex " + std::to_string(count) + " of the source") !=
        std::string::npos);
  CHECK(error({{0, count}}).find("of the target") != std::string::npos);
  CHECK(error({{count - 1, 0}}).find("in no face") != std::string::npos);
  CHECK(error({{3, 3}, {3, 4}}).find("second time") != std::string::npos);
  CHECK(error({{3, 3}, {3, 3}, {4, 4}}) == "no error");
}

TEST_CASE("a source whose every point is a marker has nothing to solve") {
  const Mesh source = shapes::mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const Mesh target = shapes::mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 3, 1}}, {{0, 1, 2}});
  const auto found = npt::find_correspondence(source, target, std::vector<Marker>{{0, 0}, {1, 1}, {2, 2}});
  CHECK(found.pairs == npt::identical_pairs(1));
  CHECK(found.registered[2] == target.positions[2]);
}

TEST_CASE("a file of markers is read; what is none is an error with its line") {
  CHECK(npt::parse_markers("# head\n3 5\n\n  7\t9 # hand\r\n", "m") == std::vector<Marker>{{3, 5}, {7, 9}});
  const auto error = [](const char* text) { return scratch::error_of([&] { npt::parse_markers(text, "m.txt"); }); };
  CHECK(error("") == "m.txt: found no markers, expected lines of: source_vertex target_vertex");
  CHECK(error("1 2\n3") == "m.txt: line 2: found 1 word, expected source_vertex target_vertex");
  CHECK(error("1 2 3").find("3 words") != std::string::npos);
  CHECK(error("1 -2").find("'-2'") != std::string::npos);
  CHECK(error("1 99999999999").find("'99999999999'") != std::string::npos);
  CHECK(error("1 2.5").find("'2.5'") != std::string::npos);
  CHECK(error("1 \"2").find("quotation") != std::string::npos);
}
