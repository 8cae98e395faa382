"""PoseTransfer and what it prepares."""

from __future__ import annotations

import ctypes
import operator
import os
import threading
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray

from ._library import COptions, CReport, CSkeleton, Error, Handle, call, library, package_folder
from ._meshes import Borrowed, MeshLike, result_for

METHODS = {"automatic": 0, "body": 1, "network": 2}
UNITS = {"metre": 1.0, "centimetre": 0.01, "millimetre": 0.001, "inch": 0.0254, "foot": 0.3048}
JOINTS = 40  # SMPL's 24 and those of the fingers
INFLUENCE = np.dtype({"names": ["joint", "weight"], "formats": ["u2", "f4"], "offsets": [0, 4], "itemsize": 8})


class TransferWarning(UserWarning):
    """What to know before using a result, such as a mesh that is not recognised as a person."""


@dataclass(frozen=True)
class Report:
    """How a transfer is made, and how sure it is."""

    method: str  #: "body" or "network"
    identity_confidence: Optional[float]  #: 0 to 1: that it is a person, and was estimated rightly; None: no body was estimated
    pose_confidence: Optional[float]
    notes: "tuple[str, ...]"  #: what to know before using the result


@dataclass(frozen=True)
class Rig:
    """A skeleton and skin weights for an identity, in its own unit, place and pose. Joints have no rotation of their own."""

    names: "list[str]"  #: as VRM calls them: "hips", "leftUpperLeg" ...
    parents: NDArray[np.int32]  #: [J] int32, -1: the root; parents stand before children
    places: NDArray[np.float64]  #: [J, 3] float64
    start: NDArray[np.uint64]  #: [V + 1] where a vertex's influences begin
    joints: NDArray[np.uint16]  #: [N] uint16, of each influence
    weights: NDArray[np.float32]  #: [N] float32; a vertex's sum to 1

    def weight_matrix(self) -> NDArray[np.float32]:
        """[V, J] float32"""
        matrix = np.zeros((len(self.start) - 1, len(self.names)), np.float32)
        vertex = np.repeat(np.arange(len(self.start) - 1), np.diff(self.start).astype(np.int64))
        np.add.at(matrix, (vertex, self.joints), self.weights)
        return matrix


class _Owned:
    """A handle of the library's, released with the last reference."""

    def __init__(self, release: str):
        self.handle = Handle()
        self._release = getattr(library(), release)

    @property
    def out(self) -> Any:
        return ctypes.byref(self.handle)

    def __del__(self) -> None:
        if getattr(self, "handle", None):
            self._release(self.handle)


class Identity:
    """An identity that takes many poses: what depends on it alone, computed once. Any number of threads may use it."""

    def __init__(self, open_: _Owned, owned: _Owned, vertices: int):
        self._open, self._owned, self._vertices = open_, owned, vertices

    def __len__(self) -> int:
        """Vertices."""
        return self._vertices


class Pose:
    """A pose that many identities take. Any number of threads may use it."""

    def __init__(self, open_: _Owned, owned: _Owned):
        self._open, self._owned = open_, owned


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


