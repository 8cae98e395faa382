"""Meshes of the caller's as the C ABI takes them: float32 arrays are passed as they lie in memory, anything else is converted."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any, Optional, Protocol, Union

import numpy as np
from numpy.typing import NDArray

from ._library import CMesh, Error


@dataclass(frozen=True)
class Mesh:
    """Vertices [V, 3], faces [F, 3] or [F, 4] of vertex numbers, None for a cloud of points, and what messages call it."""

    vertices: Any
    faces: Any = None
    name: Optional[str] = None


class HasVerticesAndFaces(Protocol):
    """Such as trimesh.Trimesh."""

    @property
    def vertices(self) -> Any:
        ...

    @property
    def faces(self) -> Any:
        ...


#: An npt.Mesh, anything with .vertices and .faces (trimesh), a pair (vertices, faces), or vertices alone.
MeshLike = Union[Mesh, HasVerticesAndFaces, "tuple[Any, Any]", NDArray[Any]]


def _numbers(values: Any, name: str, what: str, kinds: str, wanted: str) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError:
        raise Error(f"{name}: found {what} in rows of different lengths, expected {wanted}") from None
    if array.size == 0 and array.ndim == 1:
        return array.reshape(0, 3).astype(np.float32 if "f" in kinds else np.uint32)
    if array.dtype.kind not in kinds:
        raise Error(f"{name}: found {what} of type {array.dtype}, expected {wanted}")
    return array


def _name_row(array: NDArray[Any], bad: NDArray[np.bool_]) -> "tuple[int, str]":
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    return row, ", ".join(str(x) for x in array[row])


def floats(values: Any, name: str) -> NDArray[np.float32]:
    """[V, 3] float32, contiguous: `values` itself if it is so already, else a converted copy."""
    wanted = "an array [V, 3] of numbers"
    array = _numbers(values, name, "vertices", "fiu", wanted)
    if array.ndim != 2 or array.shape[1] != 3:
        raise Error(f"{name}: found vertices of shape {list(array.shape)}, expected {wanted}")
    with np.errstate(over="ignore"):
        array = np.require(array, dtype=np.float32, requirements=["C", "A"])
    # Without a copy: NaN and infinity come through both.
    if array.size and not (np.isfinite(array.min()) and np.isfinite(array.max())):
        row, text = _name_row(array, ~np.isfinite(array))
        raise Error(f"{name}: vertex {row}: found {text}, expected finite numbers")
    return array


def triangles(values: Any, name: str) -> NDArray[np.uint32]:
    """[T, 3] uint32, contiguous: `values` itself if they are so or int32 already. Quads become two triangles each."""
    wanted = "an array [F, 3] or [F, 4] of vertex numbers"
    array = _numbers(values, name, "faces", "iu", wanted)
    if array.ndim != 2 or array.shape[1] not in (3, 4):
        raise Error(f"{name}: found faces of shape {list(array.shape)}, expected {wanted}")
    if (
        array.size
        and (array.dtype.kind == "i" or array.dtype.itemsize > 4)
        and not (0 <= int(array.min()) and int(array.max()) < 2**32)
    ):
        row, text = _name_row(array, (array < 0) | (array >= 2**32))
        raise Error(f"{name}: face {row}: found {text}, expected vertex numbers from 0")
    if array.shape[1] == 4:
        array = array[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    if array.dtype == np.int32 and array.flags.c_contiguous and array.flags.aligned:
        return array.view(np.uint32)
    return np.require(array, dtype=np.uint32, requirements=["C", "A"])


class Borrowed:
    """A mesh's arrays and the npt_mesh that points at them. Not longer than the arrays live, which it keeps."""

    def __init__(self, mesh: MeshLike, name: str):
        given: Any = mesh
        vertices, faces = given, None
        if hasattr(given, "vertices") and hasattr(given, "faces"):
            vertices, faces = given.vertices, given.faces
            name = getattr(mesh, "name", None) or name
        elif isinstance(mesh, tuple):
            if len(mesh) != 2:
                raise Error(f"{name}: found a tuple of {len(mesh)}, expected (vertices, faces)")
            vertices, faces = mesh
        elif isinstance(mesh, (str, bytes)) or mesh is None:
            raise Error(f"{name}: found {mesh!r}, expected a mesh: (vertices, faces), or what has .vertices and .faces")
        self.name = str(name)
        self.faces = faces
        self.xyz = floats(vertices, self.name)
        self.triangles = triangles(faces, self.name) if faces is not None and len(faces) > 0 else None
        self.c = CMesh(
            ctypes.sizeof(CMesh),
            self.xyz.ctypes.data,
            len(self.xyz),
            self.triangles.ctypes.data if self.triangles is not None else None,
            len(self.triangles) if self.triangles is not None else 0,
            self.name.encode(),
        )

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def pointer(self) -> Any:
        return ctypes.byref(self.c)


def result_for(vertices: int, out: Optional[NDArray[np.float32]]) -> NDArray[np.float32]:
    if out is None:
        return np.empty((vertices, 3), np.float32)
    if (
        not isinstance(out, np.ndarray)
        or out.dtype != np.float32
        or out.shape != (vertices, 3)
        or not (out.flags.c_contiguous and out.flags.aligned and out.flags.writeable)
    ):
        found = f"{out.dtype} {list(out.shape)}" if isinstance(out, np.ndarray) else type(out).__name__
        raise Error(f"out: found {found}, expected a contiguous, writable float32 array [{vertices}, 3]")
    return out


def pmd(result: Any, ground_truth: Any) -> float:
    """How far a result is from the ground truth, as `npt evaluate` measures: the mean over the vertices of the squared
    distance, with both bounding boxes centred (Wang et al., CVPR 2020, eq. 7). In squares of the unit."""
    a, b = floats(result, "result").astype(np.float64), floats(ground_truth, "ground truth").astype(np.float64)
    if a.shape != b.shape:
        raise Error(f"ground truth: found {len(b)} vertices, expected {len(a)}, as many as the result has")
    if len(a) == 0:
        raise Error("result: found no vertices, expected at least one")
    a, b = (x - (x.min(axis=0) + x.max(axis=0)) / 2 for x in (a, b))
    return float(((a - b) ** 2).sum() / len(a))
