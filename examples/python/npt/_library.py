"""The C ABI (examples/c_api/npt_c.h) by ctypes, which lets go of Python's lock during every call."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Any, Callable, Optional

Handle = ctypes.c_void_p
HandleOut = ctypes.POINTER(ctypes.c_void_p)

ERROR_CODES = {
    1: "bad_input",
    2: "not_recognised",
    3: "unknown_unit",
    4: "missing_weights",
    5: "foreign",
    6: "domains_differ",
    7: "needs_recognition",
    8: "stopped",
    100: "argument",
    102: "internal",
}
REMEDIES = ("none", "look_at_result", "choose_method", "give_unit", "give_weights")
ADVICE = {
    "none": "",
    "look_at_result": "look at the result before using it",
    "choose_method": 'method="network" gives the network\'s result all the same, method="body" that of body estimation',
    "give_unit": "PoseTransfer(unit=...) sets the unit",
    "give_weights": 'put them beside the others, or use method="network"',
}


class Error(ValueError):
    """Bad input, in the library's words: which argument or file, what was found, what was expected.

    code    such as "bad_input", "not_recognised", "unknown_unit", "missing_weights", "foreign",
            "domains_differ", "needs_recognition"
    remedy  what a user can do: "none", "look_at_result", "choose_method", "give_unit", "give_weights"
    """

    def __init__(self, text: str, code: str = "bad_input", remedy: str = "none"):
        super().__init__(text + (f" ({ADVICE[remedy]})" if ADVICE[remedy] else ""))
        self.code, self.remedy = code, remedy


class Stopped(Error):
    """`stop` asked to end the work."""


class CMesh(ctypes.Structure):
    """npt_mesh"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("xyz", ctypes.c_void_p),
        ("vertices", ctypes.c_size_t),
        ("triangles", ctypes.c_void_p),
        ("triangle_count", ctypes.c_size_t),
        ("name", ctypes.c_char_p),
    ]


class CBodyOptions(ctypes.Structure):
    """npt_body_options"""

    _fields_ = [
        ("quality", ctypes.c_int),
        ("least_confidence", ctypes.c_double),
        ("high_confidence", ctypes.c_double),
        ("figure", ctypes.c_size_t),
    ]


class CNetworkOptions(ctypes.Structure):
    """npt_network_options"""

    _fields_ = [
        ("pairing", ctypes.c_int),
        ("pairings", ctypes.c_int),
        ("mirror", ctypes.c_int),
        ("invariant", ctypes.c_int),
        ("resample", ctypes.c_int),
    ]


class COptions(ctypes.Structure):
    """npt_options"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("version", ctypes.c_uint32),
        ("threads", ctypes.c_int),
        ("method", ctypes.c_int),
        ("body", CBodyOptions),
        ("network", CNetworkOptions),
        ("import_unit", ctypes.c_double),  # npt_import_options
        ("refine", ctypes.c_int),
        ("refine_radius", ctypes.c_double),
        ("seed", ctypes.c_uint64),
    ]


class CWarning(ctypes.Structure):
    """npt_warning"""

    _fields_ = [
        ("code", ctypes.c_int),
        ("mesh", ctypes.c_int),
        ("value", ctypes.c_double),
        ("remedy", ctypes.c_int),
        ("words", ctypes.c_void_p),
    ]


class CResult(ctypes.Structure):
    """npt_result"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("method", ctypes.c_int),
        ("confidence", ctypes.c_double),
        ("character_confidence", ctypes.c_double),
        ("pose_confidence", ctypes.c_double),
        ("kind", ctypes.c_char_p),
        ("warning_count", ctypes.c_size_t),
        ("warnings", CWarning * 16),
    ]


class CMeasures(ctypes.Structure):
    """npt_measures"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("common_stretch", ctypes.c_double),
        ("largest_stretch", ctypes.c_double),
        ("stretched_vertex", ctypes.c_size_t),
        ("penetration", ctypes.c_double),
        ("character_coverage", ctypes.c_double),
        ("pose_coverage", ctypes.c_double),
    ]


class CEstimate(ctypes.Structure):
    """npt_estimate"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("recognised", ctypes.c_int),
        ("confidence", ctypes.c_double),
        ("unit", ctypes.c_double),
        ("domain", ctypes.c_char_p),
        ("kind", ctypes.c_char_p),
        ("warning_count", ctypes.c_size_t),
        ("warnings", CWarning * 16),
    ]


