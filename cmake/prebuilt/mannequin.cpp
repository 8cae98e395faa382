#define NPT_PREBUILDING
#include <npt/mannequin/mannequin.hpp>

npt::BodyTables npt::make_mannequin_tables() { return internal::mannequin_tables(); }
