/// tinyobjloader inside the package's library: it is one header, and its functions stand here.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>
