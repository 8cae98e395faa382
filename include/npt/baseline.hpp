/// The umbrella of pose transfer without networks, and what it is built from. Needs Eigen and liblbfgs (npt::baseline).
#pragma once

#include <npt/baseline/deformation/control_points.hpp>
#include <npt/baseline/deformation/correspondence.hpp>
#include <npt/baseline/deformation/deformation_evaluation.hpp>
#include <npt/baseline/deformation/deformation_transfer.hpp>
#include <npt/baseline/fit/body_fitter.hpp>
#include <npt/baseline/skeleton/bone_heat.hpp>
#include <npt/baseline/skeleton/skeleton_transfer.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/solve/sparse_cholesky.hpp>
