#include <doctest/doctest.h>

#include <npt/base/thread_executor.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/text.hpp>
#include <npt/lab/family.hpp>
#include <npt/lab/family_file.hpp>
#include <npt/lab/family_sampler.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "io/scratch.hpp"
#include "support/needs.hpp"

namespace {

namespace fs = std::filesystem;

/// The mesh of a species in a pose: random points that say whose they are.
std::vector<float> mesh_of(std::uint64_t species, std::uint64_t pose, std::size_t vertices) {
  npt::Random random(species, pose);
  std::vector<float> xyz(3 * vertices);
  for (float& x : xyz) x = static_cast<float>(random.uniform(-1, 1));
  return xyz;
}

npt::Species make_species(const std::string& name, std::uint64_t number, std::size_t vertices,
                          const std::vector<std::string>& labels) {
  npt::Species species;
  species.name = name;
  species.labels = labels;
  for (std::size_t i = 0; i < labels.size(); ++i) species.meshes.push_back(mesh_of(number, i, vertices));
  for (std::uint32_t v = 0; v + 2 < vertices; ++v) species.triangles.push_back({v, v + 1, v + 2});
  species.edges = npt::edges_of_triangles(species.triangles);
  return species;
}

std::shared_ptr<npt::Family> zoo() {
  auto family = std::make_shared<npt::Family>();
  family->name = "zoo";
  family->species = {make_species("cat", 1, 12, {"Run_00", "Run_01", "Sit_00", "Purr_00"}),
                     make_species("dog", 2, 15, {"Bark_00", "run_00", "sit_00", "run_01"}),
                     make_species("cow", 3, 20, {"Moo_00", "Sit_00"})};
  return family;
}

/// The numbers of species, label and row of every vertex of a mesh that none of the samplers' frames has moved.
std::pair<std::size_t, std::size_t> whose(const npt::Family& family, const std::vector<float>& xyz) {
  for (std::size_t s = 0; s < family.species.size(); ++s)
    for (std::size_t l = 0; l < family.species[s].meshes.size(); ++l) {
      const std::vector<float>& mesh = family.species[s].meshes[l];
      for (std::size_t v = 0; v < mesh.size() / 3; ++v)
        if (mesh[3 * v] == xyz[0] && mesh[3 * v + 1] == xyz[1] && mesh[3 * v + 2] == xyz[2]) return {s, l};
    }
  FAIL("a mesh of nobody");
  return {};
}

npt::SampleOptions untouched() {
  npt::SampleOptions options;
  options.normalisation = npt::Normalisation::none;
  return options;
}

void write_mesh(const fs::path& path, const npt::Species& species, std::size_t label) {
  npt::Mesh mesh;
  mesh.positions.resize(species.vertex_count());
  std::ranges::copy(species.meshes[label], mesh.coordinates().begin());
  mesh.face_start = {0};
  for (const npt::Triangle& t : species.triangles) {
    mesh.corners.insert(mesh.corners.end(), t.begin(), t.end());
    mesh.face_start.push_back(mesh.corners.size());
  }
  npt::write_mesh(path, mesh);
}

void write_species(const fs::path& path, const npt::Species& species,
                   const std::map<std::string, std::string>& metadata) {
  std::vector<float> poses;
  for (const auto& mesh : species.meshes) poses.insert(poses.end(), mesh.begin(), mesh.end());
  std::vector<std::int32_t> faces;
  for (const auto& t : species.triangles)
    for (const std::uint32_t v : t) faces.push_back(static_cast<std::int32_t>(v));
  const std::vector<npt::FileTensor> tensors{{.name = "poses",
                                              .dtype = npt::Dtype::f32,
                                              .shape = {species.meshes.size(), species.vertex_count(), 3},
                                              .bytes = std::as_bytes(std::span(poses))},
                                             {.name = "f",
                                              .dtype = npt::Dtype::i32,
                                              .shape = {species.triangles.size(), 3},
                                              .bytes = std::as_bytes(std::span(faces))}};
  npt::write_safetensors(path, tensors, metadata);
}

}  // namespace

