/// What npt's headers leave to a library: tinyobjloader is one header, and its functions stand here. liblbfgs, which
/// only searches for a body without a reading need, is not called in the browser.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
