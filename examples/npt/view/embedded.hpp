/// The files of the page, as CMake puts them into the program.
#pragma once

#include <string_view>

namespace view {

std::string_view page_html();     ///< page.html: {{name}} stands for what the page gets
std::string_view base_style();    ///< base.css
std::string_view page_style();    ///< page.css
std::string_view stage_script();  ///< stage.js
std::string_view page_script();   ///< page.js
std::string_view three_gzip();    ///< three/three.min.js, as a gzip file

}  // namespace view
