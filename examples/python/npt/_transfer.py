"""PoseTransfer, which makes characters, poses and results, and the tracker of a sequence's poses."""

from __future__ import annotations

import ctypes
import operator
import os
import threading
import warnings
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from ._library import (
    CClipOptions,
    CMeasures,
    CMesh,
    Control,
    COptions,
    CResult,
    Error,
    Handle,
    call,
    library,
    package_folder,
)
from ._meshes import Borrowed, MeshLike, floats, result_for
from ._prepared import JOINTS, Character, Owned, Pose, TrackedFrame
from ._results import Measures, Result, measures_of, result_of

METHODS = {"automatic": 0, "body": 1, "network": 2}
QUALITIES = {"fast": 0, "balanced": 1, "best": 2}
PAIRINGS = {"random": 0, "as_given": 1}
JOINT_NAMES = {"vrm": 0, "mixamo": 1, "smpl": 2}
UNITS = {"metre": 1.0, "centimetre": 0.01, "millimetre": 0.001, "inch": 0.0254, "foot": 0.3048}

PathLike = Union[str, "os.PathLike[str]"]
Progress = Optional[Callable[[float], object]]
Stop = Optional[Callable[[], object]]


def weights_folders() -> "list[Path]":
    named = os.environ.get("NPT_WEIGHTS")
    return ([Path(named)] if named else []) + [package_folder() / "weights"]


def shipped_weights() -> "list[str]":
    """The names that PoseTransfer knows: human, human-pooled, quadruped."""
    return sorted({file.stem for folder in weights_folders() for file in folder.glob("*.safetensors")})


def _weights_file(weights: Union[str, "os.PathLike[str]"]) -> Path:
    if isinstance(weights, str) and not weights.endswith(".safetensors") and not set(weights) & {"/", os.sep}:
        for folder in weights_folders():
            if (folder / f"{weights}.safetensors").is_file():
                return folder / f"{weights}.safetensors"
        raise Error(
            f"weights: found {weights!r}, expected one of {', '.join(shipped_weights())}, or a .safetensors file"
        )
    try:
        return Path(weights)
    except TypeError:
        raise Error(f"weights: found {weights!r}, expected a name or the path of a .safetensors file") from None


def _whole(value: Any, name: str, least: int, most: int) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if not least <= number <= most:
        raise Error(
            f"{name}: found {value!r}, expected a whole number from {least}" + (f" to {most}" if most < 2**31 else "")
        )
    return number


