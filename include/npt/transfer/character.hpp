/// An identity mesh that takes many poses: what depends on it alone is computed once, and can be saved.
///   npt::Character hero = transfer.character(mesh);
///   if (!hero.recognised()) puts("no person");
///   hero.save("hero.npt");   ...   npt::Character again = transfer.load_character("hero.npt");
/// Threads   any number may use one at a time
#pragma once

#include <npt/base/affine.hpp>
#include <npt/base/error.hpp>
#include <npt/body/joint_pose.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/scene/skinned_skeleton.hpp>
#include <npt/transfer/body_domain.hpp>
#include <npt/transfer/network_state.hpp>
#include <npt/transfer/refinement.hpp>
#include <npt/transfer/result_measures.hpp>
#include <npt/transfer/warning.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
class BasicPoseTransfer;

namespace transfer::internal {

/// What a Character and a Pose have in common: whose they are, and what was estimated.
struct Prepared {
  std::shared_ptr<const std::string> owner;  ///< of the transfer that made it; none: empty
  std::size_t domain = 0;                    ///< number of the domain that recognised it, or of the default one
  std::string domain_name;
  std::string name;  ///< what the mesh is called in messages
  std::shared_ptr<const BodyDomain> body;
  std::shared_ptr<const DomainEstimate> estimate;
  bool recognised = false;
  const KindWords* kind = nullptr;  ///< what the domain recognises; none: nothing
  std::string looked_for;           ///< by all domains: "a person (confidence 3 %), nor as a four-legged animal (1 %)"
  Warnings by_body, by_network;     ///< what is to be said of the mesh where a result is made by the one or the other

  /// Whether a body was estimated in vain.
  bool refused() const noexcept { return estimate != nullptr && body != nullptr && !recognised; }
  double confidence() const noexcept { return estimate == nullptr ? 0 : estimate->confidence; }
  std::string_view recognised_kind() const noexcept { return recognised && kind ? kind->one : std::string_view(); }
  std::string kind_expected() const {
    const KindWords words = kind == nullptr ? KindWords{} : *kind;
    return with_article(words.one) + ", whole, with head, " + words.upper_limb + "s and " + words.lower_limb + "s";
  }
  void expect_recognised() const {
    if (recognised) return;
    throw Error({.file = name,
                 .found = estimate == nullptr ? "a mesh of which no body was estimated"
                                              : "a mesh that is not recognised as " + looked_for,
                 .expected = kind_expected(),
                 .code = ErrorCode::not_recognised,
                 .remedy = Remedy::choose_method});
  }
};

}  // namespace transfer::internal

/// What a Character or a Pose was recognised as.
class Recognition {
 public:
  /// Of the weights that recognised it, or that take it: "human"; empty where the weights name none.
  const std::string& domain() const noexcept { return own_.domain_name; }
  /// Whether its confidence is high enough for body estimation.
  bool recognised() const noexcept { return own_.recognised; }
  /// What it is recognised as: "person", "four-legged animal"; empty where it isn't. As long as the program runs.
  std::string_view kind() const noexcept { return own_.recognised_kind(); }
  /// Errors    npt::Error (not_recognised) that says how low the confidence is, where it isn't recognised
  void expect_recognised() const { own_.expect_recognised(); }
  /// That it is of the domain, and that its pose was estimated rightly: 0 to 1; none where no body was estimated.
  std::optional<double> confidence() const {
    return own_.estimate == nullptr ? std::nullopt : std::optional(own_.estimate->confidence);
  }
  /// What a user should know of it.
  const Warnings& warnings() const noexcept { return own_.recognised ? own_.by_body : own_.by_network; }

 protected:
  transfer::internal::Prepared own_;
};

NPT_INLINE_CLASS(class, Character);
template <class>
class BasicCharacter : public Recognition {
 public:
  /// V, of the mesh and of results; 0: nothing prepared yet.
  std::size_t vertex_count() const noexcept { return xyz_.size() / 3; }
  /// Metres in one unit of the mesh's coordinates, where the network asks for one; else 1.
  double unit() const noexcept { return network_.unit; }
  /// The mesh's positions [V, 3] and triangles.
  std::span<const float> positions() const noexcept { return as_span(xyz_); }
  std::span<const Triangle> triangles() const noexcept { return as_span(triangles_); }

  /// Its joints, where a body was estimated.
  std::optional<JointPose> joints() const {
    if (binding_ == nullptr) return std::nullopt;
    return own_.body->joints(*own_.estimate);
  }
  /// What moves it: skeleton and skin weights, in its own unit, place and pose. None where no body was estimated, and
  /// where results are refined, which no skeleton can say.
  std::optional<SkinnedSkeleton> skeleton() const {
    if (binding_ == nullptr || refinement_ != nullptr) return std::nullopt;
    return own_.body->skeleton(*binding_);
  }
  /// How the skeleton's joints move to the body's rest (BodyDomain::rest_motions); empty where there is no skeleton.
  std::vector<Affine> rest_motions() const {
    return binding_ == nullptr ? std::vector<Affine>() : own_.body->rest_motions(*binding_);
  }

  /// Writes it to a safetensors file: positions, triangles, estimate, joints and skin weights. Faces of more corners,
  /// UVs and materials are not in it.
  /// Errors    npt::Error for a file that can't be written, and for a character that isn't prepared or recognised
  void save(const std::filesystem::path& file) const;

 private:
  template <class>
  friend class BasicPoseTransfer;

  std::shared_ptr<const DomainBinding> binding_;  ///< where it is recognised
  NetworkIdentity network_;
  std::optional<ErrorParts> network_refusal_;  ///< why the network can't have it, where it can't
  std::shared_ptr<const Refinement> refinement_;
  std::shared_ptr<const ResultMeter> meter_;  ///< where results are measured
  std::shared_ptr<const Mesh> mesh_;          ///< with all that faces carry, where it was given as one
  std::vector<float> xyz_;
  std::vector<Triangle> triangles_;
};

}  // namespace npt::inline NPT_ABI
