#!/usr/bin/env python3
"""Pose transfer from Python through npt's C ABI, with nothing but the standard library: what a plug-in of a modelling tool
does. Two boxes stand in for the tool's meshes.

usage: transfer.py LIBRARY [WEIGHTS]
  LIBRARY   libnpt_c.so, which the build leaves in lib
  WEIGHTS   a .safetensors file; without it, random weights show that everything works, not what a trained network does
"""

import ctypes
import sys
import time


class Network:
    """A network of the library. Close it, or use it in a `with` statement."""

    def __init__(self, library, weights=None, threads=0):
        # 1. Open the shared library, and say once what each function takes: ctypes would pass ints for pointers otherwise.
        self.npt = ctypes.CDLL(library)
        floats = ctypes.POINTER(ctypes.c_float)
        numbers = ctypes.POINTER(ctypes.c_uint32)
        handle = ctypes.c_void_p
        self.npt.npt_last_error.restype = ctypes.c_char_p
        self.npt.npt_describe.restype = ctypes.c_char_p
        self.npt.npt_describe.argtypes = [handle]
        self.npt.npt_open_weights.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.POINTER(handle)]
        self.npt.npt_open_random.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_uint64, ctypes.c_int,
                                             ctypes.POINTER(handle)]
        self.npt.npt_close.argtypes = [handle]
        self.npt.npt_close.restype = None
        self.npt.npt_transfer.argtypes = [handle, floats, ctypes.c_size_t, floats, ctypes.c_size_t, numbers,
                                          ctypes.c_size_t, floats]

        # 2. A handle to a network. Opening packs the weights; do it once, not for every mesh.
        self.handle = handle()
        if weights is None:
            self.check(self.npt.npt_open_random(64, 0, 1, threads, ctypes.byref(self.handle)))
        else:
            self.check(self.npt.npt_open_weights(weights.encode(), threads, ctypes.byref(self.handle)))

    def check(self, status):
        """Every failure comes as a number, and its message from the library."""
        if status != 0:
            raise RuntimeError(self.npt.npt_last_error().decode())

    def describe(self):
        return self.npt.npt_describe(self.handle).decode()

    def transfer(self, identity, pose, pose_triangles=()):
        """Flat lists of coordinates in, a flat list out. With numpy arrays of float32, pass
        array.ctypes.data_as(POINTER(c_float)) instead and copy nothing. ctypes lets go of Python's lock during the call, so
        that the tool's window keeps moving if this runs in a thread."""
        def floats(values):
            return (ctypes.c_float * len(values))(*values)
        result = (ctypes.c_float * len(identity))()
        triangles = (ctypes.c_uint32 * len(pose_triangles))(*pose_triangles)
        self.check(self.npt.npt_transfer(self.handle, floats(identity), len(identity) // 3, floats(pose), len(pose) // 3,
                                         triangles, len(pose_triangles) // 3, result))
        return list(result)

    def close(self):
        self.npt.npt_close(self.handle)
        self.handle = ctypes.c_void_p()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def box(width, height, depth):
    """The 8 corners of a box, flat, and its 12 triangles."""
    corners = [axis for x in (0, width) for y in (0, height) for z in (0, depth) for axis in (x, y, z)]
    triangles = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
    return corners, triangles


def main(arguments):
    if arguments in (["--help"], ["-h"]):
        print(__doc__)
        return 0
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 2
    with Network(*arguments) as network:
        print("network:", network.describe())
        identity, _ = box(1, 2, 1)
        pose, triangles = box(3, 1, 1)
        start = time.perf_counter()
        result = network.transfer(identity, pose, triangles)
        print(f"{len(result) // 3} vertices in {1000 * (time.perf_counter() - start):.2f} ms")
        for i in range(0, len(result), 3):
            print("  " + " ".join(f"{value:8.4f}" for value in result[i:i + 3]))
        # 3. Bad input is a message, and the program goes on.
        try:
            network.transfer(identity, pose, [0, 1, 8])
        except RuntimeError as error:
            print("refused, as it should be:", error)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (RuntimeError, OSError) as error:
        sys.exit(f"transfer.py: {error}")
