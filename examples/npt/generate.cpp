/// npt generate: meshes of a body in random or given shapes and poses.
#include "arguments.hpp"
#include "interrupt.hpp"
#include "pose_option.hpp"
#include "progress.hpp"
#include "subcommand.hpp"

#include <npt/base/random.hpp>
#include <npt/body/body_file.hpp>
#include <npt/body/body_kind.hpp>
#include <npt/body/body_model.hpp>
#include <npt/body/kind_file.hpp>
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/plan_poses.hpp>
#include <npt/body/plan_proportions.hpp>
#include <npt/body/pose_sampler.hpp>
#include <npt/body/proportions.hpp>
#include <npt/io/mesh_file.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/lab/clothes.hpp>
#include <npt/mesh/permute.hpp>

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace generate_command {

namespace fs = std::filesystem;

struct Options {
  fs::path out;
  std::optional<fs::path> body;
  std::uint64_t seed = 0;
  std::optional<std::uint64_t> shape_seed, pose_seed;
  std::uint32_t count = 1;
  std::string shape = "random", pose = "random";
  std::optional<std::string> format;
  bool shuffle = false, same_shape = false, same_pose = false, proportions = false, clothes = false;
};

bool is_random(const std::string& pose) { return pose == "random" || pose == "wide" || pose == "natural"; }

/// Another kind of body than people, where weights hold one, and its table of random poses.
struct Kind {
  std::shared_ptr<const npt::BodyKind> body;
  std::optional<npt::PlanPoses> poses{};
};
Kind kind_of(const Options& o) {
  if (!o.body) return {};
  const npt::SafetensorsFile file = npt::SafetensorsFile::read(*o.body);
  Kind kind{npt::load_body_kind(file)};
  const std::string* table = file.find_metadata("body/poses");
  if (kind.body != nullptr && table != nullptr)
    kind.poses.emplace(kind.body->plan, *table, file.name() + ", metadata body/poses");
  return kind;
}

/// With proportions and clothes where they are wanted; the library asks for SMPL's joints then. Another kind's has its
/// plan's proportions among its shapes.
npt::BodyModel body_of(const Options& o, const Kind& kind) {
  if (kind.body != nullptr) return o.clothes ? npt::with_clothes(*kind.body->body) : *kind.body->body;
  npt::BodyModel body = o.body ? npt::load_body(*o.body) : npt::mannequin();
  if (o.proportions) body = npt::with_proportions(body);
  return o.clothes ? npt::with_clothes(body) : body;
}

/// Independent streams of one seed: mesh i draws its shape, pose and vertex order from streams of its own, so that it
/// is the same mesh whatever else is made.
enum class Draw : std::uint64_t { shape, pose, order };
npt::Random random_for(std::uint64_t seed, std::uint64_t mesh, Draw draw) {
  return npt::Random(seed, 4 * mesh + static_cast<std::uint64_t>(draw));
}

class Generator {
 public:
  explicit Generator(const Options& options)
      : options_(options),
        kind_(kind_of(options)),
        body_(body_of(options, kind_)),
        own_shapes_(body_.shape_count() - (options.proportions ? proportion_count() : 0)) {
    if (options_.shape != "random" && options_.shape != "zero") {
      given_shape_ = program::parse_numbers(options_.shape, "--shape");
      if (given_shape_.size() > own_shapes_)
        throw npt::Error({"--shape",
                          {},
                          std::to_string(given_shape_.size()) + " numbers",
                          "random, zero, or at most " + std::to_string(own_shapes_) + " numbers"});
    }
    if (!is_random(options_.pose) && options_.pose != "rest") read_pose();
    if (is_random(options_.pose) && !draws_poses())
      throw npt::Error({"--pose",
                        {},
                        "random poses for a body of " + std::to_string(body_.joint_count()) + " joints",
                        std::to_string(npt::smpl_joint_count) +
                            " joints, or --pose rest or a file; random and natural for weights with such poses"});
  }

  npt::Mesh make(std::uint64_t index) const {
    const std::uint64_t of_shape = options_.same_shape ? 0 : index, of_pose = options_.same_pose ? 0 : index;
    const std::uint64_t shape_seed = options_.shape_seed.value_or(options_.seed);
    npt::Mesh mesh =
        npt::to_mesh(body_, shape(shape_seed, of_shape), pose(options_.pose_seed.value_or(options_.seed), of_pose));
    if (!options_.shuffle) return mesh;
    // The order belongs to the shape, as its vertex numbers belong to a scan: an identity and its truth share it.
    npt::Random random = random_for(shape_seed, of_shape, Draw::order);
    return npt::permute_vertices(mesh,
                                 npt::random_permutation(static_cast<std::uint32_t>(mesh.vertex_count()), random));
  }

 private:
  std::size_t proportion_count() const {
    return kind_.body == nullptr ? npt::body_proportion_count : kind_.body->plan.proportions.size();
  }
  /// Whether there are poses as the option asks for.
  bool draws_poses() const {
    if (kind_.body == nullptr) return body_.joint_count() == npt::smpl_joint_count;
    return (options_.pose == "random" && kind_.poses) || (options_.pose == "natural" && !kind_.body->poses.empty());
  }
  void read_pose() {
    given_pose_ = program::parse_numbers(npt::read_file(options_.pose), options_.pose);
    if (given_pose_.size() != 3 * body_.joint_count())
      throw npt::Error({options_.pose,
                        {},
                        std::to_string(given_pose_.size()) + " numbers",
                        std::to_string(3 * body_.joint_count()) + ", an axis angle in radians for each joint"});
  }
  std::vector<float> shape(std::uint64_t seed, std::uint64_t index) const {
    npt::Random random = random_for(seed, index, Draw::shape);
    std::vector<float> betas = options_.shape == "random" ? npt::sample_shape(random, own_shapes_) : given_shape_;
    if (!options_.proportions) return betas;
    betas.resize(own_shapes_);
    if (kind_.body != nullptr) {
      for (const float p : npt::sample_character(kind_.body->plan, random, 0)) betas.push_back(p);
      return betas;
    }
    for (const double p : npt::sample_proportions(random)) betas.push_back(static_cast<float>(p));
    return betas;
  }
  /// Empty: the rest pose.
  std::vector<float> pose(std::uint64_t seed, std::uint64_t index) const {
    if (!is_random(options_.pose)) return given_pose_;
    npt::Random random = random_for(seed, index, Draw::pose);
    if (kind_.body != nullptr && options_.pose == "random") return kind_.poses->sample(random);
    if (kind_.body != nullptr)
      return kind_.body->poses[random.below(static_cast<std::uint32_t>(kind_.body->poses.size()))];
    const auto angles = npt::sample_pose(random, program::pose_distribution(options_.pose));
    return {angles.begin(), angles.end()};
  }

  const Options& options_;
  Kind kind_;
  npt::BodyModel body_;
  std::size_t own_shapes_;  ///< shape parameters without proportions
  std::vector<float> given_shape_, given_pose_;
};

/// Where the meshes go: the named file, or body_0000.ply and so on in the named folder.
std::vector<fs::path> output_files(const Options& options) {
  static constexpr std::array<std::string_view, 3> extensions{".ply", ".obj", ".glb"};
  const std::string extension = program::extension_of(options.out);
  std::error_code code;
  if (std::ranges::find(extensions, extension) != extensions.end() && !fs::is_directory(options.out, code)) {
    if (options.count != 1)
      throw npt::Error(
          {options.out.string(), {}, "a file for " + std::to_string(options.count) + " meshes", "a folder"});
    if (options.format && "." + *options.format != extension)
      throw npt::Error({options.out.string(), {}, "--format " + *options.format, "the format of the file's extension"});
    return {options.out};
  }
  program::expect_folder_name(options.out, ".ply, .obj or .glb, or a folder");
  std::vector<fs::path> files;
  for (std::uint32_t i = 0; i < options.count; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "body_%04u.", i);
    files.push_back(options.out / (name + options.format.value_or("ply")));
  }
  return files;
}

