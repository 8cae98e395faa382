/// The entry point of the library, whole: what stands between meshes and networks behind pose_transfer_class.hpp.
#pragma once

#include <npt/base/aligned.hpp>
#include <npt/base/as_span.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/config.hpp>
#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/io/tensor_values.hpp>
#include <npt/mesh/normals.hpp>
#include <npt/nets/network_list.hpp>
#include <npt/nn/engine/core.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/late_domain.hpp>
#include <npt/transfer/mesh_checks.hpp>
#include <npt/transfer/network_transfer.hpp>
#include <npt/transfer/pose_transfer_class.hpp>
#include <npt/transfer/refinement.hpp>
#include <npt/transfer/result_meter.hpp>
#ifndef NPT_COMPILED
#include <npt/transfer/open_domain.hpp>
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

template <class Exec>
BasicPoseTransfer<Exec>::BasicPoseTransfer() = default;

template <class Exec>
BasicPoseTransfer<Exec> BasicPoseTransfer<Exec>::random(const NetworkType<Exec>& type, std::uint64_t seed,
                                                        const TransferOptions& options, Exec executor) {
  AlignedBuffer<float> values(type.buffer_size);
  set_attributes(*type.parameters, values.span());
  randomise_values(*type.parameters, values.span(), seed);
  return BasicPoseTransfer(type, values.span(), {}, "random weights", options, std::move(executor));
}

template <class Exec>
BasicPoseTransfer<Exec>::BasicPoseTransfer(const NetworkType<Exec>& type, std::span<const float> values,
                                           const Metadata& metadata, const std::string& name,
                                           const TransferOptions& options, Exec executor) {
  add(metadata,
      std::make_unique<const NetworkTransfer<Exec>>(type, values, metadata, name, options, std::move(executor)));
}

template <class Exec>
Mesh BasicPoseTransfer<Exec>::operator()(const Mesh& identity, const Mesh& pose) const {
  Mesh result = identity;
  const std::vector<Triangle> of_identity = triangles_of(identity), of_pose = triangulate(pose);
  (*this)(MeshView{identity.coordinates(), as_span(of_identity), "identity"},
          MeshView{pose.coordinates(), as_span(of_pose), "pose"}, result.coordinates());
  recompute_normals(result);
  return result;
}

template <class Exec>
void BasicPoseTransfer<Exec>::operator()(const MeshView& identity, const MeshView& pose,
                                         std::span<float> result) const {
  const TransferJob job{identity, pose, result};
  run({&job, 1});
}

template <class Exec>
void BasicPoseTransfer<Exec>::run(std::span<const TransferJob> jobs) const {
  if (!has_body() && domains_.size() == 1) return run_by_network(jobs);
  Character character;
  Pose pose;
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const TransferJob& job = jobs[j];
    internal::expect_result(job.result.size(), job.identity.xyz.size());
    const bool known_identity = j > 0 && internal::same_memory(job.identity, jobs[j - 1].identity);
    const bool known_pose = j > 0 && internal::same_memory(job.pose, jobs[j - 1].pose) &&
                            (!pairs_vertices() || job.identity.xyz.size() == jobs[j - 1].identity.xyz.size());
    if (!known_identity && !known_pose) {
      prepare(job.identity, job.pose, character, pose);
    } else {
      if (!known_identity) prepare(job.identity, character);
      if (!known_pose) prepare(job.pose, job.identity.vertex_count(), pose);
    }
    const TransferReport report = apply(character, pose, job.result);
    if (job.report != nullptr) *job.report = report;
  }
}

template <class Exec>
Character BasicPoseTransfer<Exec>::character(const Mesh& identity, std::string_view name,
                                             const Control& control) const {
  Character prepared;
  const std::vector<Triangle> triangles = triangulate(identity);
  prepare(MeshView{identity.coordinates(), as_span(triangles), name}, prepared, control);
  prepared.mesh_ = std::make_shared<const Mesh>(identity);
  return prepared;
}

template <class Exec>
Character BasicPoseTransfer<Exec>::character(const MeshView& identity, const Control& control) const {
  Character prepared;
  prepare(identity, prepared, control);
  return prepared;
}

