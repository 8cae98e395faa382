// expect: NaN is lost with -ffast-math
// flags: -ffast-math
#include <npt/config.hpp>
