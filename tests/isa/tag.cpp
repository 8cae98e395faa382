// Preprocessed by check_tags.cmake, which looks for the next lines.
#include <npt/config.hpp>
tag_of_this_unit : NPT_ABI tbb_in_this_unit : NPT_HAS_TBB
