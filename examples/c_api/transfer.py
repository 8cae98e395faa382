#!/usr/bin/env python3
"""Pose transfer from Python through npt's C ABI, with nothing but the standard library: what a plug-in of a modelling tool
does. Gives the mesh IDENTITY the pose of POSE; several poses are the frames of a sequence; a .glb is a clip.

usage: transfer.py [--method auto|body|network] [--pairings N] [--mirror] [--refine] [--seed N]
                   LIBRARY WEIGHTS IDENTITY.obj POSE.obj ... OUT.obj
       transfer.py [--clip NAME] ... LIBRARY WEIGHTS IDENTITY POSE.glb OUT.glb
  LIBRARY   libnpt_c.so, which the build leaves in lib
  WEIGHTS   the folder of those that npt ships, examples/weights, for people and four-legged animals; or a .safetensors file
  OUT.obj   the result; of several poses OUT_000.obj, OUT_001.obj ...
  --clip    the clip of POSE.glb; without: its only one
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
    _fields_ = [("size", ctypes.c_size_t), ("xyz", ctypes.POINTER(ctypes.c_float)), ("vertices", ctypes.c_size_t),
                ("triangles", ctypes.POINTER(ctypes.c_uint32)), ("triangle_count", ctypes.c_size_t),
                ("name", ctypes.c_char_p)]

    def __init__(self, xyz, triangles, name):
        """xyz: array of floats, 3 a vertex; triangles: array of unsigned ints, 3 each."""
        self.kept = xyz, triangles  # the pointers below don't keep them alive
        super().__init__(ctypes.sizeof(Mesh), (ctypes.c_float * len(xyz)).from_buffer(xyz), len(xyz) // 3,
                         (ctypes.c_uint32 * len(triangles)).from_buffer(triangles) if triangles else None,
                         len(triangles) // 3, name.encode())


class BodyOptions(ctypes.Structure):
    """npt_body_options"""
    _fields_ = [("quality", ctypes.c_int), ("least_confidence", ctypes.c_double), ("high_confidence", ctypes.c_double),
                ("figure", ctypes.c_size_t)]


class NetworkOptions(ctypes.Structure):
    """npt_network_options"""
    _fields_ = [("pairing", ctypes.c_int), ("pairings", ctypes.c_int), ("mirror", ctypes.c_int), ("invariant", ctypes.c_int),
                ("resample", ctypes.c_int)]


class ImportOptions(ctypes.Structure):
    """npt_import_options"""
    _fields_ = [("unit", ctypes.c_double)]


class Options(ctypes.Structure):
    """npt_options, in the order of npt_c.h."""
    _fields_ = [("size", ctypes.c_size_t), ("version", ctypes.c_uint32), ("threads", ctypes.c_int), ("method", ctypes.c_int),
                ("body", BodyOptions), ("network", NetworkOptions), ("importing", ImportOptions), ("refine", ctypes.c_int),
                ("refine_radius", ctypes.c_double), ("seed", ctypes.c_uint64)]


class Warned(ctypes.Structure):
    """npt_warning"""
    _fields_ = [("code", ctypes.c_int), ("mesh", ctypes.c_int), ("value", ctypes.c_double), ("remedy", ctypes.c_int),
                ("words", ctypes.c_void_p)]


class Result(ctypes.Structure):
    """npt_result: how a result was made."""
    _fields_ = [("size", ctypes.c_size_t), ("method", ctypes.c_int), ("confidence", ctypes.c_double),
                ("character_confidence", ctypes.c_double), ("pose_confidence", ctypes.c_double),
                ("kind", ctypes.c_char_p), ("warning_count", ctypes.c_size_t), ("warnings", Warned * 16)]


class ClipOptions(ctypes.Structure):
    """npt_clip_options"""
    _fields_ = [("size", ctypes.c_size_t), ("clip", ctypes.c_char_p), ("fps", ctypes.c_double), ("in_place", ctypes.c_int),
                ("names", ctypes.c_int)]


class Transfer:
    """Weights, ready to run. Close it, or use it in a `with` statement."""

    def __init__(self, library, weights, method, refine, seed, **network):
        # 1. Open the shared library, and say once what each function takes: ctypes would pass ints for pointers otherwise.
        self.npt = npt = ctypes.CDLL(os.path.abspath(library))
        handle, mesh, floats, size = ctypes.c_void_p, ctypes.POINTER(Mesh), ctypes.POINTER(ctypes.c_float), ctypes.c_size_t
        out, result, text = ctypes.POINTER(handle), ctypes.POINTER(Result), ctypes.c_char_p
        npt.npt_last_error.restype = npt.npt_describe.restype = npt.npt_warning_text.restype = text
        npt.npt_describe.argtypes = [handle]
        npt.npt_warning_text.argtypes = [ctypes.POINTER(Warned), text, text]
        npt.npt_default_options.argtypes = [ctypes.POINTER(Options)]
        npt.npt_open.argtypes = npt.npt_open_shipped.argtypes = [text, ctypes.POINTER(Options), out]
        npt.npt_run.argtypes = [handle, mesh, mesh, floats, result]
        npt.npt_prepare_character.argtypes = [handle, mesh, handle, out]
        npt.npt_open_tracker.argtypes = [handle, out]
        npt.npt_start_tracker.argtypes = [handle, mesh, mesh, size, size, out]
        npt.npt_next_pose.argtypes = [handle, mesh, size, out]
        npt.npt_frames_to_try.argtypes, npt.npt_frames_to_try.restype = [size, ctypes.POINTER(size)], size
        npt.npt_apply.argtypes = [handle, handle, handle, floats, result]
        npt.npt_animate_file.argtypes = [handle, text, text, text, ctypes.POINTER(ClipOptions), handle, result]
        for close in (npt.npt_close, npt.npt_release_character, npt.npt_close_tracker):
            close.argtypes, close.restype = [handle], None

        # 2. A handle to a transfer. Opening packs the weights; do it once, not for every mesh.
        own = Options(size=ctypes.sizeof(Options))
        self.check(npt.npt_default_options(ctypes.byref(own)))
        own.method, own.refine, own.seed = METHODS.index(method), refine, seed
        for name, value in network.items():
            setattr(own.network, name, value)
        self.handle = handle()
        open_weights = npt.npt_open_shipped if os.path.isdir(weights) else npt.npt_open
        self.check(open_weights(weights.encode(), ctypes.byref(own), ctypes.byref(self.handle)))

    def check(self, status):
        """Every failure comes as a number, and its message from the library."""
        if status != 0:
            raise RuntimeError(self.npt.npt_last_error().decode())

    def warn(self, result, identity, pose):
        for warning in result.warnings[:result.warning_count]:
            print("warning:", self.npt.npt_warning_text(ctypes.byref(warning), identity, pose).decode(), file=sys.stderr)

    def describe(self):
        return self.npt.npt_describe(self.handle).decode()

    def __call__(self, identity, pose):
        """The identity's new coordinates. ctypes lets go of Python's lock during the call, so that a tool's window keeps moving
        if this runs in a thread."""
        result = Result(size=ctypes.sizeof(Result))
        xyz = array.array("f", bytes(12 * identity.vertices))
        self.check(self.npt.npt_run(self.handle, identity, pose, (ctypes.c_float * len(xyz)).from_buffer(xyz),
                                    ctypes.byref(result)))
        self.warn(result, identity.name, pose.name)
        return xyz

    def sequence(self, identity, files):
        """Yields the identity's coordinates in each of the frames. Bodies are followed from frame to frame, and the network's
        random choices are made once: nothing flickers."""
        npt, character, tracker, pose = self.npt, ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p()
        self.check(npt.npt_prepare_character(self.handle, identity, None, ctypes.byref(character)))
        try:
            self.check(npt.npt_open_tracker(self.handle, ctypes.byref(tracker)))
            # Where the first frame is recognised with a low confidence, the sequence starts from a better one.
            numbers = (ctypes.c_size_t * 3)()
            others = [read_obj(files[numbers[i]]) for i in range(npt.npt_frames_to_try(len(files), numbers))]
            for i, file in enumerate(files):
                frame = read_obj(file)
                if i == 0:
                    self.check(npt.npt_start_tracker(tracker, frame, (Mesh * len(others))(*others), len(others),
                                                     identity.vertices, ctypes.byref(pose)))
                else:
                    self.check(npt.npt_next_pose(tracker, frame, identity.vertices, ctypes.byref(pose)))
                xyz = array.array("f", bytes(12 * identity.vertices))
                result = Result(size=ctypes.sizeof(Result))
                self.check(npt.npt_apply(self.handle, character, pose, (ctypes.c_float * len(xyz)).from_buffer(xyz),
                                         ctypes.byref(result)))
                self.warn(result, identity.name, frame.name)
                yield xyz
        finally:
            npt.npt_close_tracker(tracker)
            npt.npt_release_character(character)

    def animate(self, identity, pose, out, clip=None):
        """A clip of a .glb onto the identity, from file to file."""
        options = ClipOptions(ctypes.sizeof(ClipOptions), clip and clip.encode())
        result = Result(size=ctypes.sizeof(Result))
        self.check(self.npt.npt_animate_file(self.handle, identity.encode(), pose.encode(), out.encode(), ctypes.byref(options),
                                             None, ctypes.byref(result)))
        self.warn(result, identity.encode(), pose.encode())

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
    parser.add_argument("--clip")
    for name in ("library", "weights", "identity"):
        parser.add_argument(name)
    parser.add_argument("pose", nargs="+")
    parser.add_argument("out")
    a = parser.parse_args()
    with Transfer(a.library, a.weights, a.method, a.refine, a.seed, pairings=a.pairings, mirror=a.mirror) as transfer:
        print("network:", transfer.describe())
        if a.out.endswith(".glb"):
            if len(a.pose) != 1:
                raise RuntimeError(f"{a.out}: found {len(a.pose)} poses, expected one .glb with a clip")
            transfer.animate(a.identity, a.pose[0], a.out, a.clip)
            print(a.out)
            return
        identity = read_obj(a.identity)
        start = time.perf_counter()
        if len(a.pose) == 1:
            results = {a.out: transfer(identity, read_obj(a.pose[0]))}
        else:
            stem, extension = os.path.splitext(a.out)
            names = (f"{stem}_{i:03}{extension}" for i in range(len(a.pose)))
            results = dict(zip(names, transfer.sequence(identity, a.pose)))
        print(f"{identity.vertices} vertices, {len(results)} poses in {time.perf_counter() - start:.2f} s")
    for name, xyz in results.items():
        write_obj(name, a.identity, xyz)
        print(name)


if __name__ == "__main__":
    try:
        main()
    except (RuntimeError, OSError) as error:
        sys.exit(f"transfer.py: {error}")
