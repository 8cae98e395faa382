#include "reproduce/figure_meshes.hpp"

#include "reproduce/systems.hpp"

#include <npt/base/error.hpp>
#include <npt/base/random.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/io/file.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/lab/augmentation.hpp>
#include <npt/lab/family.hpp>
#include <npt/lab/family_file.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/mesh/permute.hpp>
#include <npt/mesh/validate.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

namespace reproduce {

namespace fs = std::filesystem;

namespace {

/// Seeds of what is random in figures.
constexpr std::uint64_t noise_seed = 20200330, order_seed = 20200331, mannequin_seed = 20200332, family_seed = 20200333;

/// As many as figure 14 has rows.
constexpr std::size_t most_held_out = 4;

/// The mannequins that stand for meshes of other makers.
constexpr std::size_t mannequin_count = 3;

bool is_there(const fs::path& path) {
  std::error_code code;
  return fs::is_regular_file(path, code);
}

/// Fowler, Noll and Vo's hash, FNV-1a: to tell files apart, not to keep secrets.
std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

std::string digits_of(std::uint64_t hash) {
  char text[16];
  std::snprintf(text, sizeof text, "%08x", static_cast<unsigned>(hash ^ (hash >> 32)));
  return text;
}

std::string two_digits(std::size_t i) { return (i < 10 ? "0" : "") + std::to_string(i); }
std::string name_of(PairSet set, std::size_t i) { return (set == PairSet::seen ? "seen" : "unseen") + two_digits(i); }

/// What any file system and the list of pairs of `npt transfer` take.
std::string plain(std::string text) {
  for (char& c : text) {
    const bool good =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
    if (!good) c = '_';
  }
  return text;
}

npt::Mesh mesh_of(const std::vector<float>& xyz, const std::vector<npt::Triangle>& triangles) {
  npt::Mesh mesh;
  mesh.positions.resize(xyz.size() / 3);
  std::ranges::copy(xyz, mesh.coordinates().begin());
  npt::set_faces(mesh, triangles);
  return mesh;
}

double height_of(const npt::Mesh& mesh) {
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  for (const npt::Vec3f p : mesh.positions) low = std::min(low, p.y), high = std::max(high, p.y);
  return static_cast<double>(high) - static_cast<double>(low);
}

/// In the list of pairs of `npt transfer`, whose names are relative to the list.
std::string quoted(const fs::path& path) {
  const std::string text = fs::absolute(path).string();
  const char mark = text.find('"') == std::string::npos ? '"' : '\'';
  return mark + text + mark;
}

}  // namespace

std::string content_hash(const fs::path& path) { return digits_of(fnv1a(npt::read_file(path))); }

MeshStore::MeshStore(FigureSources sources, const fs::path& folder, RunCommand run)
    : sources_(std::move(sources)), run_(std::move(run)) {
  const bool built_in = sources_.body == "mannequin";
  const fs::path file = sources_.body;
  folder_ = fs::absolute(folder) / (built_in ? "mannequin" : plain(file.stem().string()) + "-" + content_hash(file));
  bodies_ = folder_ / "bodies";
  fs::create_directories(bodies_);
  for (const std::string& name : sources_.identities) identities_.push_back(imported(name));
  for (const std::string& name : sources_.poses) poses_.push_back(imported(name));
  if (identities_.empty()) identities_ = mannequins(false);
  if (poses_.empty()) poses_ = mannequins(true);
}

const npt::BodyModel& MeshStore::body() {
  if (!body_)
    body_ = sources_.body == "mannequin" ? npt::borrowed(npt::mannequin())
                                         : std::make_shared<const npt::BodyModel>(npt::load_body(sources_.body));
  return *body_;
}

const npt::BodyPair& MeshStore::pair(PairSet set, std::size_t i) {
  std::vector<npt::BodyPair>& list = pairs_[set];
  if (list.empty())
    list = set == PairSet::seen ? npt::seen_pose_pairs(body().shape_count())
                                : npt::unseen_pose_pairs(body().shape_count());
  return list.at(i);
}

MeshFile MeshStore::place(const std::string& name, const std::string& shape) const {
  return {bodies_ / (name + ".ply"), name, shape};
}

MeshFile MeshStore::body_mesh(const std::string& name, const std::string& shape, std::span<const float> betas,
                              std::span<const float> pose) {
  MeshFile file = place(name, shape);
  shapes_[shape].assign(betas.begin(), betas.end());
  if (!is_there(file.path)) npt::write_mesh(file.path, npt::to_mesh(body(), betas, pose));
  return file;
}

MeshFile MeshStore::identity(PairSet set, std::size_t i) {
  const npt::BodyPair& p = pair(set, i);
  return body_mesh(name_of(set, i) + "-identity", name_of(set, i) + "a", p.identity_shape, p.identity_pose);
}
MeshFile MeshStore::pose(PairSet set, std::size_t i) {
  const npt::BodyPair& p = pair(set, i);
  return body_mesh(name_of(set, i) + "-pose", name_of(set, i) + "b", p.pose_shape, p.pose);
}
MeshFile MeshStore::truth(PairSet set, std::size_t i) {
  const npt::BodyPair& p = pair(set, i);
  return body_mesh(name_of(set, i) + "-truth", name_of(set, i) + "a", p.identity_shape, p.pose);
}
MeshFile MeshStore::pose_of_shape(PairSet set, std::size_t i, std::size_t shape) {
  const auto shapes = npt::data::protocol_shapes(npt::protocol::new_identity_seed, npt::protocol::new_identities,
                                                 body().shape_count(), npt::ShapeDistribution::normal);
  const std::string name = "new" + two_digits(shape);
  return body_mesh(name_of(set, i) + "-pose-" + name, name, shapes.at(shape), pair(set, i).pose);
}

MeshFile MeshStore::rest_of(const MeshFile& mesh) {
  const auto shape = shapes_.find(mesh.shape);
  if (shape == shapes_.end())
    throw npt::Error({.file = mesh.name, .found = "no body", .expected = "one, whose rest mesh is known"});
  const npt::PoseParameters rest{};
  return body_mesh(mesh.shape + "-rest", mesh.shape, std::vector<float>(shape->second), rest);
}

MeshFile MeshStore::with_noise(const MeshFile& mesh, double share) {
  if (share == 0) return mesh;
  char level[32];
  std::snprintf(level, sizeof level, "%04d", static_cast<int>(1e4 * share + 0.5));
  MeshFile noisy = place(mesh.name + "-noise" + level, mesh.shape);
  if (is_there(noisy.path)) return noisy;
  npt::Mesh moved = npt::read_mesh(mesh.path);
  // The same directions at every level: only the length grows.
  npt::Random random(noise_seed);
  npt::data::add_noise(moved.coordinates(), share * height_of(moved), random);
  npt::recompute_normals(moved);
  npt::write_mesh(noisy.path, moved);
  return noisy;
}

MeshFile MeshStore::in_order(const MeshFile& mesh, std::uint64_t order) {
  if (order == 0) return mesh;
  MeshFile shuffled = place(mesh.name + "-order" + std::to_string(order), {});
  if (is_there(shuffled.path)) return shuffled;
  const npt::Mesh own = npt::read_mesh(mesh.path);
  npt::Random random(order_seed, order);
  npt::write_mesh(
      shuffled.path,
      npt::permute_vertices(own, npt::random_permutation(static_cast<std::uint32_t>(own.vertex_count()), random)));
  return shuffled;
}

MeshFile MeshStore::imported(const std::string& file) const {
  const npt::Mesh mesh = npt::read_mesh(file);
  if (mesh.face_count() == 0) throw npt::Error({.file = file, .found = "no faces", .expected = "a surface"});
  const MeshFile own = place(plain(fs::path(file).stem().string()) + "-" + content_hash(file), {});
  if (!is_there(own.path)) npt::write_mesh(own.path, mesh);
  return own;
}

std::vector<MeshFile> MeshStore::mannequins(bool as_poses) const {
  std::vector<MeshFile> files;
  for (std::size_t i = 0; i < mannequin_count; ++i) {
    const MeshFile file = place((as_poses ? "mannequin-pose-" : "mannequin-") + std::to_string(i + 1), {});
    if (!is_there(file.path)) {
      npt::Random random(mannequin_seed, 2 * i + (as_poses ? 1 : 0));
      const std::vector<float> shape = npt::sample_shape(random, npt::mannequin().shape_count());
      npt::write_mesh(file.path, npt::to_mesh(npt::mannequin(), shape, npt::sample_pose(random)));
    }
    files.push_back(file);
  }
  return files;
}

std::vector<MeshStore::FamilyFiles> MeshStore::family_pairs(std::size_t count) {
  auto family = std::make_shared<const npt::Family>(npt::load_family(sources_.family));
  std::string shown;  // what the pairs depend on
  for (const npt::Species& species : family->species) {
    for (const std::string& label : species.labels) shown += species.name + ' ' + label + '\n';
    for (const std::vector<float>& mesh : species.meshes)
      shown.append(reinterpret_cast<const char*>(mesh.data()), mesh.size() * sizeof(float));
  }
  const std::string name = "family-" + digits_of(fnv1a(shown));
  const npt::EvaluationSet set = npt::family_pairs(family, held_out_labels(sources_.family), count, family_seed);
  std::vector<FamilyFiles> list;
  for (std::size_t i = 0; i < std::min(count, set.count); ++i) {
    const npt::EvaluationPair pair = set.pair(i);
    const std::string row = name + "-" + std::to_string(i + 1);
    const FamilyFiles files{place(row + "-identity", {}), place(row + "-pose", {}), place(row + "-truth", {}),
                            pair.name};
    npt::write_mesh(files.identity.path, mesh_of(pair.identity, pair.identity_triangles));
    npt::write_mesh(files.pose.path, mesh_of(pair.pose, pair.pose_triangles));
    npt::write_mesh(files.truth.path, mesh_of(pair.truth, pair.identity_triangles));
    list.push_back(files);
  }
  return list;
}

MeshFile MeshStore::result(const std::string& system, const MeshFile& identity, const MeshFile& pose) {
  std::string name = system;
  if (system_of(system).kind == Kind::network) {
    const auto weights = sources_.weights.find(system);
    if (weights == sources_.weights.end())
      throw npt::Error({.file = system, .found = "no weights", .expected = "trained weights"});
    std::string& hash = hashes_[system];
    if (hash.empty()) hash = content_hash(weights->second);
    name += "-" + hash;
  }
  const fs::path folder = folder_ / name;
  fs::create_directories(folder);
  const std::string own = identity.name + "--" + pose.name;
  MeshFile file{folder / (own + ".ply"), own, {}};
  const bool asked = std::ranges::any_of(pending_, [&](const Pending& p) { return p.out == file.path; });
  if (!asked && !is_there(file.path)) pending_.push_back({system, identity, pose, file.path});
  return file;
}

void MeshStore::make_results() {
  run_networks();
  for (const Pending& job : pending_) {
    const System& system = system_of(job.system);
    if (system.kind == Kind::deformation) run_deformation(job, system.arguments.back());
    if (system.kind == Kind::skeleton) run_skeleton(job);
  }
  pending_.clear();
}

/// All that a network, or body estimation by the shipped weights, has to do at once: weights are read and packed once.
void MeshStore::run_networks() {
  for (const System& system : systems()) {
    if (system.kind != Kind::network && system.kind != Kind::bodies) continue;
    std::string list;
    for (const Pending& job : pending_)
      if (job.system == system.id)
        list += quoted(job.identity.path) + ' ' + quoted(job.pose.path) + ' ' + quoted(job.out) + '\n';
    if (list.empty()) continue;
    const fs::path file = folder_ / "pairs.txt";
    npt::write_file(file, list);
    std::vector<std::string> arguments{"transfer", "--pairs", file.string()};
    if (system.kind == Kind::network)
      arguments.insert(arguments.end(), {"--method", "network", "--weights", sources_.weights.at(system.id).string()});
    run_(arguments);
    fs::remove(file);
  }
}

void MeshStore::run_deformation(const Pending& job, const std::string& control_points) {
  std::vector<std::string> arguments{"deform",
                                     "--source",
                                     rest_of(job.pose).path.string(),
                                     "--pose",
                                     job.pose.path.string(),
                                     "--target",
                                     rest_of(job.identity).path.string(),
                                     "--control-points",
                                     control_points,
                                     "--out",
                                     job.out.string()};
  if (sources_.body != "mannequin")
    arguments.insert(arguments.end(), {"--source-body", sources_.body, "--target-body", sources_.body});
  run_(arguments);
}

void MeshStore::run_skeleton(const Pending& job) {
  std::vector<std::string> arguments{"skeleton",      "--identity",           job.identity.path.string(),
                                     "--pose",        job.pose.path.string(), "--out",
                                     job.out.string()};
  if (sources_.body != "mannequin") arguments.insert(arguments.end(), {"--body", sources_.body});
  run_(arguments);
}

std::vector<std::string> held_out_labels(const std::string& family) {
  const npt::Family list = npt::load_family(family);
  std::set<std::string> shared;
  for (const npt::Species& species : list.species) {
    std::set<std::string> own;
    for (const std::string& label : species.labels) own.insert(npt::lower_case(label));
    if (&species == &list.species.front()) {
      shared = own;
    } else {
      std::erase_if(shared, [&](const std::string& label) { return !own.contains(label); });
    }
  }
  std::vector<std::string> labels(shared.begin(), shared.end()), held_out;
  if (labels.size() < 2) return {};
  const std::size_t count = std::min(most_held_out, labels.size() / 2);
  for (std::size_t i = 0; i < count; ++i) held_out.push_back(labels[(2 * i + 1) * labels.size() / (2 * count)]);
  return held_out;
}

std::vector<std::string> family_training_arguments(const std::string& family) {
  const npt::Family list = npt::load_family(family);
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const npt::Species& species : list.species) least = std::min(least, species.vertex_count());
  std::vector<std::string> arguments{"--family", family, "--blend", "0.5", "--mirror"};
  for (const std::string& label : held_out_labels(family)) arguments.insert(arguments.end(), {"--held-out", label});
  for (const auto& [begin, batch, vertices] :
       {std::tuple{"0", 24, std::size_t{240}}, std::tuple{"0.6", 12, std::size_t{600}}})
    arguments.insert(arguments.end(), {"--stage", begin + std::string(":") + std::to_string(batch) + "x" +
                                                      std::to_string(std::min(vertices, least))});
  return arguments;
}

}  // namespace reproduce
