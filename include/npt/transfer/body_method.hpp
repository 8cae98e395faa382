/// The way through bodies for npt::PoseTransfer: TransferOptions{.body = npt::body_method}.
/// Programs that link the library's prebuilt units (NPT_PREBUILT, config.hpp) only see its declaration.
#pragma once

#include <npt/config.hpp>
#include <npt/transfer/body_interface.hpp>

#if !defined(NPT_PREBUILT) || defined(NPT_PREBUILDING)
#include <npt/base/default_executor.hpp>
#include <npt/base/executor.hpp>
#include <npt/estimate/body_estimate.hpp>
#include <npt/estimate/correspondence_estimator.hpp>
#include <npt/estimate/fit_bias.hpp>
#include <npt/estimate/rest_posture.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/skin/bound_character.hpp>
#include <npt/transfer/body_transfer.hpp>
#include <npt/transfer/network_correction.hpp>
#endif

#include <filesystem>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

#if !defined(NPT_PREBUILT) || defined(NPT_PREBUILDING)

namespace skeleton::internal {

class ReadBody final : public BodyRead {
 public:
  explicit ReadBody(BodyEstimate body) : reading(std::move(body)) {
    confidence = reading.confidence();
    notes = reading.notes();
  }
  BodyEstimate reading;
};

class BoundBody final : public BodyBinding {
 public:
  explicit BoundBody(BoundCharacter bound) : character(std::move(bound)) {}
  BoundCharacter character;
};

class TransferByBodies final : public BodyMethod {
 public:
  TransferByBodies(const SafetensorsFile& reader, int threads)
      : transfer_(CorrespondenceEstimator(reader, DefaultExecutor(threads))) {
    if (const SafetensorsFile bias = reader.part("fit_bias/"); !bias.tensors().empty())
      bias_ = std::make_unique<const FitBias>(bias);
    const SafetensorsFile network = reader.part("second_opinion/");
    if (!network.tensors().empty())
      correction_ = std::make_unique<const NetworkCorrection>(network, DefaultExecutor(1));
  }

  std::shared_ptr<const BodyRead> read(const MeshView& mesh) const override {
    return std::make_shared<const ReadBody>(transfer_.read(mesh));
  }
  std::shared_ptr<const BodyRead> follow(const MeshView& frame, const BodyRead& last) const override {
    return std::make_shared<const ReadBody>(transfer_.follow(frame, static_cast<const ReadBody&>(last).reading));
  }
  std::shared_ptr<const BodyBinding> bind(const MeshView& identity, const BodyRead& read) const override {
    return std::make_shared<const BoundBody>(transfer_.bind(identity, static_cast<const ReadBody&>(read).reading));
  }
  void pose(const BodyBinding& identity, const BodyRead& pose, std::span<float> result) const override {
    transfer_.pose(static_cast<const BoundBody&>(identity).character, angles(identity, pose), result);
  }
  JointPose joints(const BodyRead& read) const override {
    return transfer_.joints(static_cast<const ReadBody&>(read).reading);
  }
  SkinnedSkeleton skeleton(const BodyBinding& identity) const override {
    return transfer_.skeleton(static_cast<const BoundBody&>(identity).character);
  }
  std::vector<Affine> motions(const BodyBinding& identity, const BodyRead& pose) const override {
    return transfer_.motions(static_cast<const BoundBody&>(identity).character, angles(identity, pose));
  }

 private:
  /// The joint angles that the identity takes.
  std::vector<float> angles(const BodyBinding& identity, const BodyRead& pose) const {
    const BodyEstimate& reading = static_cast<const ReadBody&>(pose).reading;
    expect_body(reading, "pose");
    const BoundCharacter& character = static_cast<const BoundBody&>(identity).character;
    std::vector<float> result =
        bias_ == nullptr ? reading.fit.body.axis_angles : bias_->angles(character.reading, reading);
    result = character.angles(result, reading);
    if (correction_ != nullptr)
      result = correction_->angles(transfer_.fingered_body(), character, reading, std::move(result));
    return from_own_rest(character.reading, result);
  }

  BodyTransfer transfer_;
  std::unique_ptr<const FitBias> bias_;  ///< these two where the reader's file holds them
  std::unique_ptr<const NetworkCorrection> correction_;
};

inline std::shared_ptr<const BodyMethod> open_body_method(const std::filesystem::path& reader, int threads) {
  if constexpr (std::is_same_v<DefaultExecutor, SerialExecutor>) threads = 1;
  return std::make_shared<const TransferByBodies>(SafetensorsFile::read(reader), threads);
}

}  // namespace skeleton::internal

#endif

/// Opens the way through bodies: a reader's weights (.safetensors), the mannequin with proportions.
/// Errors    npt::Error for weights that are missing, broken, or another network's
#ifdef NPT_PREBUILT
std::shared_ptr<const BodyMethod> body_method(const std::filesystem::path& reader, int threads);
#else
inline std::shared_ptr<const BodyMethod> body_method(const std::filesystem::path& reader, int threads) {
  return skeleton::internal::open_body_method(reader, threads);
}
#endif

}  // namespace npt::inline NPT_ABI