class CJointPose(ctypes.Structure):
    """npt_joint_pose"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("joints", ctypes.c_size_t),
        ("axis_angles", ctypes.c_float * 120),
        ("root", ctypes.c_double * 3),
        ("leg", ctypes.c_double),
    ]


class CSkeleton(ctypes.Structure):
    """npt_skeleton"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("joints", ctypes.c_size_t),
        ("names", ctypes.POINTER(ctypes.c_char_p)),
        ("parents", ctypes.POINTER(ctypes.c_int32)),
        ("places", ctypes.POINTER(ctypes.c_double)),
        ("vertices", ctypes.c_size_t),
        ("start", ctypes.POINTER(ctypes.c_size_t)),
        ("influences", ctypes.c_void_p),
    ]


class CClipOptions(ctypes.Structure):
    """npt_clip_options"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("clip", ctypes.c_char_p),
        ("fps", ctypes.c_double),
        ("in_place", ctypes.c_int),
        ("names", ctypes.c_int),
    ]


class CFile(ctypes.Structure):
    """npt_file"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("path", ctypes.c_char_p),
        ("bytes", ctypes.c_char_p),
        ("byte_count", ctypes.c_size_t),
    ]


class CMotionData(ctypes.Structure):
    """npt_motion_data"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("name", ctypes.c_char_p),
        ("clip", ctypes.c_char_p),
        ("joints", ctypes.c_size_t),
        ("names", ctypes.POINTER(ctypes.c_char_p)),
        ("parents", ctypes.c_void_p),
        ("rest_translations", ctypes.c_void_p),
        ("rest_rotations", ctypes.c_void_p),
        ("rest_scales", ctypes.c_void_p),
        ("base", ctypes.c_void_p),
        ("frames", ctypes.c_size_t),
        ("times", ctypes.c_void_p),
        ("translations", ctypes.c_void_p),
        ("rotations", ctypes.c_void_p),
    ]


class CMotionInfo(ctypes.Structure):
    """npt_motion_info"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("joints", ctypes.c_size_t),
        ("names", ctypes.POINTER(ctypes.c_char_p)),
        ("parents", ctypes.POINTER(ctypes.c_int32)),
        ("nodes", ctypes.POINTER(ctypes.c_int32)),
        ("clip", ctypes.c_char_p),
        ("length", ctypes.c_double),
        ("rate", ctypes.c_double),
        ("clip_count", ctypes.c_size_t),
        ("clips", ctypes.POINTER(ctypes.c_char_p)),
        ("unit", ctypes.c_double),
        ("up", ctypes.c_char_p),
        ("base", ctypes.c_double * 12),
        ("rest_pose", ctypes.c_int),
        ("dialect", ctypes.c_char_p),
        ("confidence", ctypes.c_double),
        ("root_joint", ctypes.c_int32),
        ("root_shift", ctypes.c_double * 3),
        ("four_legged", ctypes.c_int32),
    ]


class CMotionFrames(ctypes.Structure):
    """npt_motion_frames"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("translations", ctypes.c_void_p),
        ("rotations", ctypes.c_void_p),
        ("scales", ctypes.c_void_p),
        ("positions", ctypes.c_void_p),
    ]


class CMotionOptions(ctypes.Structure):
    """npt_motion_options"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("version", ctypes.c_uint32),
        ("clip", ctypes.c_char_p),
        ("character_bone_map", ctypes.c_char_p),
        ("motion_bone_map", ctypes.c_char_p),
        ("clip_name", ctypes.c_char_p),
        ("time", ctypes.c_double),
        ("apply", ctypes.c_int),
        ("fps", ctypes.c_double),
        ("foot_lock", ctypes.c_int),
        ("clearance", ctypes.c_double),
        ("touch", ctypes.c_int),
        ("in_place", ctypes.c_int),
        ("root_motion", ctypes.c_int),
        ("twist", ctypes.c_int),
        ("key_tolerance", ctypes.c_double),
    ]


