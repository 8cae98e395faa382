/// The umbrella of pose transfer without networks, and what it is built from. Needs Eigen and liblbfgs (npt::baseline).
#pragma once

#include <npt/deformation/control_points.hpp>
#include <npt/deformation/correspondence.hpp>
#include <npt/deformation/deformation_evaluation.hpp>
#include <npt/deformation/deformation_transfer.hpp>
#include <npt/fit/body_fitter.hpp>
#include <npt/mesh/closest_point.hpp>
#include <npt/skeleton/bone_heat.hpp>
#include <npt/skeleton/skeleton_transfer.hpp>
#include <npt/solve/sparse_cholesky.hpp>
