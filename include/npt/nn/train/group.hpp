/// Several processes that train one network together, each on its share of every batch. What a trainer needs of them;
/// MPI or whatever connects the processes stands behind it (examples/npt/training/group_mpi.cpp).
#pragma once

#include <npt/config.hpp>

#include <span>

namespace npt::inline NPT_ABI {

/// All members are collective: every process of the group calls them, in the same order.
class TrainingGroup {
 public:
  virtual ~TrainingGroup() = default;

  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Each number becomes its sum over the processes, the same bits in each of them.
  virtual void sum(std::span<float> values) const = 0;
  virtual void sum(std::span<double> values) const = 0;
  /// The first process's value, in all.
  virtual double of_first(double value) const = 0;

 protected:
  TrainingGroup() = default;
  TrainingGroup(const TrainingGroup&) = default;
  TrainingGroup& operator=(const TrainingGroup&) = default;
};

}  // namespace npt::inline NPT_ABI
