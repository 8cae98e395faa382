/// The arguments of `npt train`, and how they travel through checkpoints so that --resume needs none of them.
#pragma once

#include "networks.hpp"

#include <npt/body/pose_sampler.hpp>
#include <npt/mesh/normalise.hpp>
#include <npt/nn/train/adam.hpp>
#include <npt/nn/train/initialise.hpp>
#include <npt/nn/train/losses.hpp>
#include <npt/nn/train/trainer.hpp>

#include <CLI/CLI.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace program {

struct TrainingArguments {
  // Data
  std::vector<std::string> bodies;                   ///< "mannequin" or a file, each with "=WEIGHT" or without
  std::vector<std::string> rigs;                     ///< files, each with "=WEIGHT" or without
  std::optional<std::filesystem::path> joint_names;  ///< of rigs
  std::optional<std::filesystem::path> family;
  std::vector<std::string> held_out;  ///< labels of a family, clips of rigs
  double blend = 0;
  bool mirror = false;
  std::string shapes = "normal";
  double wide_poses = 0, natural_poses = 0;
  std::optional<double> clip_poses;
  bool protocol = false, mix_bodies = false;
  double yaw = 0, noise = 0;
  std::string scale_range = "1,1";
  std::optional<std::string> normalisation;
  // Network
  Variant variant{.bottleneck = 128, .order = "conv_relu", .feature = "pooled"};
  double output_scale = 1;
  std::string init = "small";
  std::optional<std::filesystem::path> start;
  // Course
  std::optional<double> minutes;
  std::optional<std::uint64_t> steps;
  std::vector<std::string> stages;  ///< "BEGIN:BATCHxVERTICES"
  std::optional<std::size_t> batch;
  std::optional<std::string> vertices;
  std::string optimiser = "muon";
  std::optional<double> rate;
  double matrix_rate = 0.02, matrix_momentum = 0.95;
  std::string schedule = "cosine";
  double warm_up = 0.02, last_rate = 0.02;
  double clip = 0, average = 0, beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  std::string loss_scaling = "mean", edge_loss = "none";
  double edge_weight = npt::paper_edge_weight;
  std::uint64_t seed = 0;
  // Run
  int threads = 0;
  std::string precision = "auto";
  std::filesystem::path out;
  bool resume = false, overwrite = false;
  std::uint64_t checkpoint_every = 0, validate_every = 0, log_every = 100;
  std::size_t validation_pairs = 16;
  std::string domain;
};

/// A part of the training: from `begin` (progress 0 .. 1) on, batches of `batch` meshes with `vertices` of theirs (0:
/// all).
struct StageArguments {
  double begin = 0;
  std::size_t batch = 0, vertices = 0;
};

/// The stages that the arguments ask for, or the recipe's own.
/// Errors    npt::Error that names the argument
std::vector<StageArguments> parse_stages(const TrainingArguments& arguments);

/// The learning rate asked for, or what suits the network's width.
double learning_rate(const TrainingArguments& arguments);

void add_training_options(CLI::App& command, TrainingArguments& arguments);

/// What the options are set to, given or by default, for a checkpoint. Options of the run itself (threads, files, how
/// often) are not in it.
npt::Metadata stored_options(const CLI::App& command);

/// Sets options from a checkpoint. What the user gave must agree with it, but for the length of the training.
/// Errors    npt::Error that names the option, what was given and what the training began with
void restore_options(CLI::App& command, const npt::Metadata& stored, const std::string& file);

/// The command that starts this training: "npt train --body human.safetensors --minutes 10". Files without their
/// folders.
std::string command_text(const CLI::App& command);

}  // namespace program
