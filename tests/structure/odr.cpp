/// Links two units that include every public header. That it links is the test; both must also see one library.
#include <cstdio>
#include <cstring>

extern "C" const char* isa_of_unit_one();
extern "C" const char* isa_of_unit_two();

int main() {
  std::printf("unit one: %s, unit two: %s\n", isa_of_unit_one(), isa_of_unit_two());
  return std::strcmp(isa_of_unit_one(), isa_of_unit_two());
}
