/// The umbrella of pose transfer without networks, and what it is built from. Needs Eigen and liblbfgs (npt::classic).
#pragma once

#include <npt/classic/body_fit.hpp>
#include <npt/classic/bone_heat.hpp>
#include <npt/classic/control_points.hpp>
#include <npt/classic/correspondence.hpp>
#include <npt/classic/deformation_evaluation.hpp>
#include <npt/classic/deformation_transfer.hpp>
#include <npt/classic/skeleton_transfer.hpp>
#include <npt/linear/sparse_cholesky.hpp>
#include <npt/surface/closest_point.hpp>
