"""What depends on one mesh alone, computed once: characters and poses."""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from ._library import CEstimate, CJointPose, CMesh, CSkeleton, Error, Handle, call, filled, library
from ._results import TransferWarning, confidence_of, warnings_of

JOINTS = 40  # the most of a skeleton: SMPL's 24 and those of the fingers
INFLUENCE = np.dtype({"names": ["joint", "weight"], "formats": ["u2", "f4"], "offsets": [0, 4], "itemsize": 8})


@dataclass(frozen=True)
class JointPose:
    """The joint angles of an estimated body: a person's in SMPL's order, an animal's in that of its skeleton."""

    axis_angles: NDArray[np.float32]  #: [J, 3], of a person J = 24; radians, each in its parent's frame
    root: NDArray[np.float64]  #: [3] the root joint's position, in the mesh's unit and place
    leg: float  #: length of a leg, hip to ankle, in the mesh's unit


@dataclass(frozen=True)
class Skeleton:
    """A skeleton and skin weights, in the mesh's own unit, place and pose. Joints have no rotation of their own."""

    names: "list[str]"  #: a person's as VRM calls them: "hips", "leftUpperLeg" ...
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


class Owned:
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


class _Estimated:
    """What a Character and a Pose have in common."""

    _function, _joints_function = "", ""
    _open: Owned  # the transfer goes after what it prepared
    _name: str

    @property
    def _handle(self) -> Any:
        raise NotImplementedError

    def _estimate(self) -> CEstimate:
        return filled(CEstimate, self._function, self._handle)

    @property
    def recognised(self) -> bool:
        """Whether its confidence is high enough for body estimation."""
        return bool(self._estimate().recognised)

    @property
    def confidence(self) -> Optional[float]:
        """That it is of its kind, and that its pose was estimated rightly: 0 to 1; None: no body was estimated."""
        return confidence_of(self._estimate().confidence)

    @property
    def domain(self) -> str:
        """Of the weights that recognised it, or that take it: "human"; empty where the weights name none."""
        return str(self._estimate().domain.decode())

    @property
    def kind(self) -> str:
        """What it is recognised as: "person", "four-legged animal"; empty where it isn't."""
        return str(self._estimate().kind.decode())

    @property
    def warnings(self) -> "tuple[TransferWarning, ...]":
        """What to know of it."""
        own = self._estimate()
        return warnings_of(own.warning_count, own.warnings, self._name, self._name)

    def joints(self) -> Optional[JointPose]:
        """Its joints; None: not recognised."""
        if not self.recognised:
            return None
        own = filled(CJointPose, self._joints_function, self._handle)
        return JointPose(np.array(own.axis_angles, np.float32).reshape(-1, 3)[: own.joints], np.array(own.root), own.leg)


class Character(_Estimated):
    """An identity that takes many poses: what depends on it alone, computed once. Any number of threads may use it."""

    _function, _joints_function = "npt_character_estimate", "npt_character_joints"

    def __init__(self, open_: Owned, owned: Owned, name: str, faces: Any = None):
        self._open, self._owned, self._name = open_, owned, name
        self._mesh = filled(CMesh, "npt_character_mesh", owned.handle)  # points into the character's memory
        self._faces = faces

    @property
    def _handle(self) -> Any:
        return self._owned.handle

    def __len__(self) -> int:
        """Vertices."""
        return int(self._mesh.vertices)

    @property
    def unit(self) -> float:
        """Metres in one unit of its mesh, where the network asks for one; else 1."""
        return float(self._estimate().unit)

    @property
    def vertices(self) -> NDArray[np.float32]:
        """[V, 3] float32, a copy"""
        raw = ctypes.string_at(self._mesh.xyz, 12 * len(self))
        return np.frombuffer(raw, np.float32).reshape(-1, 3).copy()

    @property
    def faces(self) -> Any:
        """As they were given; of a character that was loaded, [T, 3] uint32."""
        if self._faces is None and self._mesh.triangle_count:
            raw = ctypes.string_at(self._mesh.triangles, 12 * self._mesh.triangle_count)
            self._faces = np.frombuffer(raw, np.uint32).reshape(-1, 3)
        return self._faces

    def skeleton(self) -> Optional[Skeleton]:
        """What moves it; None: not recognised, or results are refined, which no skeleton can do."""
        pointer = ctypes.POINTER(CSkeleton)()
        if not self.recognised or getattr(self._open, "refines", False):
            return None
        call("npt_open_skeleton", self._handle, ctypes.byref(pointer))
        try:
            c = pointer.contents
            start = np.ctypeslib.as_array(c.start, (c.vertices + 1,)).copy()
            raw = ctypes.string_at(c.influences, int(start[-1]) * INFLUENCE.itemsize)
            influences = np.frombuffer(raw, INFLUENCE)
            return Skeleton(
                [c.names[j].decode() for j in range(c.joints)],
                np.ctypeslib.as_array(c.parents, (c.joints,)).copy(),
                np.ctypeslib.as_array(c.places, (c.joints * 3,)).reshape(-1, 3).copy(),
                start,
                influences["joint"].copy(),
                influences["weight"].copy(),
            )
        finally:
            library().npt_close_skeleton(pointer)

    def save(self, file: Union[str, "os.PathLike[str]"]) -> None:
        """Writes it to a file for PoseTransfer.load_character. Raises npt.Error where it is not recognised."""
        call("npt_character_save", self._handle, os.fspath(file).encode())


class Pose(_Estimated):
    """A pose that many characters take: what depends on its mesh alone, computed once. Any number of threads may use
    it; a PoseTracker's is valid until its next frame."""

    _function, _joints_function = "npt_pose_estimate", "npt_pose_joints"

    def __init__(self, open_: Owned, owned: Any, name: str):
        self._open, self._owned, self._name = open_, owned, name

    @property
    def _handle(self) -> Any:
        return self._owned.handle


class TrackedFrame:
    """The handle of a frame's pose, which is the tracker's: not to be used once that has gone on."""

    def __init__(self, owned: Owned, frames: "list[int]", pointer: Any):
        self._owned, self._frames, self._frame, self._pointer = owned, frames, frames[0], pointer

    @property
    def handle(self) -> Any:
        if self._frames[0] != self._frame:
            raise Error("pose: found a frame that the tracker has left behind, expected its last one")
        return self._pointer
