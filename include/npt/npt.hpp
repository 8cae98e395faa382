/// npt: neural pose transfer. The umbrella: weights, meshes, body estimation and networks, and the transfer between
/// meshes. Mesh files (<npt/io/mesh_file.hpp>), moving scenes (<npt/transfer/animation.hpp>), xtensor
/// (<npt/adapt/xtensor.hpp>) and refinement (<npt/transfer/detail_refiner.hpp>) are included apart: not every host
/// wants their dependencies. Units that link npt::compiled include <npt/nets/network_list.hpp> for networks,
/// <npt/transfer/pose_transfer.hpp> for transfers on executors of their own, and <npt/nn/graph/explain.hpp>.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/nn/engine/engine_class.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/weights/weights.hpp>
#include <npt/transfer/pose_tracker.hpp>
#include <npt/transfer/pose_transfer_class.hpp>
#ifndef NPT_COMPILED
#include <npt/nn/graph/explain.hpp>
#include <npt/transfer/pose_transfer.hpp>
#endif