TEST_CASE("a sample of a family: two species, the truth the identity's own mesh of the pose's label") {
  const auto family = zoo();
  const npt::FamilySampler sampler(family, {}, untouched());
  CHECK(!sampler.equal_counts());
  CHECK(sampler.max_vertices() == 20);
  std::set<std::pair<std::size_t, std::size_t>> species;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const npt::Sample sample = sampler.draw(i / 10, i % 10);
    const auto identity = whose(*family, npt::identity_of(sample)), pose = whose(*family, npt::pose_of(sample)),
               truth = whose(*family, sample.truth);
    REQUIRE(identity.first != pose.first);
    REQUIRE(truth.first == identity.first);
    REQUIRE(npt::lower_case(family->species[truth.first].labels[truth.second]) ==
            npt::lower_case(family->species[pose.first].labels[pose.second]));
    REQUIRE(sample.vertex_count() == family->species[identity.first].vertex_count());
    REQUIRE(npt::pose_of(sample).size() / 3 == family->species[pose.first].vertex_count());
    REQUIRE(sample.truth.size() == npt::identity_of(sample).size());
    species.emplace(identity.first, pose.first);
    // Vertex v of the truth is vertex v of the identity, and faces moved along.
    const auto& from = family->species[identity.first];
    for (std::size_t t = 0; t < sample.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t v = sample.triangles[t][k], u = from.triangles[t][k];
        REQUIRE(npt::identity_of(sample)[3 * v] == from.meshes[identity.second][3 * u]);
        REQUIRE(sample.truth[3 * v + 1] == from.meshes[truth.second][3 * u + 1]);
      }
    REQUIRE(sample.edges.size() == from.edges.size());
  }
  CHECK(species.size() == 6);
}

TEST_CASE("held-out labels are in no sample and in every pair of the evaluation") {
  const auto family = zoo();
  const npt::FamilySampler sampler(family, {"RUN"}, untouched());
  for (std::uint64_t i = 0; i < 200; ++i) {
    const npt::Sample sample = sampler.draw(0, i);
    for (const std::vector<float>* xyz : {&npt::identity_of(sample), &npt::pose_of(sample), &sample.truth}) {
      const auto [s, l] = whose(*family, *xyz);
      REQUIRE(!npt::data::label_matches(family->species[s].labels[l], "run"));
    }
  }
  const npt::EvaluationSet set = npt::family_pairs(family, {"RUN"});
  CHECK(set.count == 4);  // cat and dog, both ways, Run_00 and Run_01
  std::set<std::string> names;
  for (std::size_t i = 0; i < set.count; ++i) {
    const npt::EvaluationPair pair = set.pair(i);
    names.insert(pair.name);
    const auto truth = whose(*family, pair.truth), pose = whose(*family, pair.pose);
    CHECK(npt::data::label_matches(family->species[truth.first].labels[truth.second], "run"));
    CHECK(npt::lower_case(family->species[truth.first].labels[truth.second]) ==
          npt::lower_case(family->species[pose.first].labels[pose.second]));
    const auto identity = whose(*family, pair.identity);
    CHECK(identity.first == truth.first);
    CHECK(!npt::data::label_matches(family->species[identity.first].labels[identity.second], "run"));
    CHECK(pair.pose_triangles.size() == family->species[pose.first].triangles.size());
    for (std::size_t e = 0; e < pair.edges.size(); ++e) {
      const auto& from = family->species[identity.first];
      const auto [a, b] = from.edges[e];
      const double wanted =
          npt::length(npt::point_at(from.meshes[truth.second], a) - npt::point_at(from.meshes[truth.second], b));
      const double found =
          npt::length(npt::point_at(pair.truth, pair.edges[e][0]) - npt::point_at(pair.truth, pair.edges[e][1]));
      REQUIRE(found == doctest::Approx(wanted).epsilon(1e-9));
    }
  }
  CHECK(names.size() == 4);
  CHECK(npt::family_pairs(family, {}).count == 10);  // Run_00, Run_01 and Sit_00 of cat and dog, Sit_00 with cow
  CHECK(npt::family_pairs(family, {}, 3, 1).count == 3);
  CHECK(npt::family_pairs(family, {}, 3, 1).pair(2).name == npt::family_pairs(family, {}, 3, 1).pair(2).name);
}