template <class Exec>
Pose BasicPoseTransfer<Exec>::pose(const Mesh& mesh, std::size_t identity_vertices, std::string_view name,
                                   const Control& control) const {
  Pose prepared;
  const std::vector<Triangle> triangles = triangulate(mesh);
  prepare(MeshView{mesh.coordinates(), as_span(triangles), name}, identity_vertices, prepared, control);
  return prepared;
}

template <class Exec>
Pose BasicPoseTransfer<Exec>::pose(const MeshView& mesh, std::size_t identity_vertices, const Control& control) const {
  Pose prepared;
  prepare(mesh, identity_vertices, prepared, control);
  return prepared;
}

template <class Exec>
void BasicPoseTransfer<Exec>::prepare(const MeshView& identity, Character& prepared, const Control& control) const {
  const MeshView mesh = checked(identity, "identity");
  finish_character(mesh, estimate(mesh, control), nullptr, prepared);
}

template <class Exec>
void BasicPoseTransfer<Exec>::prepare(const MeshView& pose, std::size_t identity_vertices, Pose& prepared,
                                      const Control& control) const {
  const MeshView mesh = checked(pose, "pose");
  const double share = has_body() ? 1 - encoding_share : 0;
  finish_pose(mesh, estimate(mesh, control.part(0, share)), identity_vertices, prepared, control.part(share, 1));
}

template <class Exec>
void BasicPoseTransfer<Exec>::prepare(const MeshView& identity, const MeshView& pose, Character& character,
                                      Pose& prepared_pose) const {
  const std::array<MeshView, 2> meshes{checked(identity, "identity"), checked(pose, "pose")};
  std::array<Found, 2> found;
  engine().executor().for_each(2, [&](int i, int) {
    const auto mesh = static_cast<std::size_t>(i);
    found[mesh] = estimate(meshes[mesh], {});
  });
  finish_character(meshes[0], std::move(found[0]), nullptr, character);
  finish_pose(meshes[1], std::move(found[1]), identity.vertex_count(), prepared_pose);
}

template <class Exec>
void BasicPoseTransfer<Exec>::prepare(const MeshView& frame, const PoseChoice& choice, Pose& prepared,
                                      const Pose* last) const {
  const MeshView mesh = checked(frame, "pose");
  if (last != nullptr) expect_own(last->own_, "last pose");
  const bool follows = last != nullptr && last->own_.estimate != nullptr && last->own_.body != nullptr;
  Found found = follows ? Found{last->own_.domain, nullptr} : estimate(mesh, {});
  const Domain& domain = *domains_[found.domain];
  if (choice.others_.size() + 1 != domains_.size()) throw foreign("chosen points");
  const PoseChoice& own = found.domain == 0 ? choice : choice.others_[found.domain - 1];
  if (!domain.late) domain.network().expect_chosen(own);
  if (follows) found.estimate = domain.body->follow(mesh, *last->own_.estimate);
  take(mesh, MeshRole::pose, std::move(found), prepared.own_);
  // One frame in doubt, which a warning says, is no reason to refuse a clip.
  prepared.own_.recognised = prepared.own_.recognised || (follows && last->own_.recognised);
  keep_or_encode(mesh, own, prepared);
}

template <class Exec>
PoseChoice BasicPoseTransfer<Exec>::choose_points(const MeshView& first_frame, std::size_t identity_vertices) const {
  PoseChoice choice;
  choose_points(first_frame, identity_vertices, choice);
  return choice;
}

template <class Exec>
void BasicPoseTransfer<Exec>::choose_points(const MeshView& first_frame, std::size_t identity_vertices,
                                            PoseChoice& choice) const {
  const MeshView mesh = checked(first_frame, "pose");
  choice.others_.resize(domains_.size() - 1);
  for (std::size_t d = 0; d < domains_.size(); ++d)
    if (!domains_[d]->late)  // its network takes no mesh of a sequence
      domains_[d]->network().choose(mesh, identity_vertices, d == 0 ? choice : choice.others_[d - 1]);
}