class CMotionWarning(ctypes.Structure):
    """npt_motion_warning"""

    _fields_ = [
        ("code", ctypes.c_int),
        ("skeleton", ctypes.c_int),
        ("value", ctypes.c_double),
        ("roles", ctypes.c_uint64),
        ("four_legged", ctypes.c_int32),
    ]


class CMotionReport(ctypes.Structure):
    """npt_motion_report"""

    _fields_ = [
        ("size", ctypes.c_size_t),
        ("clips", ctypes.c_size_t),
        ("confidence", ctypes.c_double),
        ("warning_count", ctypes.c_size_t),
        ("warnings", CMotionWarning * 16),
    ]


class CBytes(ctypes.Structure):
    """npt_bytes"""

    _fields_ = [("size", ctypes.c_size_t), ("data", ctypes.c_void_p), ("count", ctypes.c_size_t)]


PROGRESS = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p)
STOP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)


class CControl(ctypes.Structure):
    """npt_control"""

    _fields_ = [("size", ctypes.c_size_t), ("progress", PROGRESS), ("stop", STOP), ("user", ctypes.c_void_p)]


TEXT = ctypes.c_char_p
MESH = ctypes.POINTER(CMesh)
OPTIONS = ctypes.POINTER(COptions)
CONTROL = ctypes.POINTER(CControl)
RESULT = ctypes.POINTER(CResult)
ESTIMATE = ctypes.POINTER(CEstimate)
JOINT_POSE = ctypes.POINTER(CJointPose)
FLOATS = ctypes.c_void_p
DOUBLES = ctypes.c_void_p
SIZES = ctypes.POINTER(ctypes.c_size_t)
FILE = ctypes.POINTER(CFile)

