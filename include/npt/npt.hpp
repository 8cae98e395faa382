/// npt: neural pose transfer. The umbrella: weights, meshes, body estimation and networks, and the transfer between
/// meshes. Mesh files (<npt/io/mesh_file.hpp>), moving scenes (<npt/transfer/animation.hpp>), xtensor
/// (<npt/adapt/xtensor.hpp>) and refinement (<npt/transfer/detail_refiner.hpp>) are included apart, since not every host
/// wants their dependencies.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/nets/pose_transfer_net.hpp>
#include <npt/nn/engine/engine.hpp>
#include <npt/nn/engine/model.hpp>
#include <npt/nn/graph/explain.hpp>
#include <npt/nn/weights/weights_file.hpp>
#include <npt/transfer/pose_tracker.hpp>
#include <npt/transfer/pose_transfer.hpp>
