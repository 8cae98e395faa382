// Preprocessed by check_tags.cmake, which looks for the next line.
#include <npt/config.hpp>
tag_of_this_unit : NPT_ABI