template <class Exec>
Result BasicPoseTransfer<Exec>::apply(const Character& character, const Pose& pose, const Control& control) const {
  Result result;
  if (character.mesh_ != nullptr) {
    result.mesh = *character.mesh_;
  } else {
    result.mesh.positions.resize(character.vertex_count());
    set_faces(result.mesh, character.triangles());
  }
  static_cast<TransferReport&>(result) = apply(character, pose, result.mesh.coordinates(), control);
  recompute_normals(result.mesh);
  return result;
}

template <class Exec>
TransferReport BasicPoseTransfer<Exec>::apply(const Character& character, const Pose& pose, std::span<float> result,
                                              const Control& control) const {
  TransferReport report = this->report(character, pose);
  internal::expect_result(result.size(), character.xyz_.size());
  if (report.method == Method::body)
    character.own_.body->pose(*character.binding_, *pose.own_.estimate, result);
  else
    by_network(character, pose, result, control);
  if (character.refinement_ != nullptr) character.refinement_->refine(result);
  if (character.meter_ != nullptr) report.measures = measure(character, pose, result);
  return report;
}

template <class Exec>
TransferReport BasicPoseTransfer<Exec>::apply(const Character& character, const MeshView& pose,
                                              std::span<float> result) const {
  const auto lease = pool_.lease();
  prepare(pose, character.vertex_count(), lease->pose);
  return apply(character, lease->pose, result);
}

template <class Exec>
ResultMeasures BasicPoseTransfer<Exec>::measure(const Character& character, const Pose& pose,
                                                std::span<const float> result) const {
  expect_own(character.own_, "identity");
  expect_own(pose.own_, "pose");
  internal::expect_result(result.size(), character.xyz_.size());
  const MeshView mesh{character.positions(), character.triangles(), character.own_.name};
  if (character.meter_ == nullptr && !internal::has_surface(mesh))
    throw Error({.file = character.own_.name, .found = "no surface", .expected = "triangles, to measure results"});
  ResultMeasures measures = (character.meter_ == nullptr ? ResultMeter(mesh) : *character.meter_).measure(result);
  if (character.own_.estimate != nullptr) measures.identity_coverage = character.own_.estimate->coverage;
  if (pose.own_.estimate != nullptr) measures.pose_coverage = pose.own_.estimate->coverage;
  return measures;
}

template <class Exec>
TransferReport BasicPoseTransfer<Exec>::report(const Character& character, const Pose& pose) const {
  expect_own(character.own_, "identity");
  expect_own(pose.own_, "pose");
  const transfer::internal::Prepared &a = character.own_, &b = pose.own_;
  // The network takes a domain's meshes only where it is asked for: what it makes of meshes unlike those of its
  // training is a wreck.
  if (a.refused() || b.refused()) (a.confidence() <= b.confidence() && a.refused() ? a : b).expect_recognised();
  if (a.recognised && b.recognised && a.domain != b.domain)
    throw Error({.file = b.name,
                 .found = "a pose of the domain '" + b.domain_name + "'",
                 .expected = "one of '" + a.domain_name + "', as " + a.name + " is",
                 .code = ErrorCode::domains_differ});
  TransferReport report;
  report.method = a.recognised && b.recognised ? Method::body : Method::network;
  if (a.estimate != nullptr && b.estimate != nullptr)
    report.confidence = std::min(a.estimate->confidence, b.estimate->confidence);
  const bool by_body = report.method == Method::body;
  if (by_body) report.kind = a.recognised_kind();
  report.warnings = by_body ? a.by_body : a.by_network;
  report.warnings.append(by_body ? b.by_body : b.by_network);
  return report;
}

template <class Exec>
std::optional<std::vector<Affine>> BasicPoseTransfer<Exec>::motions(const Character& character,
                                                                    const Pose& pose) const {
  if (report(character, pose).method != Method::body) return std::nullopt;
  return character.own_.body->motions(*character.binding_, *pose.own_.estimate);
}

template <class Exec>
bool BasicPoseTransfer<Exec>::pairs_vertices() const noexcept {
  for (const auto& domain : domains_)
    if (domain->paired) return true;
  return false;
}

