#include <view/embedded.hpp>

#include <cstddef>

// The assembler takes the files as they are: an array of 165,000 numbers takes the compiler seconds.
#if defined(_WIN32)
#define NPT_CONSTANTS ".section .rdata,\"dr\"\n"
#define NPT_BACK ".text\n"
#elif defined(__APPLE__)
#define NPT_CONSTANTS ".section __TEXT,__const\n"
#define NPT_BACK ".text\n"
#else
#define NPT_CONSTANTS ".pushsection .rodata\n"
#define NPT_BACK ".popsection\n"
#endif
#define NPT_TEXT_OF(x) #x
#define NPT_TEXT(x) NPT_TEXT_OF(x)
#define NPT_SYMBOL(name) NPT_TEXT(__USER_LABEL_PREFIX__) "npt_embedded_" name
#define NPT_EMBED(name, file)                             \
  asm(NPT_CONSTANTS ".globl " NPT_SYMBOL(#name) "\n"    \
      ".globl " NPT_SYMBOL(#name) "_end\n"              \
      NPT_SYMBOL(#name) ":\n"                           \
      ".incbin \"" file "\"\n"                          \
      NPT_SYMBOL(#name) "_end:\n"                       \
      ".byte 0\n" NPT_BACK); \
  extern "C" const char npt_embedded_##name[];            \
  extern "C" const char npt_embedded_##name##_end[];

NPT_EMBED(html, NPT_VIEW_FOLDER "/page.html")
NPT_EMBED(base, NPT_VIEW_FOLDER "/base.css")
NPT_EMBED(style, NPT_VIEW_FOLDER "/page.css")
NPT_EMBED(stage, NPT_VIEW_FOLDER "/stage.js")
NPT_EMBED(script, NPT_VIEW_FOLDER "/page.js")
NPT_EMBED(three, NPT_VIEW_THREE)

namespace view {

namespace {

std::string_view between(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

}  // namespace

std::string_view page_html() { return between(npt_embedded_html, npt_embedded_html_end); }
std::string_view base_style() { return between(npt_embedded_base, npt_embedded_base_end); }
std::string_view page_style() { return between(npt_embedded_style, npt_embedded_style_end); }
std::string_view stage_script() { return between(npt_embedded_stage, npt_embedded_stage_end); }
std::string_view page_script() { return between(npt_embedded_script, npt_embedded_script_end); }
std::string_view three_gzip() { return between(npt_embedded_three, npt_embedded_three_end); }

}  // namespace view
