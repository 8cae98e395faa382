#define NPT_COMPILING
#include <npt/body/mannequin/mannequin.hpp>

npt::BodyTables npt::make_mannequin_tables() { return internal::mannequin_tables(); }