class PoseTransfer:
    """Weights, ready to run: transfer(identity, pose) is the identity mesh in the pose mesh's pose.

    Meshes are npt.Mesh, (vertices, faces), anything with .vertices and .faces such as trimesh.Trimesh, or vertices alone. In
    any order, of any vertex count, in any place, in metres, centimetres or millimetres. Contiguous float32 vertices and 32-bit
    faces are used where they lie; others are converted.

    Any number of threads may use one at a time; Python's lock is let go during each call.

    weights        "human" (the default), another name of npt.shipped_weights(), or the path of a .safetensors file
    method         "automatic": by body estimation where both meshes are recognised, else by the network; "body", "network"
    pairings       the mean over so many random pairings of vertices; costs as many runs of the network
    mirror         also transfer the mirror images, and average; for symmetric subjects; twice the runs
    refine         give results the identity's surface detail; needs its faces
    refine_radius  detail below this share of the root of the mesh's area; None: as the weights say
    invariant      permuting a mesh's vertices permutes the result bit for bit
    pair_as_given  meet vertices by number instead of at random: to compare with other implementations
    resample       False: refuse a pose mesh of another vertex count where the network pairs vertices
    unit           of the meshes: "metre", "centimetre", "millimetre", "inch", "foot", or metres; None: inferred from their size
    seed           of every random choice
    threads        0: all that the process may use. Several transfers at a time: 1

    Raises npt.Error for what can't be done right; warns with npt.TransferWarning of what may be wrong.
    """

    def __init__(
        self,
        weights: Union[str, "os.PathLike[str]"] = "human",
        *,
        method: str = "automatic",
        pairings: int = 1,
        mirror: bool = False,
        refine: bool = False,
        refine_radius: Optional[float] = None,
        invariant: bool = False,
        pair_as_given: bool = False,
        resample: bool = True,
        unit: Union[None, str, float] = None,
        seed: int = 0,
        threads: int = 0,
    ):
        options = COptions()
        library().npt_default_options(ctypes.byref(options))
        if method not in METHODS:
            raise Error(f"method: found {method!r}, expected one of {', '.join(METHODS)}")
        if isinstance(unit, str) and unit not in UNITS:
            raise Error(f"unit: found {unit!r}, expected one of {', '.join(UNITS)}, or metres")
        options.threads = _whole(threads, "threads", 0, 4096)
        options.pairings = _whole(pairings, "pairings", 1, 2**31 - 1)
        options.seed = _whole(seed, "seed", 0, 2**64 - 1)
        options.mirror, options.refine, options.invariant = bool(mirror), bool(refine), bool(invariant)
        options.pair_as_given, options.resample = bool(pair_as_given), bool(resample)
        options.refine_radius = 0 if refine_radius is None else _positive(refine_radius, "refine_radius")
        options.unit = 0 if unit is None else UNITS[unit] if isinstance(unit, str) else _positive(unit, "unit")
        options.method = METHODS[method]
        self._by_network = method == "network" or (pair_as_given and method == "automatic")
        self._handle: Optional[_Owned] = _Owned("npt_close")
        call("npt_open", str(_weights_file(weights)).encode(), ctypes.byref(options), self._handle.out)

    @property
    def _open(self) -> _Owned:
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
        """Such as "bottleneck 256, conv_relu, per-vertex, 4 pairings"."""
        return str(library().npt_describe(self._open.handle).decode())

    def __repr__(self) -> str:
        return "npt.PoseTransfer(closed)" if self._handle is None else f"npt.PoseTransfer({self.description})"

    def __call__(
        self,
        identity: Union[MeshLike, Identity],
        pose: Union[MeshLike, Pose],
        *,
        out: Optional[NDArray[np.float32]] = None,
    ) -> NDArray[np.float32]:
        """The identity's vertices [V, 3], float32, in the pose mesh's pose: in its own order, unit and place.

        identity, pose  meshes, or what prepare_identity and prepare_pose made of them
        out             where to write the result: contiguous float32 [V, 3]; may be the identity's own memory
        """
        if self._by_network and not isinstance(identity, Identity) and not isinstance(pose, Pose):
            own, posed = Borrowed(identity, "identity"), Borrowed(pose, "pose")
            result = result_for(len(own), out)
            call("npt_run", self._open.handle, own.pointer, posed.pointer, result.ctypes.data)
            return result
        prepared, taken = self._prepared(identity, pose)
        result = result_for(len(prepared), out)
        self._warn(self._explain(prepared, taken))
        call("npt_run_prepared", self._open.handle, prepared._owned.handle, taken._owned.handle, result.ctypes.data)
        return result

    def prepare_identity(self, identity: MeshLike) -> Identity:
        """An identity that takes many poses, read once."""
        mesh = Borrowed(identity, "identity")
        owned = _Owned("npt_release_identity")
        call("npt_prepare_identity", self._open.handle, mesh.pointer, owned.out)
        return Identity(self._open, owned, len(mesh))

    def prepare_pose(self, pose: MeshLike, vertices: int) -> Pose:
        """A pose for identities of so many vertices; the number doesn't matter to weights with the pooled feature."""
        mesh = Borrowed(pose, "pose")
        owned = _Owned("npt_release_pose")
        count = _whole(vertices, "vertices", 0, 2**28)
        call("npt_prepare_pose", self._open.handle, mesh.pointer, count, owned.out)
        return Pose(self._open, owned)

    def prepare(self, identity: MeshLike, pose: MeshLike) -> "tuple[Identity, Pose]":
        """Both meshes of a pair, read side by side."""
        own, posed = Borrowed(identity, "identity"), Borrowed(pose, "pose")
        identity_owned, pose_owned = _Owned("npt_release_identity"), _Owned("npt_release_pose")
        call("npt_prepare", self._open.handle, own.pointer, posed.pointer, identity_owned.out, pose_owned.out)
        return Identity(self._open, identity_owned, len(own)), Pose(self._open, pose_owned)

    def open_sequence(self, identity: Union[MeshLike, Identity]) -> "Sequence":
        """Frames one after another, whose random choices are made once, so that nothing flickers."""
        return Sequence(self, self._identity(identity))

    def sequence(self, identity: Union[MeshLike, Identity], poses: Iterable[MeshLike]) -> Iterator[NDArray[np.float32]]:
        """The identity in each frame's pose, one after another."""
        frames = self.open_sequence(identity)
        return (frames(pose) for pose in poses)

    def explain(self, identity: Union[MeshLike, Identity], pose: Union[MeshLike, Pose]) -> Report:
        """How a pair is transferred, and how sure that is."""
        prepared, taken = self._prepared(identity, pose)
        return self._explain(prepared, taken)

    def rig(self, identity: Union[MeshLike, Identity]) -> Rig:
        """A skeleton and skin weights for a person's mesh."""
        prepared = self._identity(identity)
        pointer = ctypes.POINTER(CSkeleton)()
        call("npt_open_skeleton", self._open.handle, prepared._owned.handle, ctypes.byref(pointer))
        try:
            c = pointer.contents
            start = np.ctypeslib.as_array(c.start, (c.vertices + 1,)).copy()
            raw = ctypes.string_at(c.influences, int(start[-1]) * INFLUENCE.itemsize)
            influences = np.frombuffer(raw, INFLUENCE)
            return Rig(
                [c.names[j].decode() for j in range(c.joints)],
                np.ctypeslib.as_array(c.parents, (c.joints,)).copy(),
                np.ctypeslib.as_array(c.places, (c.joints * 3,)).reshape(-1, 3).copy(),
                start,
                influences["joint"].copy(),
                influences["weight"].copy(),
            )
        finally:
            library().npt_close_skeleton(pointer)

    def motions(self, identity: Union[MeshLike, Identity], pose: Union[MeshLike, Pose]) -> NDArray[np.float64]:
        """How the rig's joints move to a pose: [J, 3, 4], a rotation and a shift each. Vertices that go by these and the skin
        weights are the transfer's result."""
        prepared, taken = self._prepared(identity, pose)
        motions = np.empty((JOINTS, 3, 4))
        call("npt_move_joints", self._open.handle, prepared._owned.handle, taken._owned.handle, motions.ctypes.data)
        return motions

    def _identity(self, identity: Union[MeshLike, Identity]) -> Identity:
        if not isinstance(identity, Identity):
            return self.prepare_identity(identity)
        if identity._open is not self._open:
            raise Error("identity: found one that another transfer prepared, expected this one's")
        return identity

    def _prepared(self, identity: Union[MeshLike, Identity], pose: Union[MeshLike, Pose]) -> "tuple[Identity, Pose]":
        if not isinstance(identity, Identity) and not isinstance(pose, Pose):
            return self.prepare(identity, pose)
        prepared = self._identity(identity)
        if not isinstance(pose, Pose):
            return prepared, self.prepare_pose(pose, len(prepared))
        if pose._open is not self._open:
            raise Error("pose: found one that another transfer prepared, expected this one's")
        return prepared, pose

    def _explain(self, identity: Identity, pose: Pose) -> Report:
        report = CReport()
        call("npt_explain", self._open.handle, identity._owned.handle, pose._owned.handle, ctypes.byref(report))
        return _report(report)

    @staticmethod
    def _warn(report: Report) -> None:
        for note in report.notes:
            warnings.warn(note, TransferWarning, stacklevel=3)


