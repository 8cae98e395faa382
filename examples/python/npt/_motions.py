"""Motions: skeletons and the curves that move them, put onto the joints of characters."""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable, NamedTuple, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from ._library import (
    CBytes,
    CFile,
    CMotionData,
    CMotionFrames,
    CMotionInfo,
    CMotionOptions,
    CMotionReport,
    Control,
    Error,
    call,
    filled,
    library,
)
from ._prepared import Character, Owned
from ._transfer import JOINT_NAMES, Progress, Stop, _choice, _positive

ROLES = 64
REST_POSES = ("T", "A", "arms down", "other")
ROOT_MOTIONS = {"keep": 0, "extract": 1}
FORMATS = {"rig": 0, "bvh": 1, "bone_map": 2}
MOTION_WARNING_CODES = ("joints_uncertain", "joints_missing")

#: A path, or the bytes of a .glb, .vrm, .bvh, or of a .gltf that names no files.
FileLike = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview]
#: The text of a bone map, a pathlib.Path of one, or a dict from roles to joints' names, None for nobody's.
BoneMap = Union[None, str, "os.PathLike[str]", "dict[str, Optional[str]]"]


class JointRole(NamedTuple):
    """Which joint has a role."""

    joint: int  #: its number
    name: str
    confidence: float  #: 0 to 1


@dataclass(frozen=True)
class MotionFrames:
    """Joints over time."""

    times: NDArray[np.float64]  #: [F] seconds
    translations: NDArray[np.float32]  #: [F, J, 3] in their parents, in the joints' own numbers
    rotations: NDArray[np.float32]  #: [F, J, 4] in their parents: x, y, z, w
    scales: NDArray[np.float32]  #: [F, J, 3] in their parents
    positions: NDArray[np.float32]  #: [F, J, 3] in metres with y up


class MotionWarning(UserWarning):
    """What to know before using a result.

    code      "joints_uncertain": which joint is which is uncertain; "joints_missing": main joints that only the other
              skeleton has
    skeleton  "character" or "motion"
    value     a confidence from 0 to 1 (joints_uncertain); else 0
    roles     the missing joints' (joints_missing)
    """

    def __init__(self, code: str, skeleton: str, value: float, roles: "tuple[str, ...]", text: str):
        super().__init__(text)
        self.code, self.skeleton, self.value, self.roles, self.text = code, skeleton, value, roles, text