template <class Exec>
const TransferOptions& BasicPoseTransfer<Exec>::options() const noexcept {
  return main().network().options();
}

template <class Exec>
const Metadata& BasicPoseTransfer<Exec>::variant() const noexcept {
  return main().network().variant();
}

template <class Exec>
const engine::Core<float, Exec>& BasicPoseTransfer<Exec>::engine() const noexcept {
  return main().network().engine();
}

template <class Exec>
double BasicPoseTransfer<Exec>::unit_of(const MeshView& mesh) const {
  return main().network().unit_of(mesh);
}

template <class Exec>
bool BasicPoseTransfer<Exec>::has_body() const noexcept {
  for (const auto& domain : domains_)
    if (domain->body != nullptr) return true;
  return false;
}

template <class Exec>
std::string BasicPoseTransfer<Exec>::description() const {
  std::string text = main().network().description();
  for (std::size_t d = 0; d < domains_.size(); ++d) {
    if (domains_[d]->body == nullptr) continue;
    // Those that are late needn't be opened for this.
    text += ", " + (domains_[d]->late ? domains_[d]->name + "s" : domains_[d]->body->words().many);
    text += " by body estimation";
  }
  return text;
}

/// The weights of one file.
template <class Exec>
struct BasicPoseTransfer<Exec>::Domain {
  Domain(const Metadata& metadata, bool pairs) : paired(pairs) {
    if (const auto named = metadata.find("domain"); named != metadata.end()) name = named->second;
  }
  const NetworkTransfer<Exec>& network() const {
    if (late) std::call_once(once, [this] { opened = late(); });
    return *opened;
  }

  std::string name;
  bool paired = false;              ///< whether the network pairs vertices
  std::function<Network()> late{};  ///< opens the network when it is first asked for; none: it is open
  mutable Network opened{};
  mutable std::once_flag once{};
  std::shared_ptr<const BodyDomain> body{};
};

/// What was estimated for a mesh, and by which domain.
template <class Exec>
struct BasicPoseTransfer<Exec>::Found {
  std::size_t domain = 0;
  std::shared_ptr<const DomainEstimate> estimate{};
  std::vector<std::shared_ptr<const DomainEstimate>> asked{};  ///< of the domains, from the first one on
};

/// The memory of one call.
template <class Exec>
struct BasicPoseTransfer<Exec>::Scratch {
  PoseChoice choice;
  Pose pose;
  NetworkPose late;
};

template <class Exec>
BasicPoseTransfer<Exec> BasicPoseTransfer<Exec>::open_paths(FindNetwork find,
                                                            std::span<const std::filesystem::path> weights,
                                                            const TransferOptions& options, const Exec& executor) {
  BasicPoseTransfer transfer;
  for (const std::filesystem::path& path : weights)
    transfer.add_file(
        find, [path] { return SafetensorsFile::read(path); },
        transfer.domains_.empty() ? Metadata() : SafetensorsFile::read_metadata(path), options, executor);
  return transfer.domains_.empty() ? throw no_weights() : std::move(transfer);
}

template <class Exec>
BasicPoseTransfer<Exec> BasicPoseTransfer<Exec>::open_files(FindNetwork find, std::span<const SafetensorsFile> files,
                                                            const TransferOptions& options, const Exec& executor) {
  BasicPoseTransfer transfer;
  for (const SafetensorsFile& file : files)
    transfer.add_file(
        find, [file] { return file; }, file.metadata(), options, executor);
  return transfer.domains_.empty() ? throw no_weights() : std::move(transfer);
}

template <class Exec>
void BasicPoseTransfer<Exec>::add(const Metadata& metadata, Network network) {
  domains_.push_back(std::make_shared<Domain>(metadata, network->pairs_vertices()));
  domains_.back()->opened = std::move(network);
}

