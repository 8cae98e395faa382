#include <training/group.hpp>

#include <npt/base/error.hpp>

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <limits>
#include <string>

namespace training {

namespace {

void check(int code, const char* what) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING];
  int size = 0;
  MPI_Error_string(code, text, &size);
  throw npt::Error({"MPI", what, std::string(text, static_cast<std::size_t>(size)), "success"});
}

class MpiGroup final : public npt::TrainingGroup {
 public:
  MpiGroup() {
    int provided = 0;
    check(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided), "MPI_Init_thread");
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    check(MPI_Comm_rank(MPI_COMM_WORLD, &rank_), "MPI_Comm_rank");
    check(MPI_Comm_size(MPI_COMM_WORLD, &size_), "MPI_Comm_size");
  }
  /// A process that leaves by an exception takes the others with it: they would wait for it for ever.
  ~MpiGroup() override {
    if (std::uncaught_exceptions() > 0)
      MPI_Abort(MPI_COMM_WORLD, 1);
    else
      MPI_Finalize();
  }
  MpiGroup(const MpiGroup&) = delete;
  MpiGroup& operator=(const MpiGroup&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void sum(std::span<float> values) const override { all_reduce(values, MPI_FLOAT); }
  void sum(std::span<double> values) const override { all_reduce(values, MPI_DOUBLE); }
  double of_first(double value) const override {
    check(MPI_Bcast(&value, 1, MPI_DOUBLE, 0, MPI_COMM_WORLD), "MPI_Bcast");
    return value;
  }

 private:
  template <class T>
  static void all_reduce(std::span<T> values, MPI_Datatype type) {
    constexpr std::size_t most = std::numeric_limits<int>::max();
    for (std::size_t first = 0; first < values.size(); first += most) {
      const auto part = values.subspan(first, std::min(most, values.size() - first));
      check(MPI_Allreduce(MPI_IN_PLACE, part.data(), static_cast<int>(part.size()), type, MPI_SUM, MPI_COMM_WORLD),
            "MPI_Allreduce");
    }
  }

  int rank_ = 0, size_ = 1;
};

}  // namespace

std::unique_ptr<npt::TrainingGroup> join_group() {
  // Set by mpirun (Open MPI; MPICH and what follows PMI): a process that was started by itself needs no MPI.
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
    if (std::getenv(name) != nullptr) return std::make_unique<MpiGroup>();
  return nullptr;
}

}  // namespace training
