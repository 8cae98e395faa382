/// The umbrella of the room classic: pose transfer without networks, and what it is built from. Needs Eigen (npt::classic).
#pragma once

#include <npt/classic/body_fit.hpp>
#include <npt/classic/bone_heat.hpp>
#include <npt/classic/closest_point.hpp>
#include <npt/classic/control_points.hpp>
#include <npt/classic/correspondence.hpp>
#include <npt/classic/deformation_evaluation.hpp>
#include <npt/classic/deformation_transfer.hpp>
#include <npt/classic/detail_refiner.hpp>
#include <npt/classic/skeleton_transfer.hpp>
#include <npt/classic/sparse_cholesky.hpp>
