"""What a transfer gives: vertices, how they were made, and what to know of them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._library import ADVICE, REMEDIES, CMeasures, CResult, library
from ._meshes import Mesh

WARNING_CODES = (
    "not_recognised",
    "low_confidence",
    "no_surface",
    "upside_down",
    "lying",
    "lying_or_z_up",
    "arms_uncertain",
    "legs_uncertain",
    "unusual_proportions",
    "faces_inward",
    "unit_assumed",
    "part_of_mesh",
)
NETWORK = 2  # npt_method


class TransferWarning(UserWarning):
    """What to know before using a result, such as a mesh that is recognised with a low confidence. str() adds the remedy.

    code    "not_recognised", "low_confidence", "no_surface", "upside_down", "lying", "lying_or_z_up", "arms_uncertain",
            "legs_uncertain", "unusual_proportions", "faces_inward", "unit_assumed" or "part_of_mesh"
    mesh    "identity" or "pose"
    value   a confidence from 0 to 1, or metres in one unit (unit_assumed); else 0
    remedy  "none", "look_at_result", "choose_method", "give_unit" or "give_weights"
    text    what it says, in plain English, without the remedy
    """

    def __init__(self, code: str, mesh: str, value: float, remedy: str, text: str):
        super().__init__(text + (f"; {ADVICE[remedy]}" if ADVICE[remedy] else ""))
        self.code, self.mesh, self.value, self.remedy, self.text = code, mesh, value, remedy, text


@dataclass(frozen=True)
class Result:
    """A character in a pose, and how it was made."""

    method: str  #: "body" (by body estimation) or "network"
    confidence: Optional[float]  #: the lower of both meshes', 0 to 1; None: no body was estimated
    character_confidence: Optional[float]  #: that it is of the kind, and that its pose was estimated rightly
    pose_confidence: Optional[float]
    warnings: "tuple[TransferWarning, ...]"  #: empty: nothing needs to be said
    vertices: Optional[NDArray[np.float32]] = None  #: [V, 3], in the identity's order, unit and place
    faces: Any = None  #: as the identity was given
    kind: str = ""  #: whose body made it: "person" or "four-legged animal"; "": the network

    @property
    def mesh(self) -> Mesh:
        """Vertices and faces."""
        return Mesh(self.vertices, self.faces)


@dataclass(frozen=True)
class Measures:
    """What can be measured of a result without its ground truth."""

    common_stretch: float  #: edges of 99.9 % of the length are at most so many times as long as before
    largest_stretch: float  #: the same of one edge; one shorter than the mean edge counts as a mean one
    stretched_vertex: int  #: an end of that edge
    penetration: float  #: fraction of the area inside another part of the mesh, and outside before
    character_coverage: Optional[float]  #: fraction of the area that has its estimated body within 3 cm
    pose_coverage: Optional[float]


def measures_of(raw: CMeasures) -> Measures:
    return Measures(
        raw.common_stretch,
        raw.largest_stretch,
        raw.stretched_vertex,
        raw.penetration,
        confidence_of(raw.character_coverage),
        confidence_of(raw.pose_coverage),
    )


def confidence_of(value: float) -> Optional[float]:
    return value if value >= 0 else None


def warnings_of(count: int, raw: Any, identity: str, pose: str) -> "tuple[TransferWarning, ...]":
    made = []
    for warning in raw[:count]:
        text = library().npt_warning_text(ctypes.byref(warning), identity.encode(), pose.encode())
        made.append(
            TransferWarning(
                WARNING_CODES[warning.code],
                "pose" if warning.mesh else "identity",
                warning.value,
                REMEDIES[warning.remedy],
                text.decode("utf-8", "replace"),
            )
        )
    return tuple(made)


def result_of(
    raw: CResult, identity: str, pose: str, vertices: Optional[NDArray[np.float32]] = None, faces: Any = None
) -> Result:
    return Result(
        "network" if raw.method == NETWORK else "body",
        confidence_of(raw.confidence),
        confidence_of(raw.character_confidence),
        confidence_of(raw.pose_confidence),
        warnings_of(raw.warning_count, raw.warnings, identity, pose),
        vertices,
        faces,
        raw.kind.decode(),
    )