TEST_CASE("blended and mirrored samples: the same is done to both species") {
  const auto family = zoo();
  const npt::FamilySampler sampler(family, {}, untouched(), {.blend = 0.5, .mirror = true});
  int blended = 0, mirrored = 0, identities = 0, one_movement = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto choice = sampler.choose(2, i);
    const npt::Sample sample = sampler.draw(2, i);
    const npt::Species &identity = family->species[choice.meshes.identity], &pose = family->species[choice.meshes.pose];
    blended += choice.second_share > 0 ? 1 : 0;
    mirrored += choice.mirrored ? 1 : 0;
    CHECK(npt::lower_case(identity.labels[choice.second_truth_label]) ==
          npt::lower_case(choice.second_share > 0 ? pose.labels[choice.second_pose_label] : identity.labels[0]));
    REQUIRE(choice.second_share < 0.5F);
    const auto expect = [&](const npt::Species& species, std::size_t first, std::size_t second, float share,
                            const std::vector<float>& xyz) {
      double worst = 0;
      for (std::size_t t = 0; t < sample.triangles.size() && &species == &identity; ++t)
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t u = 3 * species.triangles[t][k] + axis;
            const float a = species.meshes[first][u], b = species.meshes[second][u];
            const float sign = choice.mirrored && axis == 0 ? -1.0F : 1.0F;
            worst = std::max(worst, static_cast<double>(std::abs(sign * (a + share * (b - a)) -
                                                                 xyz[3 * sample.triangles[t][k] + axis])));
          }
      return worst;
    };
    const std::string& own = identity.labels[choice.meshes.identity_label];
    if (choice.identity_share > 0) {
      const std::string& second = identity.labels[choice.second_identity_label];
      CHECK(own.substr(0, own.find('_')) == second.substr(0, second.find('_')));
      identities += own == second ? 0 : 1;
    }
    const std::string first_pose = npt::lower_case(pose.labels[choice.meshes.pose_label]);
    const std::string second_pose = npt::lower_case(pose.labels[choice.second_pose_label]);
    one_movement += choice.second_share > 0 && first_pose.substr(0, 3) == second_pose.substr(0, 3) ? 1 : 0;
    REQUIRE(expect(identity, choice.meshes.identity_label, choice.second_identity_label, choice.identity_share,
                   npt::identity_of(sample)) < 1e-6);
    REQUIRE(expect(identity, choice.meshes.truth_label, choice.second_truth_label, choice.second_share, sample.truth) <
            1e-6);
  }
  CHECK(blended > 150);
  CHECK(blended < 250);
  CHECK(mirrored > 150);
  CHECK(mirrored < 250);
  CHECK(identities > 20);
  CHECK(one_movement > blended / 2);
  CHECK(one_movement < blended);
  CHECK_THROWS_AS(npt::FamilySampler(family, {}, untouched(), {.blend = 2}), npt::Error);
}

TEST_CASE("subsets of a family's vertices are in the whole mesh's frame, and the same from any thread") {
  const auto family = zoo();
  npt::SampleOptions options;
  options.vertices = 5;
  options.normalisation = npt::Normalisation::sphere;
  const npt::FamilySampler part(family, {}, options);
  CHECK(part.equal_counts());
  options.vertices = 0;
  options.shuffle = false;
  const npt::FamilySampler whole(family, {}, options);
  std::vector<npt::Sample> samples(40);
  npt::ThreadExecutor(3).for_each(
      40, [&](int i, int) { part.fill(1, static_cast<std::uint64_t>(i), samples[static_cast<std::size_t>(i)]); });
  for (std::size_t i = 0; i < 40; ++i) {
    const npt::Sample again = part.draw(1, i), full = whole.draw(1, i);
    REQUIRE(npt::identity_of(again) == npt::identity_of(samples[i]));
    REQUIRE(npt::pose_of(again) == npt::pose_of(samples[i]));
    REQUIRE(again.scale == full.scale);
    REQUIRE(again.edges.empty());
    for (std::size_t r = 0; r < 5; ++r) {
      bool found = false;
      for (std::size_t v = 0; v < full.vertex_count(); ++v)
        found = found || (npt::point_at(npt::identity_of(full), v) == npt::point_at(npt::identity_of(again), r) &&
                          npt::point_at(full.truth, v) == npt::point_at(again.truth, r));
      REQUIRE(found);
    }
  }
}

TEST_CASE("families that are none are refused, with the species' name") {
  const auto refused = [](const char* says, const std::function<void(npt::Family&)>& spoil) {
    const auto family = zoo();
    spoil(*family);
    const std::string message = scratch::error_of([&] { const npt::FamilySampler sampler(family); });
    INFO("wanted: ", says, ", found: ", message);
    CHECK(message.find(says) != std::string::npos);
  };
  using Family = npt::Family;
  refused("found 1 species", [](Family& f) { f.species.resize(1); });
  refused("species 'dog': found no labels", [](Family& f) { f.species[1].labels.clear(); });
  refused("species 'dog': found 3 labels, expected 4", [](Family& f) { f.species[1].labels.pop_back(); });
  refused("species 'cow', label 'Sit_00': found 19 vertices, expected 20",
          [](Family& f) { f.species[2].meshes[1].resize(57); });
  refused("species 'cow', label 'Moo_00': found 0 vertices", [](Family& f) { f.species[2].meshes[0].clear(); });
  refused("label 'sit_00' for a second mesh", [](Family& f) { f.species[2].labels[0] = "SIT_00"; });
  refused("a triangle at vertex 99", [](Family& f) { f.species[2].triangles[3][1] = 99; });
  refused("no label that two species share", [](Family& f) {
    for (npt::Species& s : f.species)
      for (std::string& label : s.labels) label = s.name + label;
  });
  CHECK(scratch::error_of([] { const npt::FamilySampler s(zoo(), {"Fly"}); }).find("'Fly'") != std::string::npos);
  CHECK(scratch::error_of([] {
          const npt::FamilySampler s(zoo(), {"Run", "Sit"});
        }).find("not held out") != std::string::npos);
  CHECK(scratch::error_of([] { npt::family_pairs(zoo(), {"Moo"}); }).find("among those held out") != std::string::npos);
  CHECK_THROWS_AS(npt::FamilySampler(nullptr), npt::Error);
  npt::SampleOptions options;
  options.vertices = 13;
  CHECK(scratch::error_of([&] { const npt::FamilySampler s(zoo(), {}, options); }).find("12, which cat has") !=
        std::string::npos);
}

