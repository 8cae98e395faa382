"""The C ABI (examples/c_api/npt_c.h) by ctypes, which lets go of Python's lock during every call."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Any, Optional

Handle = ctypes.c_void_p
HandleOut = ctypes.POINTER(ctypes.c_void_p)


class Error(ValueError):
    """What can't be done right, in the library's words: which argument or file, what was found, what was expected."""


class CMesh(ctypes.Structure):
    """npt_mesh"""

    _fields_ = [
        ("xyz", ctypes.c_void_p),
        ("vertices", ctypes.c_size_t),
        ("triangles", ctypes.c_void_p),
        ("triangle_count", ctypes.c_size_t),
        ("name", ctypes.c_char_p),
    ]


class COptions(ctypes.Structure):
    """npt_options"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("threads", ctypes.c_int),
        ("pairings", ctypes.c_int),
        ("mirror", ctypes.c_int),
        ("refine", ctypes.c_int),
        ("refine_radius", ctypes.c_double),
        ("invariant", ctypes.c_int),
        ("pair_as_given", ctypes.c_int),
        ("resample", ctypes.c_int),
        ("unit", ctypes.c_double),
        ("seed", ctypes.c_uint64),
        ("method", ctypes.c_int),
    ]


class CReport(ctypes.Structure):
    """npt_report"""

    _fields_ = [("method", ctypes.c_int), ("identity_confidence", ctypes.c_double), ("pose_confidence", ctypes.c_double)]


class CSkeleton(ctypes.Structure):
    """npt_skeleton"""

    _fields_ = [
        ("joints", ctypes.c_size_t),
        ("names", ctypes.POINTER(ctypes.c_char_p)),
        ("parents", ctypes.POINTER(ctypes.c_int32)),
        ("places", ctypes.POINTER(ctypes.c_double)),
        ("vertices", ctypes.c_size_t),
        ("start", ctypes.POINTER(ctypes.c_size_t)),
        ("influences", ctypes.c_void_p),
    ]


MESH = ctypes.POINTER(CMesh)
FLOATS = ctypes.c_void_p
DOUBLES = ctypes.c_void_p
SKELETON_OUT = ctypes.POINTER(ctypes.POINTER(CSkeleton))

# What each function takes; all of these return a status.
ARGUMENTS: dict[str, list[Any]] = {
    "npt_open": [ctypes.c_char_p, ctypes.POINTER(COptions), HandleOut],
    "npt_run": [Handle, MESH, MESH, FLOATS],
    "npt_prepare": [Handle, MESH, MESH, HandleOut, HandleOut],
    "npt_prepare_identity": [Handle, MESH, HandleOut],
    "npt_prepare_pose": [Handle, MESH, ctypes.c_size_t, HandleOut],
    "npt_explain": [Handle, Handle, Handle, ctypes.POINTER(CReport)],
    "npt_run_prepared": [Handle, Handle, Handle, FLOATS],
    "npt_open_sequence": [Handle, Handle, HandleOut],
    "npt_run_frame": [Handle, MESH, FLOATS],
    "npt_explain_frame": [Handle, ctypes.POINTER(CReport)],
    "npt_open_skeleton": [Handle, Handle, SKELETON_OUT],
    "npt_move_joints": [Handle, Handle, Handle, DOUBLES],
    "npt_move_frame_joints": [Handle, DOUBLES],
}
STATUS_BAD_ARGUMENT, STATUS_NO_MEMORY = 1, 3

_library: Optional[ctypes.CDLL] = None


def package_folder() -> Path:
    return Path(__file__).resolve().parent


def library_file() -> Path:
    """The shared library in use: the package's own, or the one that the environment names (NPT_LIBRARY)."""
    named = os.environ.get("NPT_LIBRARY")
    return Path(named) if named else package_folder() / "lib" / "libnpt_c.so"


def library() -> ctypes.CDLL:
    """Opened with the first call."""
    global _library
    if _library is None:
        file = library_file()
        try:
            opened = ctypes.CDLL(str(file))
        except OSError as error:
            raise Error(
                f"{file}: found a library that can't be opened ({error}), expected npt's for this system"
            ) from None
        for name, arguments in ARGUMENTS.items():
            function = getattr(opened, name)
            function.argtypes, function.restype = arguments, ctypes.c_int
        for name in ("npt_version", "npt_last_error", "npt_last_notes"):
            getattr(opened, name).restype = ctypes.c_char_p
        opened.npt_describe.argtypes, opened.npt_describe.restype = [Handle], ctypes.c_char_p
        opened.npt_default_options.argtypes, opened.npt_default_options.restype = [ctypes.POINTER(COptions)], None
        for name in ("npt_close", "npt_release_identity", "npt_release_pose", "npt_close_sequence"):
            getattr(opened, name).argtypes, getattr(opened, name).restype = [Handle], None
        opened.npt_close_skeleton.argtypes = [ctypes.POINTER(CSkeleton)]
        opened.npt_close_skeleton.restype = None
        _library = opened
    return _library


def call(name: str, *arguments: Any) -> None:
    """Calls a function that returns a status. The message is the calling thread's, so it is fetched at once."""
    npt = library()
    status = getattr(npt, name)(*arguments)
    if status == 0:
        return
    message = npt.npt_last_error().decode("utf-8", "replace")
    if status == STATUS_NO_MEMORY:
        raise MemoryError(message)
    raise Error(message)


def version() -> str:
    """The library's version."""
    return str(library().npt_version().decode())