template <class Exec>
void BasicPoseTransfer<Exec>::add_file(FindNetwork find, const std::function<SafetensorsFile()>& read,
                                       const Metadata& metadata, const TransferOptions& options, const Exec& executor) {
  const auto network_of = [find, options, executor](const SafetensorsFile& file) {
    const NetworkType<Exec>& type = find(file, options.network.assume);
    AlignedBuffer<float> values(type.buffer_size);
    load_values(file, type.variant, *type.parameters, values.span(), options.network.assume);
    return std::make_unique<const NetworkTransfer<Exec>>(type, values.span(), file.metadata(), file.name(), options,
                                                         executor);
  };
  const auto feature = metadata.find("feature");
  const bool late = !domains_.empty() && options.method != Method::network && feature != metadata.end() &&
                    metadata.contains("correspondence/net");
  if (!late) {
    const SafetensorsFile file = read();
    add(file.metadata(), network_of(file));
    return open_body(file);
  }
  domains_.push_back(std::make_shared<Domain>(metadata, feature->second != Pooled::name));
  domains_.back()->late = [read, network_of] { return network_of(read()); };
  domains_.back()->body = std::make_shared<const LateDomain>(
      [read, body = options.body, threads = static_cast<int>(engine().executor().slots())] {
        const SafetensorsFile file = read();
        if (auto domain = open_body_domain(file, body, threads)) return domain;
        throw no_body(file, "those that its metadata tell of");
      });
}

template <class Exec>
void BasicPoseTransfer<Exec>::open_body(const SafetensorsFile& file) {
  if (options().method == Method::network) return;
  const int threads = static_cast<int>(engine().executor().slots());
  std::shared_ptr<const BodyDomain>& body = domains_.back()->body = open_body_domain(file, options().body, threads);
  const std::string* named = file.find_metadata("body");
  if (body == nullptr && named != nullptr) {
    const std::filesystem::path beside = std::filesystem::path(file.name()).parent_path() / *named;
    const bool exists = std::filesystem::exists(beside);
    if (exists) body = open_body_domain(SafetensorsFile::read(beside), options().body, threads);
    if (body == nullptr)
      throw Error({.file = beside.string(),
                   .found = exists ? "weights without body estimation" : "no such file",
                   .expected = "the weights of body estimation that " + file.name() + " goes with, beside it",
                   .code = ErrorCode::missing_weights,
                   .remedy = Remedy::give_weights});
  }
  if (body == nullptr && options().method == Method::body)
    throw no_body(file, "weights with it: the body method needs them");
}

template <class Exec>
Error BasicPoseTransfer<Exec>::no_body(const SafetensorsFile& file, const char* expected) {
  return Error({.file = file.name(),
                .found = "weights without body estimation",
                .expected = expected,
                .code = ErrorCode::missing_weights,
                .remedy = Remedy::choose_method});
}

template <class Exec>
const typename BasicPoseTransfer<Exec>::Domain& BasicPoseTransfer<Exec>::main() const noexcept {
  return *domains_.front();
}

template <class Exec>
std::size_t BasicPoseTransfer<Exec>::default_domain() const noexcept {
  for (std::size_t d = 0; d < domains_.size(); ++d)
    if (domains_[d]->body == nullptr) return d;
  return 0;
}

template <class Exec>
MeshView BasicPoseTransfer<Exec>::checked(const MeshView& mesh, std::string_view role) {
  const MeshView named = internal::named(mesh, role);
  internal::expect_transferable(named);
  return named;
}

template <class Exec>
typename BasicPoseTransfer<Exec>::Found BasicPoseTransfer<Exec>::estimate(const MeshView& mesh,
                                                                          const Control& control) const {
  Found best{default_domain(), nullptr};
  if (options().method != Method::body && !internal::has_surface(mesh)) return best;
  for (std::size_t d = 0; d < domains_.size(); ++d) {
    if (domains_[d]->body == nullptr) continue;
    best.asked.resize(d + 1);
    best.asked[d] = domains_[d]->body->estimate(mesh, control);
    if (best.estimate == nullptr || best.asked[d]->confidence > best.estimate->confidence)
      best.domain = d, best.estimate = best.asked[d];
    if (best.estimate->confidence >= options().body.high_confidence) break;
  }
  if (domains_.size() > 1 && best.estimate != nullptr && best.estimate->confidence < least_confidence()) {
    best.domain = default_domain();
    if (domains_[best.domain]->body != nullptr) best.estimate = best.asked[best.domain];
  }
  return best;
}

