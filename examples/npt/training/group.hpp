/// The processes that train together. A build with -DNPT_WITH_MPI=ON has them from MPI (group_mpi.cpp); in any other a
/// process is always alone (group_alone.cpp).
#pragma once

#include <npt/nn/train/group.hpp>

#include <memory>

namespace training {

/// The group that this process was started in, or nothing where it is alone. To be called once.
std::unique_ptr<npt::TrainingGroup> join_group();

}  // namespace training