class Sequence:
    """The frames of a sequence for one identity. Several threads take turns."""

    def __init__(self, transfer: PoseTransfer, identity: Identity):
        self._identity, self._owned, self._lock = identity, _Owned("npt_close_sequence"), threading.Lock()
        self._open = transfer._open  # the sequence goes before the transfer does
        call("npt_open_sequence", self._open.handle, identity._owned.handle, self._owned.out)

    def __call__(self, pose: MeshLike, *, out: Optional[NDArray[np.float32]] = None) -> NDArray[np.float32]:
        """The identity's vertices in the next frame's pose."""
        mesh = Borrowed(pose, "pose")
        result = result_for(len(self._identity), out)
        with self._lock:
            call("npt_run_frame", self._owned.handle, mesh.pointer, result.ctypes.data)
        return result

    def explain(self) -> Report:
        """How the last frame was made."""
        report = CReport()
        with self._lock:
            call("npt_explain_frame", self._owned.handle, ctypes.byref(report))
        return _report(report)

    def motions(self) -> NDArray[np.float64]:
        """How the rig's joints moved to the last frame: [J, 3, 4]"""
        motions = np.empty((JOINTS, 3, 4))
        with self._lock:
            call("npt_move_frame_joints", self._owned.handle, motions.ctypes.data)
        return motions


def _report(report: CReport) -> Report:
    notes = library().npt_last_notes().decode("utf-8", "replace")
    return Report(
        "body" if report.method == METHODS["body"] else "network",
        report.identity_confidence if report.identity_confidence >= 0 else None,
        report.pose_confidence if report.pose_confidence >= 0 else None,
        tuple(notes.splitlines()),
    )