def _positive(value: Any, name: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = 0.0
    if not 0 < number < float("inf"):
        raise Error(f"{name}: found {value!r}, expected a number above 0")
    return number


def _confidence(value: Any, name: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if not 0 <= number <= 1:
        raise Error(f"{name}: found {value!r}, expected a number from 0 to 1")
    return number


def _choice(value: Any, name: str, known: "dict[str, int]") -> int:
    if value not in known:
        raise Error(f"{name}: found {value!r}, expected one of {', '.join(known)}")
    return known[value]


class PoseTransfer:
    """Weights, ready to run: transfer(identity, pose) is the identity mesh in the pose mesh's pose.

    Meshes are npt.Mesh, (vertices, faces), anything with .vertices and .faces such as trimesh.Trimesh, or vertices
    alone. In any order, of any vertex count, in any place, in metres, centimetres or millimetres. Contiguous float32
    vertices and 32-bit faces are used where they lie; others are converted.

    Any number of threads may use one at a time; Python's lock is let go during each call.

    weights           None: those that npt ships for people and four-legged animals, of which the animals' are read
                      when a mesh isn't surely a person. Or a name of npt.shipped_weights(), such as "human"; the path
                      of a .safetensors file; or a list of several, each a domain
    method            "automatic": by body estimation, which refuses what it doesn't recognise, or by the network
                      where the weights hold no body estimation; "body", "network"
    quality           of body estimation: "fast", "balanced", "best"
    least_confidence  0 to 1: from this confidence on a mesh counts as recognised; None: 0.6
    high_confidence   0 to 1: from this confidence on there is no warning of a low one; None: 0.85
    figure            of several figures in one mesh this one, from 1 on, the one with the most vertices first; a mesh
                      of one figure is taken whole. 0: the one that is recognised
    pairing           how the network meets vertices: "random"; "as_given": by number, to compare with other
                      implementations
    pairings          the mean over so many random pairings of vertices; costs as many runs of the network
    mirror            also transfer the mirror images, and average; for symmetric subjects; twice the runs
    invariant         permuting a mesh's vertices permutes the result bit for bit
    resample          False: refuse a pose mesh of another vertex count where the network pairs vertices
    unit              of the meshes: "metre", "centimetre", "millimetre", "inch", "foot", or metres; None: inferred from
                      size
    refine            give results the identity's surface detail; needs its faces
    refine_radius     detail below this fraction of the root of the mesh's area; None: as the weights say
    seed              of every random choice
    threads           0: all that the process may use. Several transfers at a time: 1

    Raises npt.Error for bad input; warns with npt.TransferWarning of what may be wrong.
    """

    def __init__(
        self,
        weights: Union[None, PathLike, Sequence[PathLike]] = None,
        *,
        method: str = "automatic",
        quality: str = "balanced",
        least_confidence: Optional[float] = None,
        high_confidence: Optional[float] = None,
        figure: int = 0,
        pairing: str = "random",
        pairings: int = 1,
        mirror: bool = False,
        invariant: bool = False,
        resample: bool = True,
        unit: Union[None, str, float] = None,
        refine: bool = False,
        refine_radius: Optional[float] = None,
        seed: int = 0,
        threads: int = 0,
    ):
        options = COptions(size=ctypes.sizeof(COptions))
        call("npt_default_options", ctypes.byref(options))
        options.method = _choice(method, "method", METHODS)
        options.threads = _whole(threads, "threads", 0, 4096)
        options.seed = _whole(seed, "seed", 0, 2**64 - 1)
        options.body.quality = _choice(quality, "quality", QUALITIES)
        if least_confidence is not None:
            options.body.least_confidence = _confidence(least_confidence, "least_confidence")
        if high_confidence is not None:
            options.body.high_confidence = _confidence(high_confidence, "high_confidence")
        options.body.figure = _whole(figure, "figure", 0, 2**31 - 1)
        network = options.network
        network.pairing = _choice(pairing, "pairing", PAIRINGS)
        network.pairings = _whole(pairings, "pairings", 1, 2**31 - 1)
        network.mirror, network.invariant = bool(mirror), bool(invariant)
        network.resample = bool(resample)
        if isinstance(unit, str) and unit not in UNITS:
            raise Error(f"unit: found {unit!r}, expected one of {', '.join(UNITS)}, or metres")
        options.import_unit = 0 if unit is None else UNITS[unit] if isinstance(unit, str) else _positive(unit, "unit")
        options.refine = bool(refine)
        options.refine_radius = 0 if refine_radius is None else _positive(refine_radius, "refine_radius")
        if weights is None:
            # The animals' network is asked for by its name alone: it takes meshes of another size than people's.
            by_network = method == "network" or pairing == "as_given"
            weights = ["human"] + [name for name in shipped_weights() if name == "quadruped" and not by_network]
        several = list(weights) if isinstance(weights, (list, tuple)) else [weights]
        files = [str(_weights_file(file)).encode() for file in several]
        self._handle: Optional[Owned] = Owned("npt_close")
        self._handle.refines = bool(refine)  # type: ignore[attr-defined]
        paths = (ctypes.c_char_p * len(files))(*files)
        call("npt_open_files", paths, len(files), ctypes.byref(options), self._handle.out)

    @property
    def _open(self) -> Owned:
        if self._handle is None:
            raise Error("transfer: found one that was closed, expected an open one")
        return self._handle

    def close(self) -> None:
        """Lets go of the weights; what was prepared keeps them until it goes, too."""
        self._handle = None

    def __enter__(self) -> "PoseTransfer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def description(self) -> str:
        """Such as "bottleneck 256, conv_relu, per-vertex, people by body estimation, quadrupeds by body estimation"."""
        return str(library().npt_describe(self._open.handle).decode())

    def __repr__(self) -> str:
        return "npt.PoseTransfer(closed)" if self._handle is None else f"npt.PoseTransfer({self.description})"

    def __call__(
        self,
        identity: Union[MeshLike, Character],
        pose: Union[MeshLike, Pose],
        *,
        out: Optional[NDArray[np.float32]] = None,
    ) -> NDArray[np.float32]:
        """The identity's vertices [V, 3], float32, in the pose mesh's pose: in its own order, unit and place.

        identity, pose  meshes, or what character() and pose() made of them
        out             where to write the result: contiguous float32 [V, 3]; may be the identity's own memory
        """
        result = self.apply(identity, pose, out=out)
        for warning in result.warnings:
            warnings.warn(warning, stacklevel=2)
        assert result.vertices is not None
        return result.vertices

    def apply(
        self,
        character: Union[MeshLike, Character],
        pose: Union[MeshLike, Pose],
        *,
        out: Optional[NDArray[np.float32]] = None,
    ) -> Result:
        """The character in the pose, how it was made, and what to know of it. out: as for a call"""
        raw = CResult(size=ctypes.sizeof(CResult))
        if not isinstance(character, Character) and not isinstance(pose, Pose):
            own, posed = Borrowed(character, "identity"), Borrowed(pose, "pose")
            vertices = result_for(len(own), out)
            call("npt_run", self._open.handle, own.pointer, posed.pointer, vertices.ctypes.data, ctypes.byref(raw))
            return result_of(raw, own.name, posed.name, vertices, own.faces)
        hero, taken = self._prepared(character, pose)
        vertices = result_for(len(hero), out)
        call("npt_apply", self._open.handle, hero._handle, taken._handle, vertices.ctypes.data, ctypes.byref(raw))
        return result_of(raw, hero._name, taken._name, vertices, hero.faces)

    def report(self, character: Union[MeshLike, Character], pose: Union[MeshLike, Pose]) -> Result:
        """How apply() will make its result: a Result without vertices."""
        raw = CResult(size=ctypes.sizeof(CResult))
        hero, taken = self._prepared(character, pose)
        call("npt_report", self._open.handle, hero._handle, taken._handle, ctypes.byref(raw))
        return result_of(raw, hero._name, taken._name)

    def measure(self, character: Union[MeshLike, Character], pose: Union[MeshLike, Pose], result: Result) -> Measures:
        """Stretch, penetration and coverage of a result that apply() made, in 26 ms for 6890 vertices."""
        raw = CMeasures(size=ctypes.sizeof(CMeasures))
        hero, taken = self._prepared(character, pose)
        vertices = floats(result.vertices, "result")
        if len(vertices) != len(hero):
            raise Error(f"result: found {len(vertices)} vertices, expected {len(hero)}, as many as the character has")
        call("npt_measure", self._open.handle, hero._handle, taken._handle, vertices.ctypes.data, ctypes.byref(raw))
        return measures_of(raw)

    def character(self, identity: MeshLike, *, progress: Progress = None, stop: Stop = None) -> Character:
        """A character that takes many poses, estimated and bound once.

        progress, stop  called with the fraction that is done; asked whether to end the work, which raises npt.Stopped
        """
        mesh, control = Borrowed(identity, "identity"), Control(progress, stop)
        owned = Owned("npt_release_character")
        control.call("npt_prepare_character", self._open.handle, mesh.pointer, control.pointer, owned.out)
        return Character(self._open, owned, mesh.name, mesh.faces)

    def load_character(self, file: PathLike) -> Character:
        """A character that Character.save wrote, for the same weights."""
        owned = Owned("npt_release_character")
        call("npt_load_character", self._open.handle, os.fspath(file).encode(), owned.out)
        return Character(self._open, owned, str(os.fspath(file)))

    def pose(self, pose: MeshLike, vertices: int = 0, *, progress: Progress = None, stop: Stop = None) -> Pose:
        """A pose for many characters, estimated once.

        vertices        of the characters, which the network wants to know; 0: any number, but it runs anew each time
        progress, stop  as character() has them
        """
        mesh, control = Borrowed(pose, "pose"), Control(progress, stop)
        count = _whole(vertices, "vertices", 0, 2**28)
        owned = Owned("npt_release_pose")
        control.call("npt_prepare_pose", self._open.handle, mesh.pointer, count, control.pointer, owned.out)
        return Pose(self._open, owned, mesh.name)

    def prepare(self, identity: MeshLike, pose: MeshLike) -> "tuple[Character, Pose]":
        """Both meshes of a pair, estimated side by side."""
        own, posed = Borrowed(identity, "identity"), Borrowed(pose, "pose")
        character, taken = Owned("npt_release_character"), Owned("npt_release_pose")
        call("npt_prepare", self._open.handle, own.pointer, posed.pointer, character.out, taken.out)
        return Character(self._open, character, own.name, own.faces), Pose(self._open, taken, posed.name)

    def sequence(self, character: Union[MeshLike, Character], frames: Iterable[MeshLike]) -> Iterator[Result]:
        """The character in each frame's pose, one after another, as `npt transfer` takes a folder of poses.
        Of a list of frames, the tracker may start from another one than the first; an iterator's are taken one by
        one."""
        hero, tracker = self._character(character), PoseTracker(self)
        tries = frames_to_try(len(frames)) if isinstance(frames, Sequence) else []
        others = [frames[k] for k in tries]  # type: ignore[index]

        def results() -> Iterator[Result]:
            for i, frame in enumerate(frames):
                pose = tracker.next(frame, len(hero)) if i else tracker.start(frame, others, len(hero))
                yield self.apply(hero, pose)

        return results()

    def motions(
        self, character: Union[MeshLike, Character], pose: Union[MeshLike, Pose]
    ) -> Optional[NDArray[np.float64]]:
        """How the joints of the character's skeleton move to a pose: [J, 3, 4], a rotation and a shift each. Vertices
        that move by these and the skin weights are the result. None: the network makes it."""
        hero, taken = self._prepared(character, pose)
        if self.report(hero, taken).method != "body":
            return None
        motions = np.full((JOINTS, 3, 4), np.nan)
        call("npt_move_joints", self._open.handle, hero._handle, taken._handle, motions.ctypes.data)
        return motions[~np.isnan(motions[:, 0, 0])]

    def _character(self, character: Union[MeshLike, Character]) -> Character:
        if not isinstance(character, Character):
            return self.character(character)
        if character._open is not self._open:
            raise Error("identity: found one that another transfer prepared, expected this one's", "foreign")
        return character

    def _prepared(
        self, character: Union[MeshLike, Character], pose: Union[MeshLike, Pose]
    ) -> "tuple[Character, Pose]":
        if not isinstance(character, Character) and not isinstance(pose, Pose):
            return self.prepare(character, pose)
        hero = self._character(character)
        if not isinstance(pose, Pose):
            return hero, self.pose(pose, len(hero))
        if pose._open is not self._open:
            raise Error("pose: found one that another transfer prepared, expected this one's", "foreign")
        return hero, pose


def frames_to_try(frames: int) -> "list[int]":
    """Which frames of a sequence are worth a try for its start, beside the first."""
    numbers = (ctypes.c_size_t * 3)()
    return list(numbers[: library().npt_frames_to_try(frames, numbers)])


class PoseTracker:
    """The poses of a sequence, frame after frame: bodies are followed, and the network's random choices are made once, so
    that nothing flickers. A mesh with other faces begins another sequence. One thread at a time.

        tracker = npt.PoseTracker(transfer)
        for frame in frames:
            result = transfer.apply(hero, tracker.next(frame, len(hero)))
    """

    def __init__(self, transfer: PoseTransfer):
        self._open = transfer._open  # the tracker goes before the transfer does
        self._owned, self._lock, self._frames = Owned("npt_close_tracker"), threading.Lock(), [0]
        call("npt_open_tracker", self._open.handle, self._owned.out)

    def next(self, frame: MeshLike, vertices: int) -> Pose:
        """The next frame's pose, for characters of so many vertices. Valid until the next call."""
        mesh = Borrowed(frame, "pose")
        count = _whole(vertices, "vertices", 0, 2**28)
        return self._pose(mesh, "npt_next_pose", mesh.pointer, count)

    def start(self, first: MeshLike, others: Iterable[MeshLike], vertices: int) -> Pose:
        """The first frame of a sequence of which other meshes with the same faces are known, such as further frames
        (npt.frames_to_try) or a rig at rest. Where the first isn't recognised with high confidence, the sequence is
        followed from the best of them."""
        mesh, known = Borrowed(first, "pose"), [Borrowed(other, "pose") for other in others]
        count = _whole(vertices, "vertices", 0, 2**28)
        array = (CMesh * len(known))(*(other.c for other in known))
        return self._pose(mesh, "npt_start_tracker", mesh.pointer, array, len(known), count)

    def restart(self) -> None:
        """The next mesh is the first frame of another sequence."""
        with self._lock:
            self._frames[0] += 1
            library().npt_restart_tracker(self._owned.handle)

    def _pose(self, mesh: Borrowed, function: str, *arguments: Any) -> Pose:
        pointer = Handle()
        with self._lock:
            self._frames[0] += 1
            call(function, self._owned.handle, *arguments, ctypes.byref(pointer))
            return Pose(self._open, TrackedFrame(self._owned, self._frames, pointer), mesh.name)


def animate(
    transfer: PoseTransfer,
    identity: PathLike,
    pose: PathLike,
    out: PathLike,
    *,
    clip: Optional[str] = None,
    fps: float = 30,
    in_place: bool = False,
    names: str = "vrm",
    progress: Progress = None,
    stop: Stop = None,
) -> Result:
    """Puts a clip onto an identity, from files to a .glb that moves, as `npt transfer --clip` does: on a skeleton where
    every frame is made by body estimation, else with morph targets. Returns the report of the frame with the lowest
    confidence.

    identity        .obj, .ply, .glb or .gltf
    pose            .glb or .gltf with a clip
    clip            its name; None: the only one
    fps             frames a second, 0.001 to 1000
    in_place        the root joint stays in its place instead of following the pose's root trajectory
    names           of the joints: "vrm", "mixamo", "smpl"
    progress, stop  as PoseTransfer.character has them
    """
    options = CClipOptions(ctypes.sizeof(CClipOptions), None if clip is None else clip.encode(), _positive(fps, "fps"))
    options.in_place, options.names = bool(in_place), _choice(names, "names", JOINT_NAMES)
    files = [str(os.fspath(file)) for file in (identity, pose, out)]
    control, raw = Control(progress, stop), CResult(size=ctypes.sizeof(CResult))
    control.call(
        "npt_animate_file",
        transfer._open.handle,
        *(file.encode() for file in files),
        ctypes.byref(options),
        control.pointer,
        ctypes.byref(raw),
    )
    return result_of(raw, files[0], files[1])
