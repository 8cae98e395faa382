#include <view/embedded.hpp>

#include <cstddef>

// The assembler takes the files as they are: an array of 165,000 numbers takes the compiler seconds.
#define NPT_EMBED(name, file)                  \
  asm(".pushsection .rodata\n"                 \
      ".global npt_embedded_" #name            \
      "\n"                                     \
      ".global npt_embedded_" #name            \
      "_end\n"                                 \
      "npt_embedded_" #name                    \
      ":\n"                                    \
      ".incbin \"" file                        \
      "\"\n"                                   \
      "npt_embedded_" #name                    \
      "_end:\n"                                \
      ".byte 0\n"                              \
      ".popsection\n");                        \
  extern "C" const char npt_embedded_##name[]; \
  extern "C" const char npt_embedded_##name##_end[];

NPT_EMBED(html, NPT_VIEW_FOLDER "/page.html")
NPT_EMBED(style, NPT_VIEW_FOLDER "/page.css")
NPT_EMBED(script, NPT_VIEW_FOLDER "/page.js")
NPT_EMBED(three, NPT_VIEW_THREE)

namespace view {

namespace {

std::string_view between(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

}  // namespace

std::string_view page_html() { return between(npt_embedded_html, npt_embedded_html_end); }
std::string_view page_style() { return between(npt_embedded_style, npt_embedded_style_end); }
std::string_view page_script() { return between(npt_embedded_script, npt_embedded_script_end); }
std::string_view three_gzip() { return between(npt_embedded_three, npt_embedded_three_end); }

}  // namespace view