class Motion:
    """A skeleton and the curves that move its joints, or a skeleton alone. From read_motion, read_skeleton or
    make_motion. Any number of threads may use one.

    name        of its file, for messages
    names       of the joints, parents before children
    parents     [J] int32, -1: a root
    nodes       [J] int32, the joints' nodes in a glTF file; -1: none
    clip        the clip's name; "" for a skeleton alone
    clips       the names of all clips of its file
    length      seconds; 0: a skeleton alone, or a single pose
    rate        frames a second on which all keys lie; None: keys of their own, or none
    unit        metres in one of the joints' own numbers
    up          the axis of the joints' own numbers that points up: "y", "-z" ...
    base        [3, 4] from the roots' coordinates to metres with y up
    rest_pose   in which the skeleton is bound: "T", "A", "arms down", "other"
    dialect     of the joints' names: "Mixamo, HumanIK" ...; "" where none is known
    confidence  0 to 1: that it is a person's or a four-legged animal's skeleton
    four_legged  whether it is an animal's
    root_joint  which joint takes the body over the ground; None: in place
    root_shift  [3] of the hips from the first to the last frame, in metres
    notes       what was repaired in its file
    """

    confidence: float

    def __init__(self, owned: Owned, name: str):
        self._owned, self.name = owned, name
        self.notes = last_notes()
        own = filled(CMotionInfo, "npt_describe_motion", owned.handle)
        count = own.joints
        self.names = [own.names[j].decode("utf-8", "replace") for j in range(count)]
        self.parents: NDArray[np.int32] = np.ctypeslib.as_array(own.parents, (count,)).copy()
        self.nodes: NDArray[np.int32] = np.ctypeslib.as_array(own.nodes, (count,)).copy()
        self.clip = own.clip.decode("utf-8", "replace")
        self.clips = [own.clips[i].decode("utf-8", "replace") for i in range(own.clip_count)]
        self.length, self.rate = own.length, own.rate or None
        self.unit, self.up = own.unit, own.up.decode()
        self.base = np.array(own.base, np.float64).reshape(3, 4)
        self.rest_pose = REST_POSES[own.rest_pose]
        self.dialect = own.dialect.decode()
        self.confidence, self.four_legged = own.confidence, own.four_legged != 0
        self.root_joint = None if own.root_joint < 0 else self.names[own.root_joint]
        self.root_shift = np.array(own.root_shift, np.float64)
        self._frames: Optional[MotionFrames] = None

    def __repr__(self) -> str:
        clip = f"clip {self.clip!r}, {self.length:g} s" if self.clip or self.length else "no clip"
        return f"npt.{type(self).__name__}({self.name}, {len(self.names)} joints, {clip})"

    def __len__(self) -> int:
        """Joints."""
        return len(self.names)

    @property
    def roles(self) -> "dict[str, JointRole]":
        """Which joint is which, by VRM's names of bones: "hips", "leftUpperArm" ..., with a confidence each. An animal's
        forelegs have the roles of arms."""
        joints, confidences = (ctypes.c_int32 * ROLES)(), (ctypes.c_double * ROLES)()
        call("npt_motion_roles", self._owned.handle, joints, confidences)
        return {
            role_name(r): JointRole(joints[r], self.names[joints[r]], confidences[r])
            for r in range(ROLES)
            if joints[r] >= 0
        }

    def bone_map(self) -> str:
        """The roles as a text to be corrected, which `npt info --bones` prints, too."""
        return self.to_bytes("bone_map").decode()

    def frame_times(self, fps: Optional[float] = None) -> NDArray[np.float64]:
        """[F] 0, 1 / fps, ... to the clip's end. fps None: the clip's own rate, or 30."""
        rate, count = 0.0 if fps is None else _positive(fps, "fps"), ctypes.c_size_t()
        call("npt_frame_times", self._owned.handle, rate, ctypes.byref(count), None)
        times = np.empty(count.value)
        call("npt_frame_times", self._owned.handle, rate, ctypes.byref(count), times.ctypes.data)
        return times

    def sample(self, times: Any = None, *, fps: Optional[float] = None) -> MotionFrames:
        """The joints at these seconds; None: at frame_times(fps)."""
        if times is None:
            times = self.frame_times(fps)
        moments = np.require(np.atleast_1d(times), np.float64, ["C", "A"])
        if moments.ndim != 1 or not np.isfinite(moments).all():
            raise Error("times: found other values, expected an array [F] of finite seconds")
        return self._sampled(moments)

    def rest(self) -> MotionFrames:
        """The joints at rest, as one frame."""
        return self._sampled(None)

    def _sampled(self, times: Optional[NDArray[np.float64]]) -> MotionFrames:
        count = 1 if times is None else len(times)
        made = [np.empty((count, len(self), width), np.float32) for width in (3, 4, 3, 3)]
        raw = CMotionFrames(ctypes.sizeof(CMotionFrames), *(array.ctypes.data for array in made))
        pointer = None if times is None else times.ctypes.data
        call("npt_sample_motion", self._owned.handle, pointer, count, ctypes.byref(raw))
        return MotionFrames(np.zeros(1) if times is None else times, *made)

    def _own_frames(self) -> MotionFrames:
        if self._frames is None:
            self._frames = self.sample()
        return self._frames

    @property
    def times(self) -> NDArray[np.float64]:
        """[F] seconds, of the frames at the clip's own rate, or 30 a second."""
        return self._own_frames().times

    @property
    def translations(self) -> NDArray[np.float32]:
        """[F, J, 3] of these frames, in the parents."""
        return self._own_frames().translations

    @property
    def rotations(self) -> NDArray[np.float32]:
        """[F, J, 4] of these frames, in the parents: x, y, z, w."""
        return self._own_frames().rotations

    @property
    def positions(self) -> NDArray[np.float32]:
        """[F, J, 3] of these frames, in metres with y up."""
        return self._own_frames().positions

    def to_bytes(self, format: str = "rig") -> bytes:
        """What save() writes, or another text of it.

        format  "rig": of a result, the character's file with the clip; "bvh"; "bone_map"
        """
        pointer = ctypes.POINTER(CBytes)()
        call("npt_motion_bytes", self._owned.handle, _choice(format, "format", FORMATS), ctypes.byref(pointer))
        try:
            return ctypes.string_at(pointer.contents.data, pointer.contents.count)
        finally:
            library().npt_close_bytes(pointer)

    def save(self, file: Union[str, "os.PathLike[str]"]) -> "tuple[str, ...]":
        """Writes .bvh, or of a result .glb, .gltf and .vrm: the character's file with the clip behind its own, all else
        as it was. Returns notes, such as of a name that was taken."""
        return save_motions([self], file)


