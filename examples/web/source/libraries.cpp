/// What npt's headers leave to a library: tinyobjloader is one header, and its functions stand here.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