void run(const Options& options) {
  const std::vector<fs::path> files = output_files(options);
  const Generator generator(options);
  std::optional<program::OutputFolder> folder;
  if (files.front() != options.out) folder.emplace(options.out);
  std::vector<fs::path> inputs;
  if (options.body) inputs.push_back(*options.body);
  for (const fs::path& file : files) program::check_output(file, inputs);
  program::catch_interrupts();
  std::size_t vertices = 0;
  {
    program::Progress progress("meshes", files.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
      program::stop_if_interrupted();
      const npt::Mesh mesh = generator.make(i);
      npt::write_mesh(files[i], mesh);
      vertices = mesh.vertex_count();
      progress.advance();
    }
  }
  std::cout << options.out.string() << ": " << files.size() << (files.size() == 1 ? " mesh of " : " meshes of ")
            << vertices << " vertices\n";
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command
      .add_option("-o,--out", o->out, "Write the mesh to this file (.ply, .obj, .glb), or the meshes to this folder")
      ->required();
  command.add_option("--count", o->count, "Make this many meshes")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command.add_option("--body", o->body,
                     "Make them of this body model (.safetensors, SMPL's layout), or of the kind of body that weights "
                     "hold, such as quadruped.safetensors (default: the built-in mannequin)");
  command
      .add_option("--shape", o->shape,
                  "Give them random shapes, the mean one (zero), or these shape parameters: \"b0,b1,...\"")
      ->capture_default_str();
  command
      .add_option(
          "--pose", o->pose,
          "Give them random poses in the paper's ranges (random, its Table 6) or wider ones (wide), natural poses in "
          "any direction (natural; another kind of body knows random and natural), the rest pose (rest), or that of a "
          "file with an axis angle for each joint")
      ->capture_default_str();
  command.add_flag("--proportions", o->proportions, "Draw proportions as characters have: heads, limbs, girths");
  command.add_flag("--clothes", o->clothes, "Add a shirt, shorts, shoes and hair, each a separate component");
  command.add_option("--seed", o->seed, "Draw shapes, poses and vertex orders from this seed")
      ->check(program::whole_number())
      ->capture_default_str();
  command.add_option("--shape-seed", o->shape_seed, "Draw shapes and vertex orders from this seed (default: --seed)")
      ->check(program::whole_number());
  command.add_option("--pose-seed", o->pose_seed, "Draw poses from this seed (default: --seed)")
      ->check(program::whole_number());
  command.add_flag("--same-shape", o->same_shape, "Give all meshes the first one's shape");
  command.add_flag("--same-pose", o->same_pose, "Give all meshes the first one's pose");
  command.add_flag("--shuffle", o->shuffle, "Put vertices into random order, one order for each shape");
  command.add_option("--format", o->format, "Write the meshes of a folder in this format (default: ply)")
      ->check(CLI::IsMember({"ply", "obj"}));
  command.footer(
      "An identity, a pose and the ground truth to compare the result with:\n"
      "  npt generate --shape-seed 1 --pose-seed 1 --out identity.ply\n"
      "  npt generate --shape-seed 2 --pose-seed 2 --out pose.ply\n"
      "  npt generate --shape-seed 1 --pose-seed 2 --out truth.ply");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("generate", "Make meshes of a body model in random or given shapes and poses",
                                     add);

}  // namespace generate_command
