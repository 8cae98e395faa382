#!/usr/bin/env python3
"""Pose transfer from Python through npt's C ABI, with nothing but the standard library: what a plug-in of a modelling tool
does. Gives the mesh IDENTITY the pose of POSE; several poses are the frames of a sequence.

usage: transfer.py [--method auto|body|network] [--pairings N] [--mirror] [--refine] [--seed N]
                   LIBRARY WEIGHTS IDENTITY.obj POSE.obj ... OUT.obj
  LIBRARY   libnpt_c.so, which the build leaves in lib
  WEIGHTS   a .safetensors file, such as examples/weights/human.safetensors
  OUT.obj   the result; of several poses OUT_000.obj, OUT_001.obj ...
"""

import argparse
import array
import ctypes
import os
import sys
import time


METHODS = ("auto", "body", "network")  # npt_method


class Mesh(ctypes.Structure):
    """npt_mesh: a mesh in memory that stays ours. With numpy arrays, array.ctypes.data_as(POINTER(c_float)) copies nothing."""
    _fields_ = [("xyz", ctypes.POINTER(ctypes.c_float)), ("vertices", ctypes.c_size_t),
                ("triangles", ctypes.POINTER(ctypes.c_uint32)), ("triangle_count", ctypes.c_size_t),
                ("name", ctypes.c_char_p)]

    def __init__(self, xyz, triangles, name):
        """xyz: array of floats, 3 a vertex; triangles: array of unsigned ints, 3 each."""
        self.kept = xyz, triangles  # the pointers below don't keep them alive
        super().__init__((ctypes.c_float * len(xyz)).from_buffer(xyz), len(xyz) // 3,
                         (ctypes.c_uint32 * len(triangles)).from_buffer(triangles) if triangles else None,
                         len(triangles) // 3, name.encode())


class Options(ctypes.Structure):
    """npt_options, in the order of npt_c.h."""
    _fields_ = [("size", ctypes.c_size_t), ("threads", ctypes.c_int), ("pairings", ctypes.c_int), ("mirror", ctypes.c_int),
                ("refine", ctypes.c_int), ("refine_radius", ctypes.c_double), ("invariant", ctypes.c_int),
                ("pair_as_given", ctypes.c_int), ("resample", ctypes.c_int), ("unit", ctypes.c_double),
                ("seed", ctypes.c_uint64), ("method", ctypes.c_int)]


class Transfer:
    """Weights, ready to run. Close it, or use it in a `with` statement."""

    def __init__(self, library, weights, **options):
        # 1. Open the shared library, and say once what each function takes: ctypes would pass ints for pointers otherwise.
        self.npt = npt = ctypes.CDLL(os.path.abspath(library))
        handle, mesh, floats = ctypes.c_void_p, ctypes.POINTER(Mesh), ctypes.POINTER(ctypes.c_float)
        npt.npt_last_error.restype = npt.npt_describe.restype = ctypes.c_char_p
        npt.npt_describe.argtypes = [handle]
        npt.npt_default_options.argtypes = [ctypes.POINTER(Options)]
        npt.npt_open.argtypes = [ctypes.c_char_p, ctypes.POINTER(Options), ctypes.POINTER(handle)]
        npt.npt_run.argtypes = [handle, mesh, mesh, floats]
        npt.npt_prepare_identity.argtypes = [handle, mesh, ctypes.POINTER(handle)]
        npt.npt_open_sequence.argtypes = [handle, handle, ctypes.POINTER(handle)]
        npt.npt_run_frame.argtypes = [handle, mesh, floats]
        for close in (npt.npt_close, npt.npt_release_identity, npt.npt_close_sequence):
            close.argtypes, close.restype = [handle], None

        # 2. A handle to a transfer. Opening packs the weights; do it once, not for every mesh.
        own = Options()
        npt.npt_default_options(ctypes.byref(own))
        for name, value in options.items():
            setattr(own, name, value)
        self.handle = handle()
        self.check(npt.npt_open(weights.encode(), ctypes.byref(own), ctypes.byref(self.handle)))

    def check(self, status):
        """Every failure comes as a number, and its message from the library."""
        if status != 0:
            raise RuntimeError(self.npt.npt_last_error().decode())

    def describe(self):
        return self.npt.npt_describe(self.handle).decode()

    def __call__(self, identity, pose):
        """The identity's new coordinates. ctypes lets go of Python's lock during the call, so that a tool's window keeps moving
        if this runs in a thread."""
        result = array.array("f", bytes(12 * identity.vertices))
        self.check(self.npt.npt_run(self.handle, identity, pose, (ctypes.c_float * len(result)).from_buffer(result)))
        return result

    def sequence(self, identity, frames):
        """Yields the identity's coordinates in each of the frames, which share their random choices: nothing flickers."""
        prepared, sequence = ctypes.c_void_p(), ctypes.c_void_p()
        self.check(self.npt.npt_prepare_identity(self.handle, identity, ctypes.byref(prepared)))
        try:
            self.check(self.npt.npt_open_sequence(self.handle, prepared, ctypes.byref(sequence)))
            for frame in frames:
                result = array.array("f", bytes(12 * identity.vertices))
                self.check(self.npt.npt_run_frame(sequence, frame, (ctypes.c_float * len(result)).from_buffer(result)))
                yield result
        finally:
            self.npt.npt_close_sequence(sequence)
            self.npt.npt_release_identity(prepared)

    def close(self):
        self.npt.npt_close(self.handle)
        self.handle = ctypes.c_void_p()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def read_obj(path):
    """Positions and faces of an OBJ file, the faces as fans around their first corners. A modelling tool has its own meshes."""
    xyz, triangles = array.array("f"), array.array("I")
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            try:
                if words[:1] == ["v"]:
                    x, y, z = map(float, words[1:4])
                    xyz.extend((x, y, z))
                elif words[:1] == ["f"]:
                    corners = [int(word.split("/")[0]) for word in words[1:]]
                    corners = [c - 1 if c > 0 else len(xyz) // 3 + c for c in corners]
                    for i in range(1, len(corners) - 1):
                        triangles.extend((corners[0], corners[i], corners[i + 1]))
            except (ValueError, OverflowError) as error:
                raise RuntimeError(f"{path}: line {number}: {error}") from None
    if not xyz:
        raise RuntimeError(f"{path}: found no vertex, expected an OBJ file, the one kind that this example reads")
    return Mesh(xyz, triangles, path)


def write_obj(path, template, xyz):
    """The OBJ file `template` with other positions: its faces, groups and materials stay. Normals, which would be wrong, go."""
    vertex = 0
    with open(template, encoding="utf-8", errors="surrogateescape") as file:
        lines = file.readlines()
    with open(path + ".part", "w", encoding="utf-8", errors="surrogateescape") as out:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                out.write("v " + " ".join(f"{x:.9g}" for x in xyz[3 * vertex:3 * vertex + 3]) + "\n")
                vertex += 1
            elif words[:1] == ["f"]:
                corners = [word.split("/") for word in words[1:]]
                out.write("f " + " ".join("/".join(c[:2]).rstrip("/") for c in corners) + "\n")
            elif words[:1] != ["vn"]:
                out.write(line)
    os.replace(path + ".part", path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", choices=METHODS, default="auto")
    parser.add_argument("--pairings", type=int, default=1)
    parser.add_argument("--mirror", action="store_true")
    parser.add_argument("--refine", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    for name in ("library", "weights", "identity"):
        parser.add_argument(name)
    parser.add_argument("pose", nargs="+")
    parser.add_argument("out")
    a = parser.parse_args()
    options = {"method": METHODS.index(a.method), "pairings": a.pairings, "mirror": a.mirror, "refine": a.refine, "seed": a.seed}
    with Transfer(a.library, a.weights, **options) as transfer:
        print("network:", transfer.describe())
        identity = read_obj(a.identity)
        start = time.perf_counter()
        if len(a.pose) == 1:
            results = {a.out: transfer(identity, read_obj(a.pose[0]))}
        else:
            stem, extension = os.path.splitext(a.out)
            names = (f"{stem}_{i:03}{extension}" for i in range(len(a.pose)))
            results = dict(zip(names, transfer.sequence(identity, map(read_obj, a.pose))))
        print(f"{identity.vertices} vertices, {len(results)} poses in {time.perf_counter() - start:.2f} s")
    for name, xyz in results.items():
        write_obj(name, a.identity, xyz)
        print(name)


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError) as error:
        sys.exit(f"transfer.py: {error}")