TEST_CASE("a family is read from files of tensors and from folders of meshes") {
  const auto family = zoo();
  const scratch::Folder folder;
  write_species(folder / "cat.safetensors", family->species[0], {{"labels", "Run_00 Run_01 Sit_00  Purr_00"}});
  fs::create_directory(folder / "dog");
  for (std::size_t l = 0; l < 4; ++l)
    write_mesh(folder / "dog" / (family->species[1].labels[l] + (l % 2 == 0 ? ".ply" : ".OBJ")), family->species[1], l);
  fs::create_directory(folder / "empty");
  npt::write_file(folder / "dog/readme.txt", "a dog");
  npt::write_file(folder / "licence.txt", "free");
  const npt::Family read = npt::load_family(folder.path());
  REQUIRE(read.species.size() == 2);
  CHECK(read.species[0].name == "cat");
  CHECK(read.species[0].labels == family->species[0].labels);
  CHECK(read.species[0].meshes == family->species[0].meshes);
  CHECK(read.species[0].triangles == family->species[0].triangles);
  CHECK(read.species[0].edges == family->species[0].edges);
  CHECK(read.species[1].name == "dog");
  CHECK(read.species[1].labels == std::vector<std::string>{"Bark_00", "run_00", "run_01", "sit_00"});
  CHECK(read.species[1].meshes[0] == family->species[1].meshes[0]);
  CHECK(read.species[1].meshes[2] == family->species[1].meshes[3]);
  CHECK(read.species[1].edges == family->species[1].edges);
}

TEST_CASE("folders that are no family are refused, with the file's name") {
  const auto family = zoo();
  const npt::Species& cat = family->species[0];
  const auto refused = [](const char* says, const std::function<void(const scratch::Folder&)>& make) {
    const scratch::Folder folder;
    make(folder);
    const std::string message = scratch::error_of([&] { npt::load_family(folder.path()); });
    INFO("wanted: ", says, ", found: ", message);
    CHECK(message.find(says) != std::string::npos);
  };
  refused("found no species", [](const scratch::Folder&) {});
  refused("metadata labels: found nothing",
          [&](const scratch::Folder& f) { write_species(f / "cat.safetensors", cat, {}); });
  refused("found 2 labels, expected 4", [&](const scratch::Folder& f) {
    write_species(f / "cat.safetensors", cat, {{"labels", "a b"}});
  });
  refused("cat.safetensors: found no tensor 'poses'",
          [](const scratch::Folder& f) { npt::write_safetensors(f / "cat.safetensors", {}, {}); });
  refused("found vertex 99", [&](const scratch::Folder& f) {
    npt::Species bad = cat;
    bad.triangles[0][0] = 99;
    write_species(f / "cat.safetensors", bad, {{"labels", "a b c d"}});
  });
  refused("label 'a' for a second mesh", [&](const scratch::Folder& f) {
    write_species(f / "cat.safetensors", cat, {{"labels", "a b c A"}});
  });
  refused("b.ply: found 15 vertices, expected 12, as 'a' has", [&](const scratch::Folder& f) {
    fs::create_directory(f / "cat");
    write_mesh(f / "cat/a.ply", cat, 0);
    write_mesh(f / "cat/b.ply", family->species[1], 0);
  });
  refused("b.ply: found other faces", [&](const scratch::Folder& f) {
    fs::create_directory(f / "cat");
    write_mesh(f / "cat/a.ply", cat, 0);
    npt::Species other = cat;
    std::swap(other.triangles[0], other.triangles[1]);
    write_mesh(f / "cat/b.ply", other, 1);
  });
  CHECK(scratch::error_of([] { npt::load_family("nowhere/at/all"); }).find("nowhere/at/all") != std::string::npos);
}

TEST_CASE("the animals, where they are" * support::needs_shared("data/animals")) {
  const fs::path folder = fs::path(NPT_SHARED) / "data/animals";
  const auto family = std::make_shared<const npt::Family>(npt::load_family(folder));
  CHECK(family->species.size() == 7);
  const npt::FamilySampler sampler(family, {"Walk"}, {});
  const npt::Sample sample = sampler.draw(0, 0);
  CHECK(sample.vertex_count() > 900);
  CHECK(npt::family_pairs(family, {"Walk"}).count == 7 * 6 * 6);
}
