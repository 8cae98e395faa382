#include <npt/npt.hpp>