template <class Exec>
void BasicPoseTransfer<Exec>::take(const MeshView& mesh, MeshRole role, Found found,
                                   transfer::internal::Prepared& own) const {
  const Domain& domain = *domains_[found.domain];
  own.owner = owner_;
  own.domain = found.domain;
  own.domain_name.assign(domain.name);
  own.name.assign(mesh.name);
  own.body = domain.body;
  own.estimate = std::move(found.estimate);
  own.recognised = own.estimate != nullptr && domain.body != nullptr && own.estimate->confidence >= least_confidence();
  name_kinds(found.asked, own);
  own.by_body.clear();
  own.by_network.clear();
  if (own.estimate != nullptr && domain.body != nullptr) {
    const double confidence = own.estimate->confidence;
    const auto said = [&](WarningCode code, double value) {
      return Warning{.code = code, .mesh = role, .value = value, .kind = own.kind};
    };
    for (const WarningCode code : own.estimate->warnings) own.by_body.push_back(said(code, 0));
    if (confidence < options().body.high_confidence)
      own.by_body.push_back(said(WarningCode::low_confidence, confidence));
    if (!own.recognised) own.by_network.push_back(said(WarningCode::not_recognised, confidence));
  } else if (has_body()) {
    own.by_network.push_back({WarningCode::no_surface, role, 0});
  }
}

template <class Exec>
void BasicPoseTransfer<Exec>::name_kinds(std::span<const std::shared_ptr<const DomainEstimate>> asked,
                                         transfer::internal::Prepared& own) const {
  own.looked_for.clear();
  own.kind = own.body == nullptr ? nullptr : &own.body->words();
  if (own.recognised || own.estimate == nullptr) return;
  const auto add = [&own](const KindWords& kind, double confidence) {
    own.looked_for += (own.looked_for.empty() ? "" : ", nor as ") + with_article(kind.one) +
                      (own.looked_for.empty() ? " (confidence " : " (") + percent_text(confidence) + ")";
  };
  if (asked.empty() && own.kind != nullptr) add(*own.kind, own.confidence());
  for (std::size_t d = 0; d < asked.size(); ++d)
    if (asked[d] != nullptr) add(domains_[d]->body->words(), asked[d]->confidence);
}

template <class Exec>
void BasicPoseTransfer<Exec>::finish_character(const MeshView& mesh, Found found,
                                               std::shared_ptr<const DomainBinding> binding,
                                               Character& character) const {
  take(mesh, MeshRole::identity, std::move(found), character.own_);
  transfer::internal::Prepared& own = character.own_;
  character.mesh_ = nullptr;
  if (own.recognised && binding == nullptr) binding = own.body->bind(mesh, *own.estimate);
  character.binding_ = own.recognised ? std::move(binding) : nullptr;
  character.xyz_.assign(mesh.xyz.begin(), mesh.xyz.end());
  character.triangles_.assign(mesh.triangles.begin(), mesh.triangles.end());
  character.network_refusal_.reset();
  const NetworkTransfer<Exec>& network = domains_[own.domain]->network();
  try {
    network.prepare_identity(mesh, character.network_);
    note_unit(character.network_.unit, MeshRole::identity, own);
  } catch (const Error& error) {
    if (!own.recognised && !own.refused()) throw;
    character.network_refusal_ = error.parts();
    character.network_.unit = 1;
  }
  if (own.recognised && !own.estimate->figure.empty()) character.network_.unit = unit_of_figure(mesh, own);
  character.refinement_ =
      options().refinement == nullptr
          ? nullptr
          : std::shared_ptr<const Refinement>(options().refinement(mesh, *network.options().refine_radius));
  character.meter_ = meter(mesh);
}

template <class Exec>
std::shared_ptr<const ResultMeter> BasicPoseTransfer<Exec>::meter(const MeshView& identity) const {
  const bool measures = options().measure && internal::has_surface(identity);
  return measures ? std::make_shared<const ResultMeter>(identity) : nullptr;
}

