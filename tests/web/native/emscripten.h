/* Stands in for emscripten's header where a test links the page's units with this machine's compiler. */
#pragma once
#define EMSCRIPTEN_KEEPALIVE __attribute__((used, visibility("default")))