class MotionResult(Motion):
    """A motion on a character's own joints.

    confidence  the lower of both skeletons', that they are people's
    warnings    what to know of it; empty: nothing
    """

    def __init__(self, owned: Owned, name: str, confidence: float, warnings: "tuple[MotionWarning, ...]"):
        super().__init__(owned, name)
        self.confidence, self.warnings = confidence, warnings


def role_name(role: int) -> str:
    return str(library().npt_role_name(role).decode())


def last_notes() -> "tuple[str, ...]":
    return tuple(library().npt_last_notes().decode("utf-8", "replace").splitlines())


def reads_fbx() -> bool:
    """Whether the library in use reads .fbx and .dae, too (libnpt_c_fbx)."""
    return bool(library().npt_reads_fbx())


class _File:
    """A file of the caller's as npt_file, which points into it."""

    def __init__(self, file: FileLike, name: str):
        if isinstance(file, (bytes, bytearray, memoryview)):
            self._kept = bytes(file)
            self.name, path, data, count = name, None, self._kept, len(self._kept)
        else:
            try:
                self.name = str(os.fspath(file))
            except TypeError:
                raise Error(f"{name}: found {file!r}, expected a path or bytes") from None
            path, data, count = self.name.encode(), None, 0
        self.c = CFile(ctypes.sizeof(CFile), path, data, count)

    @property
    def pointer(self) -> Any:
        return ctypes.byref(self.c)


def _bone_map(given: BoneMap) -> Optional[bytes]:
    if given is None:
        return None
    if isinstance(given, dict):
        joints = {role: "-" if joint is None else f'"{joint}"' for role, joint in given.items()}
        return "".join(f"{role} {joint}\n" for role, joint in joints.items()).encode()
    if isinstance(given, str):
        return given.encode()
    try:
        return Path(given).read_bytes()
    except TypeError:
        raise Error(f"bone_map: found {given!r}, expected its text, a pathlib.Path or a dict") from None


def _text(value: Optional[str]) -> Optional[bytes]:
    return None if value is None else value.encode()


def read_motion(file: FileLike, clip: Optional[str] = None, *, bone_map: BoneMap = None) -> Motion:
    """A clip of a file, with or without a mesh.

    file      .glb, .gltf, .vrm or .bvh; .fbx and .dae where npt.reads_fbx(); or bytes
    clip      its name; None: the only one
    bone_map  which joint is which, where it is found wrongly
    """
    given, owned = _File(file, "motion"), Owned("npt_release_motion")
    call("npt_read_motion", given.pointer, _text(clip), _bone_map(bone_map), owned.out)
    return Motion(owned, given.name)


def read_skeleton(file: FileLike, *, bone_map: BoneMap = None) -> Motion:
    """The skeleton of a character's file, to be given to transfer_motion for several clips. As read_motion."""
    given, owned = _File(file, "character"), Owned("npt_release_motion")
    call("npt_read_skeleton", given.pointer, _bone_map(bone_map), owned.out)
    return Motion(owned, given.name)


def _array(values: Any, name: str, dtype: Any, shape: "tuple[int, ...]") -> Optional[NDArray[Any]]:
    if values is None:
        return None
    try:
        array = np.require(values, dtype, ["C", "A"])
    except (TypeError, ValueError):
        raise Error(f"{name}: found other values, expected an array {list(shape)} of numbers") from None
    if array.shape != shape:
        raise Error(f"{name}: found shape {list(array.shape)}, expected {list(shape)}")
    return array


