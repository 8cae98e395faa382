// expect: is_trivially_copyable
#include <npt/base/aligned.hpp>

#include <string>

// A buffer that copies by bytes must not hold what owns memory.
npt::AlignedBuffer<std::string>* buffer = nullptr;
auto size = buffer->size();
