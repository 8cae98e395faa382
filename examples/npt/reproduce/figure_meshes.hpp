/// The meshes that figures show, as files: bodies of the protocol's test pairs, the same with noise or in other vertex
/// orders, meshes that were brought along, and what each system makes of them, by the program's own commands. A file's
/// name says what it was made from, weights and given meshes by a hash of their contents, so that what is there needs
/// not be made again.
#pragma once

#include <npt/body/body_model.hpp>
#include <npt/lab/protocol.hpp>
#include <npt/mesh/mesh.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace reproduce {

/// What figures are made from.
struct FigureSources {
  std::string body = "mannequin";                        ///< or a file
  std::map<std::string, std::filesystem::path> weights;  ///< of the networks, by system
  std::vector<std::string> identities, poses;            ///< meshes of other makers, in metres; none: the mannequin's
  std::string family;                                    ///< folder of species with labelled poses; empty: none
  int panel_height = 420;                                ///< pixels
};

/// Runs the program with these arguments. Errors: npt::Error if that fails.
using RunCommand = std::function<void(const std::vector<std::string>& arguments)>;

/// The two sets of the protocol's test pairs.
enum class PairSet { seen, unseen };

struct MeshFile {
  std::filesystem::path path;
  std::string name;   ///< says what it is: "seen04-pose"
  std::string shape;  ///< of a body: names the shape, whose rest mesh deformation transfer needs
};

/// Of a file's contents, 8 hexadecimal digits.
std::string content_hash(const std::filesystem::path& path);

class MeshStore {
 public:
  /// `folder` is made. Errors  npt::Error for a body or a given mesh that can't be read
  MeshStore(FigureSources sources, const std::filesystem::path& folder, RunCommand run);

  const FigureSources& sources() const { return sources_; }

  /// Pair `i` of a set, i < 72: vertices are in the body's order.
  MeshFile identity(PairSet set, std::size_t i);
  MeshFile pose(PairSet set, std::size_t i);
  MeshFile truth(PairSet set, std::size_t i);
  /// Another of the protocol's new identities, `shape` < 14, in the pose of a pair.
  MeshFile pose_of_shape(PairSet set, std::size_t i, std::size_t shape);

  /// The same with normal noise on every coordinate; `share` of the mesh's height is its standard deviation.
  MeshFile with_noise(const MeshFile& mesh, double share);
  /// The same surface with its vertices in a random order; 0: as they are.
  MeshFile in_order(const MeshFile& mesh, std::uint64_t order);

  /// Meshes of other makers.
  std::span<const MeshFile> foreign_identities() const { return identities_; }
  std::span<const MeshFile> foreign_poses() const { return poses_; }

  /// Pair `i` of the family in labels that training with held_out_labels() doesn't show.
  struct FamilyFiles {
    MeshFile identity, pose, truth;
    std::string name;  ///< "Horse Walk_00 as Cow Gallop_03"
  };
  std::vector<FamilyFiles> family_pairs(std::size_t count);

  /// What a system makes of a pair. The file is there after the next make_results().
  MeshFile result(const std::string& system, const MeshFile& identity, const MeshFile& pose);
  /// Runs the commands that make the results asked for.
  void make_results();
  /// Drops what was asked for and not made.
  void forget_requests() { pending_.clear(); }

 private:
  struct Pending {
    std::string system;
    MeshFile identity, pose;
    std::filesystem::path out;
  };

  const npt::BodyModel& body();
  const npt::BodyPair& pair(PairSet set, std::size_t i);
  MeshFile place(const std::string& name, const std::string& shape) const;
  MeshFile body_mesh(const std::string& name, const std::string& shape, std::span<const float> betas,
                     std::span<const float> pose);
  MeshFile rest_of(const MeshFile& mesh);
  MeshFile imported(const std::string& file) const;
  std::vector<MeshFile> mannequins(bool as_poses) const;
  void run_networks();
  void run_deformation(const Pending& job, const std::string& control_points);
  void run_skeleton(const Pending& job);

  FigureSources sources_;
  std::filesystem::path folder_, bodies_;
  RunCommand run_;
  std::shared_ptr<const npt::BodyModel> body_;
  std::map<PairSet, std::vector<npt::BodyPair>> pairs_;
  std::map<std::string, std::vector<float>> shapes_;  ///< by name
  std::map<std::string, std::string> hashes_;         ///< of weights, by system
  std::vector<MeshFile> identities_, poses_;
  std::vector<Pending> pending_;
};

/// Labels that a network trained on the family is not shown, so that figure 14 can show them: four that all species
/// share, or as many as there are; none if the species share fewer than two.
std::vector<std::string> held_out_labels(const std::string& family);

/// The arguments of `npt train` that say what to train on for figure 14.
/// Errors  npt::Error for a folder without a family
std::vector<std::string> family_training_arguments(const std::string& family);

}  // namespace reproduce
