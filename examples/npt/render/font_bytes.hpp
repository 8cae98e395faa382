/// The file font/DejaVuSans-ascii.ttf, as CMake puts it into the program.
#pragma once

namespace render {

extern const unsigned char font_bytes[];

}  // namespace render