# What each function takes; all of these return a status.
ARGUMENTS: dict[str, list[Any]] = {
    "npt_default_options": [OPTIONS],
    "npt_open_files": [ctypes.POINTER(TEXT), ctypes.c_size_t, OPTIONS, HandleOut],
    "npt_run": [Handle, MESH, MESH, FLOATS, RESULT],
    "npt_prepare": [Handle, MESH, MESH, HandleOut, HandleOut],
    "npt_prepare_character": [Handle, MESH, CONTROL, HandleOut],
    "npt_prepare_pose": [Handle, MESH, ctypes.c_size_t, CONTROL, HandleOut],
    "npt_character_save": [Handle, TEXT],
    "npt_load_character": [Handle, TEXT, HandleOut],
    "npt_character_mesh": [Handle, MESH],
    "npt_character_estimate": [Handle, ESTIMATE],
    "npt_pose_estimate": [Handle, ESTIMATE],
    "npt_character_joints": [Handle, JOINT_POSE],
    "npt_pose_joints": [Handle, JOINT_POSE],
    "npt_apply": [Handle, Handle, Handle, FLOATS, RESULT],
    "npt_report": [Handle, Handle, Handle, RESULT],
    "npt_measure": [Handle, Handle, Handle, FLOATS, ctypes.POINTER(CMeasures)],
    "npt_open_tracker": [Handle, HandleOut],
    "npt_next_pose": [Handle, MESH, ctypes.c_size_t, HandleOut],
    "npt_start_tracker": [Handle, MESH, MESH, ctypes.c_size_t, ctypes.c_size_t, HandleOut],
    "npt_open_skeleton": [Handle, ctypes.POINTER(ctypes.POINTER(CSkeleton))],
    "npt_move_joints": [Handle, Handle, Handle, DOUBLES],
    "npt_animate_file": [Handle, TEXT, TEXT, TEXT, ctypes.POINTER(CClipOptions), CONTROL, RESULT],
    "npt_read_skeleton": [FILE, TEXT, HandleOut],
    "npt_read_motion": [FILE, TEXT, TEXT, HandleOut],
    "npt_make_motion": [ctypes.POINTER(CMotionData), TEXT, HandleOut],
    "npt_motion_of_character": [Handle, Handle, ctypes.c_int, HandleOut],
    "npt_describe_motion": [Handle, ctypes.POINTER(CMotionInfo)],
    "npt_motion_roles": [Handle, ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_double)],
    "npt_frame_times": [Handle, ctypes.c_double, SIZES, DOUBLES],
    "npt_sample_motion": [Handle, DOUBLES, ctypes.c_size_t, ctypes.POINTER(CMotionFrames)],
    "npt_default_motion_options": [ctypes.POINTER(CMotionOptions)],
    "npt_transfer_motion": [Handle, Handle, ctypes.POINTER(CMotionOptions), HandleOut, ctypes.POINTER(CMotionReport)],
    "npt_write_motions": [HandleOut, ctypes.c_size_t, TEXT],
    "npt_motion_bytes": [Handle, ctypes.c_int, ctypes.POINTER(ctypes.POINTER(CBytes))],
}
# And what the others take and return.
OTHERS: dict[str, "tuple[list[Any], Any]"] = {
    "npt_version": ([], TEXT),
    "npt_last_error": ([], TEXT),
    "npt_last_error_code": ([], ctypes.c_int),
    "npt_last_remedy": ([], ctypes.c_int),
    "npt_warning_text": ([ctypes.POINTER(CWarning), TEXT, TEXT], TEXT),
    "npt_describe": ([Handle], TEXT),
    "npt_frames_to_try": ([ctypes.c_size_t, SIZES], ctypes.c_size_t),
    "npt_restart_tracker": ([Handle], None),
    "npt_close": ([Handle], None),
    "npt_release_character": ([Handle], None),
    "npt_release_pose": ([Handle], None),
    "npt_close_tracker": ([Handle], None),
    "npt_reads_fbx": ([], ctypes.c_int),
    "npt_last_notes": ([], TEXT),
    "npt_role_name": ([ctypes.c_int], TEXT),
    "npt_motion_warning_text": ([ctypes.POINTER(CMotionWarning), TEXT, TEXT], TEXT),
    "npt_release_motion": ([Handle], None),
    "npt_close_bytes": ([ctypes.POINTER(CBytes)], None),
    "npt_close_skeleton": ([ctypes.POINTER(CSkeleton)], None),
}
STATUS_NO_MEMORY, STATUS_STOPPED = 3, 5

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
        for name, (arguments, result) in OTHERS.items():
            function = getattr(opened, name)
            function.argtypes, function.restype = arguments, result
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
    code = ERROR_CODES.get(npt.npt_last_error_code(), "bad_input")
    raise (Stopped if status == STATUS_STOPPED else Error)(message, code, REMEDIES[npt.npt_last_remedy()])


def filled(structure: Any, name: str, handle: Any) -> Any:
    """A struct that a function of the library fills."""
    value = structure(size=ctypes.sizeof(structure))
    call(name, handle, ctypes.byref(value))
    return value


class Control:
    """Progress and stop as the library calls them. What they raise ends the work, and is raised again behind it."""

    def __init__(self, progress: Optional[Callable[[float], object]], stop: Optional[Callable[[], object]]):
        self._progress, self._stop = progress, stop
        self._raised: Optional[BaseException] = None
        self.c = CControl(ctypes.sizeof(CControl), PROGRESS(self._show), STOP(self._ask), None)

    def _show(self, done: float, _: object) -> None:
        try:
            if self._progress is not None and self._raised is None:
                self._progress(done)
        except BaseException as error:
            self._raised = error

    def _ask(self, _: object) -> int:
        try:
            return int(self._raised is not None or (self._stop is not None and bool(self._stop())))
        except BaseException as error:
            self._raised = error
            return 1

    @property
    def pointer(self) -> Any:
        """NULL where nothing is to be called."""
        return None if self._progress is None and self._stop is None else ctypes.byref(self.c)

    def step(self, done: float) -> None:
        """Between steps of work that the package does itself."""
        if self._stop is not None and self._stop():
            raise Stopped("work: found a request to stop", "stopped")
        if self._progress is not None:
            self._progress(done)

    def call(self, name: str, *arguments: Any) -> None:
        try:
            call(name, *arguments)
        finally:
            if self._raised is not None:
                raise self._raised


def version() -> str:
    """The library's version."""
    return str(library().npt_version().decode())
