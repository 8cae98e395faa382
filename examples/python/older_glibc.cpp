// Lets the wheel's library run on glibc 2.34, though it is linked on a newer one: definitions, which none outside sees,
// of functions that libstdc++ and npt would ask for in later versions. The newest that stay are of 2.34: pthread_create
// and its like, which moved into libc there. Systems before it, such as RHEL 8 and Ubuntu 20.04, would need a dozen of
// these by their former names, and libpthread. A static libgcc's search for frames (_dl_find_object, 2.35) isn't here:
// the library takes the system's libgcc_s.
#include <stdlib.h>
#include <sys/random.h>

#ifdef __GLIBC__
extern "C" {

// 2.36. npt uses no std::random_device, but parts of libstdc++ bring it.
unsigned arc4random() noexcept {
  unsigned bits = 0;
  if (getentropy(&bits, sizeof bits) != 0) abort();
  return bits;
}

// 2.35, which is the former function without errno: the same bits (5 million random pairs on glibc 2.36).
double npt_former_hypot(double x, double y) noexcept;
__asm__(".symver npt_former_hypot, hypot@GLIBC_2.2.5");
double hypot(double x, double y) noexcept { return npt_former_hypot(x, y); }

}  // extern "C"
#endif