template <class Exec>
void BasicPoseTransfer<Exec>::finish_pose(const MeshView& mesh, Found found, std::size_t identity_vertices, Pose& pose,
                                          const Control& control) const {
  take(mesh, MeshRole::pose, std::move(found), pose.own_);
  if (!taken_by_network(pose) || (identity_vertices == 0 && pairs_vertices())) return keep_for_network(mesh, pose);
  const auto lease = pool_.lease();
  domains_[pose.own_.domain]->network().choose(mesh, identity_vertices, lease->choice);
  keep_or_encode(mesh, lease->choice, pose, control);
}

template <class Exec>
void BasicPoseTransfer<Exec>::keep_or_encode(const MeshView& mesh, const PoseChoice& choice, Pose& pose,
                                             const Control& control) const {
  const NetworkTransfer<Exec>& network = domains_[pose.own_.domain]->network();
  if (!taken_by_network(pose)) return keep_for_network(mesh, pose);
  network.encode(mesh, choice, pose.network_, control);
  note_unit(network.unit_of(mesh), MeshRole::pose, pose.own_);
  if (domains_.size() > 1) return keep(mesh, pose, true);
  pose.xyz_.clear();
  pose.triangles_.clear();
}

template <class Exec>
void BasicPoseTransfer<Exec>::keep_for_network(const MeshView& mesh, Pose& pose) const {
  try {
    note_unit(domains_[pose.own_.domain]->network().unit_of(mesh), MeshRole::pose, pose.own_);
  } catch (const Error&) {
  }
  keep(mesh, pose);
}

template <class Exec>
void BasicPoseTransfer<Exec>::keep(const MeshView& mesh, Pose& pose, bool encoded) {
  if (!encoded) pose.network_.codes.clear(), pose.network_.count = 0;
  pose.xyz_.assign(mesh.xyz.begin(), mesh.xyz.end());
  pose.triangles_.assign(mesh.triangles.begin(), mesh.triangles.end());
}

template <class Exec>
double BasicPoseTransfer<Exec>::unit_of_figure(const MeshView& mesh, const transfer::internal::Prepared& own) const {
  std::vector<float> points;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; own.estimate->figure[t] && k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) points.push_back(mesh.xyz[3 * mesh.triangles[t][k] + i]);
  try {
    return domains_[own.domain]->network().unit_of({points, {}, mesh.name});
  } catch (const Error&) {
    return 1;
  }
}

template <class Exec>
void BasicPoseTransfer<Exec>::note_unit(double unit, MeshRole role, transfer::internal::Prepared& own) const {
  if (unit != 1 && !options().import.unit)
    own.by_network.push_back({WarningCode::unit_assumed, role, unit, Remedy::give_unit});
}

template <class Exec>
void BasicPoseTransfer<Exec>::by_network(const Character& character, const Pose& pose, std::span<float> result,
                                         const Control& control) const {
  if (character.network_refusal_) throw Error(*character.network_refusal_);
  const NetworkTransfer<Exec>& network = domains_[character.own_.domain]->network();
  const bool encoded = pose.network_.codes.size() == network.run_count() && character.own_.domain == pose.own_.domain;
  if (encoded) return network.decode(character.network_, pose.network_, result, control);
  if (pose.xyz_.empty()) throw foreign("pose");
  // Recognised, so that it wasn't encoded, but the character has no surface; or encoded for no character yet.
  const auto lease = pool_.lease();
  const MeshView mesh{pose.xyz_, pose.triangles_, pose.own_.name};
  network.choose(mesh, character.vertex_count(), lease->choice);
  network.encode(mesh, lease->choice, lease->late, control.part(0, encoding_share));
  network.decode(character.network_, lease->late, result, control.part(encoding_share, 1));
}

template <class Exec>
Error BasicPoseTransfer<Exec>::no_weights() {
  return Error({.file = "weights", .found = "no files", .expected = "at least one"});
}

template <class Exec>
Error BasicPoseTransfer<Exec>::foreign(const char* what) {
  return Error({.file = what,
                .found = "one that this transfer didn't prepare",
                .expected = "a prepared one",
                .code = ErrorCode::foreign});
}

template <class Exec>
void BasicPoseTransfer<Exec>::expect_own(const transfer::internal::Prepared& own, const char* what) const {
  if (own.owner != owner_) throw foreign(what);
}