def make_motion(
    names: Sequence[str],
    parents: Any,
    rest_translations: Any,
    rest_rotations: Any = None,
    *,
    rest_scales: Any = None,
    base: Any = None,
    times: Any = None,
    translations: Any = None,
    rotations: Any = None,
    name: str = "motion",
    clip: Optional[str] = None,
    bone_map: BoneMap = None,
) -> Motion:
    """A motion of arrays, such as an engine's; without translations and rotations a skeleton.

    names              of the joints
    parents            [J] a joint's number, before its own; -1: a root
    rest_translations  [J, 3] in their parents, as the skin is bound: a T pose, an A pose or another one
    rest_rotations     [J, 4] x, y, z, w; None: none
    rest_scales        [J, 3]; None: 1
    base               [3, 4] from the roots' coordinates to metres with y up; None: they are in these
    times              [F] seconds, ascending, from 0 on; None: at 30 frames a second
    translations       [F, J, 3]; None: as at rest
    rotations          [F, J, 4]; None: as at rest
    name, clip         what messages call it; the clip's name
    """
    joints, moving = len(names), next((x for x in (rotations, translations, times) if x is not None), ())
    frames, kept = len(moving), [str(joint).encode() for joint in names]
    arrays = [
        _array(rest_translations, "rest_translations", np.float32, (joints, 3)),
        _array(rest_rotations, "rest_rotations", np.float32, (joints, 4)),
        _array(rest_scales, "rest_scales", np.float32, (joints, 3)),
        _array(base, "base", np.float64, (3, 4)),
        _array(times, "times", np.float64, (frames,)),
        _array(translations, "translations", np.float32, (frames, joints, 3)),
        _array(rotations, "rotations", np.float32, (frames, joints, 4)),
    ]
    above = _array(parents, "parents", np.int32, (joints,))
    if above is None or arrays[0] is None:
        raise Error("parents, rest_translations: found None, expected arrays")
    pointers = [None if array is None else array.ctypes.data for array in arrays]
    raw = CMotionData(
        ctypes.sizeof(CMotionData),
        name.encode(),
        _text(clip),
        joints,
        (ctypes.c_char_p * joints)(*kept),
        above.ctypes.data,
        *pointers[:4],
        frames,
        *pointers[4:],
    )
    owned = Owned("npt_release_motion")
    call("npt_make_motion", ctypes.byref(raw), _bone_map(bone_map), owned.out)
    return Motion(owned, name)


def _warnings(report: CMotionReport, character: str, motion: str) -> "tuple[MotionWarning, ...]":
    made = []
    for raw in report.warnings[: report.warning_count]:
        text = library().npt_motion_warning_text(ctypes.byref(raw), character.encode(), motion.encode())
        made.append(
            MotionWarning(
                MOTION_WARNING_CODES[raw.code],
                "motion" if raw.skeleton else "character",
                raw.value,
                tuple(role_name(r) for r in range(ROLES) if raw.roles >> r & 1),
                text.decode("utf-8", "replace"),
            )
        )
    return tuple(made)


def _skeleton_of(character: Union[FileLike, Motion, Character], bone_map: BoneMap, names: str) -> Motion:
    if isinstance(character, (Motion, Character)) and bone_map is not None:
        raise Error("bone_map: found one beside a character that was read, expected it in read_skeleton")
    if isinstance(character, Motion):
        return character
    if isinstance(character, Character):
        owned, called = Owned("npt_release_motion"), _choice(names, "names", JOINT_NAMES)
        call("npt_motion_of_character", character._open.handle, character._handle, called, owned.out)
        return Motion(owned, character._name)
    return read_skeleton(character, bone_map=bone_map)


def _fraction(value: Any, name: str, most: float = 1) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if not 0 <= number <= most:
        raise Error(f"{name}: found {value!r}, expected a number from 0" + (f" to {most:g}" if most < 1e9 else " on"))
    return number


