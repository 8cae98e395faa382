// Says NPT_ABI of the flags that it is compiled with, for CMakeLists.txt to read in the object.
#include <npt/config.hpp>

extern const char npt_abi[];
const char npt_abi[] = "npt_abi=" NPT_TEXT(NPT_ABI);