template <class Exec>
void BasicPoseTransfer<Exec>::run_by_network(std::span<const TransferJob> jobs) const {
  std::vector<std::shared_ptr<const Refinement>> refinements;
  for (std::size_t j = 0; options().refinement != nullptr && j < jobs.size(); ++j) {
    const bool known = j > 0 && internal::same_memory(jobs[j].identity, jobs[j - 1].identity);
    refinements.push_back(known ? refinements.back()
                                : std::shared_ptr<const Refinement>(options().refinement(
                                      checked(jobs[j].identity, "identity"), *options().refine_radius)));
  }
  std::vector<std::shared_ptr<const ResultMeter>> meters;  // made before results may overwrite their identities
  for (std::size_t j = 0; options().measure && j < jobs.size(); ++j)
    meters.push_back(jobs[j].report == nullptr ? nullptr : meter(jobs[j].identity));
  main().network().run(jobs);
  for (std::size_t j = 0; j < refinements.size(); ++j) refinements[j]->refine(jobs[j].result);
  for (std::size_t j = 0; j < meters.size(); ++j)
    if (meters[j] != nullptr) jobs[j].report->measures = meters[j]->measure(jobs[j].result);
}

template <class Exec>
std::vector<Triangle> BasicPoseTransfer<Exec>::triangles_of(const Mesh& identity) const {
  return options().refinement != nullptr || has_body() ? triangulate(identity) : std::vector<Triangle>();
}

template <class X>
void BasicCharacter<X>::save(const std::filesystem::path& file) const {
  if (binding_ == nullptr)
    throw Error({.file = file.string(),
                 .found = "a character that isn't recognised",
                 .expected = "a recognised one: of others there is nothing to keep",
                 .code = ErrorCode::needs_recognition});
  TensorList tensors;
  tensors.add_text("format", "npt character 2");
  tensors.add_text("domain", own_.domain_name);
  tensors.add("positions", std::span<const float>(xyz_), {vertex_count(), 3});
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : triangles_) corners.insert(corners.end(), t.begin(), t.end());
  tensors.add("triangles", std::span<const std::uint32_t>(corners), {triangles_.size(), 3});
  own_.body->save(*own_.estimate, *binding_, tensors);
  tensors.write(file);
}

template <class Exec>
Character BasicPoseTransfer<Exec>::load_character(const std::filesystem::path& path) const {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const std::string* format = file.find_metadata("format");
  const std::string* domain = file.find_metadata("domain");
  if (format == nullptr || *format != "npt character 2" || domain == nullptr)
    throw Error({.file = file.name(),
                 .place = "metadata",
                 .found = format == nullptr ? "no format" : "the format '" + *format + "'",
                 .expected = "'npt character 2', as Character::save writes it"});
  std::size_t d = 0;
  while (d < domains_.size() && (domains_[d]->body == nullptr || domains_[d]->name != *domain)) ++d;
  if (d == domains_.size())
    throw Error({.file = file.name(),
                 .found = "a character of the domain '" + *domain + "'",
                 .expected = "one of the domains that this transfer has",
                 .code = ErrorCode::domains_differ});
  const std::vector<float> xyz = to_values<float>(file.at("positions"), NonFinite::refuse);
  const std::vector<std::int64_t> corners = to_values<std::int64_t>(file.at("triangles"), NonFinite::refuse);
  std::vector<Triangle> triangles(corners.size() / 3);
  for (std::size_t i = 0; i < 3 * triangles.size(); ++i)
    triangles[i / 3][i % 3] = corners[i] < 0 ? no_index : static_cast<std::uint32_t>(corners[i]);
  const std::string name = path.string();
  const MeshView mesh = checked({as_span(xyz), as_span(triangles), name}, name);
  auto [estimate, binding] = domains_[d]->body->load(file);
  Character character;
  finish_character(mesh, {d, std::move(estimate)}, std::move(binding), character);
  return character;
}

#ifdef NPT_COMPILED
extern template class NetworkTransfer<DefaultExecutor>;
#endif

}  // namespace npt::inline NPT_ABI