def transfer_motion(
    character: Union[FileLike, Motion, Character],
    motion: Union[FileLike, Motion],
    *,
    clip: Optional[str] = None,
    clip_name: Optional[str] = None,
    bone_map: BoneMap = None,
    motion_bone_map: BoneMap = None,
    time: Optional[float] = None,
    apply: bool = False,
    fps: Optional[float] = None,
    foot_lock: bool = True,
    clearance: float = 1.0,
    touch: bool = True,
    in_place: bool = False,
    root_motion: str = "keep",
    twist: bool = True,
    key_tolerance: float = 1e-4,
    names: str = "vrm",
    progress: Progress = None,
    stop: Stop = None,
) -> MotionResult:
    """A motion on a character's own joints: npt.transfer_motion("hero.glb", "walk.bvh").save("hero_walk.glb").

    character        a rigged file (.glb, .gltf, .vrm; .fbx where npt.reads_fbx()) or its bytes; a Motion from
                     read_skeleton or make_motion; or a recognised Character of PoseTransfer, whose result gets a
                     skeleton of 40 joints
    motion           a clip's file or bytes, or a Motion
    clip             the clip's name in its file; None: the only one
    clip_name        of the result; None: the clip's
    bone_map         of the character's file: which joint is which, where it is found wrongly
    motion_bone_map  of the motion's file
    time             the pose at this second, as a clip of one key, instead of the clip
    apply            with a time: the pose becomes the rest of the joints, and no clip
    fps              keys at so many frames a second; None: at the clip's own times
    foot_lock        feet that stand in the clip are held
    clearance        0 to 1: how far arms and thighs are kept out of the body
    touch            hands that touch the own body in the clip touch it
    in_place         the way over the ground is left out
    root_motion      which joint takes the body over the ground: "keep", the hips; "extract", the joint without parent
    twist            twist joints take their share
    key_tolerance    metres, at a height of 1.75 m, by which keys may be left out; 0: none is
    names            of a Character's joints: "vrm", "mixamo", "smpl"
    progress, stop   called with the fraction that is done; asked whether to end the work, which raises npt.Stopped

    Raises npt.Error, such as with code "not_recognised" for a skeleton that is no person's.
    """
    options = CMotionOptions(size=ctypes.sizeof(CMotionOptions))
    call("npt_default_motion_options", ctypes.byref(options))
    options.clip_name = _text(clip_name)
    options.time = -1 if time is None else _fraction(time, "time", 1e9)
    if apply and time is None:
        raise Error("apply: found no time, expected time=SECONDS: the pose that becomes the rest")
    options.fps = 0 if fps is None else _positive(fps, "fps")
    options.apply, options.foot_lock, options.touch = bool(apply), bool(foot_lock), bool(touch)
    options.in_place, options.twist = bool(in_place), bool(twist)
    options.clearance = _fraction(clearance, "clearance")
    options.key_tolerance = _fraction(key_tolerance, "key_tolerance", 1e9)
    options.root_motion = _choice(root_motion, "root_motion", ROOT_MOTIONS)
    control = Control(progress, stop)
    control.step(0)
    hero = _skeleton_of(character, bone_map, names)
    control.step(0.3)
    if isinstance(motion, Motion):
        if clip is not None or motion_bone_map is not None:
            raise Error("clip, motion_bone_map: found beside a motion that was read, expected in read_motion")
        source = motion
    else:
        source = read_motion(motion, clip, bone_map=motion_bone_map)
    control.step(0.5)
    owned, report = Owned("npt_release_motion"), CMotionReport(size=ctypes.sizeof(CMotionReport))
    call(
        "npt_transfer_motion",
        hero._owned.handle,
        source._owned.handle,
        ctypes.byref(options),
        owned.out,
        ctypes.byref(report),
    )
    control.step(1)
    return MotionResult(owned, hero.name, report.confidence, _warnings(report, hero.name, source.name))


def save_motions(motions: Iterable[Motion], file: Union[str, "os.PathLike[str]"]) -> "tuple[str, ...]":
    """Writes several results of one character into one .glb, .gltf or .vrm. Returns notes, as Motion.save does."""
    given = list(motions)
    handles = (ctypes.c_void_p * len(given))(*(motion._owned.handle for motion in given))
    call("npt_write_motions", handles, len(given), str(os.fspath(file)).encode())
    return last_notes()
