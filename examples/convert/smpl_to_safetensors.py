#!/usr/bin/env python3
"""Turns a body model in SMPL's layout (.npz or .pkl) into an npt body file (safetensors).

Reads npz files and the original pickles, which Python 2 wrote and which hold chumpy arrays and scipy matrices. Needs numpy, but
neither chumpy nor scipy, and runs no code of the file. SMPL, SMPL-H and SMAL come under their own licences, which forbid
passing them on: convert your own copy and keep it to yourself.

  smpl_to_safetensors.py basicModel_f_lbs_10_207_0_v1.0.0.pkl smpl_female.safetensors --licence "SMPL, non-commercial"
"""

import argparse
import io
import os
import pickle
import zipfile
import zlib

import numpy as np

from convert_common import ConvertError, run, unpickle, write_safetensors

SMPL_JOINTS = ("pelvis l_hip r_hip spine1 l_knee r_knee spine2 l_ankle r_ankle spine3 l_foot r_foot neck l_collar r_collar head "
               "l_shoulder r_shoulder l_elbow r_elbow l_wrist r_wrist l_hand r_hand")
FIELDS = ("v_template", "shapedirs", "J_regressor", "weights", "f", "kintree_table")
OPTIONAL = ("posedirs",)
LARGEST_ARRAY = 2**30  # the largest real one, 300 shape directions in double, is 75 MB


class Opaque:
    """Stand-in for an object of the pickle: keeps its state, runs nothing."""

    state = {}

    def __init__(self, *_):
        pass

    def __setstate__(self, state):
        self.state = state if isinstance(state, dict) else {"state": state}


class ChumpyArray(Opaque):
    """chumpy.ch.Ch: a leaf keeps its values as `x`."""


class ChumpySelection(Opaque):
    """chumpy.reordering.Select: elements `idxs` of the flattened array `a`, in shape `preferred_shape`."""


class SparseMatrix(Opaque):
    """scipy's compressed matrix, by columns (csc) or rows (csr)."""

    by_columns = True


class RowMatrix(SparseMatrix):
    by_columns = False


class DType:
    """numpy.dtype of plain numbers, or of objects."""

    def __init__(self, code, *_):
        if not isinstance(code, str):
            raise pickle.UnpicklingError("found a damaged dtype")
        self.code, self.order = code, "="

    def __setstate__(self, state):
        self.order = state[1] if state[1] in ("<", ">") else "="

    def numpy(self):
        if self.code[:1] not in "fiub" or not self.code[1:].isdigit():
            raise pickle.UnpicklingError(f"found dtype '{self.code}', expected numbers")
        return np.dtype(self.order + self.code)


class Array:
    """numpy.ndarray as pickled: version, shape, dtype, column order, raw bytes (or a list, of objects)."""

    def __init__(self, *_):
        self.value = None

    def __setstate__(self, state):
        _, shape, dtype, by_columns, raw = state
        if dtype.code.startswith("O"):
            self.value = list(raw)
            return
        raw = raw.encode("latin1") if isinstance(raw, str) else raw
        # frombuffer and reshape check the length against the shape.
        self.value = np.frombuffer(raw, dtype.numpy()).reshape(shape, order="F" if by_columns else "C")


def scalar(dtype, raw):
    """numpy.core.multiarray.scalar"""
    return np.frombuffer(raw.encode("latin1") if isinstance(raw, str) else raw, dtype.numpy())[0]


def reconstruct(kind, *_):
    """copyreg._reconstructor and numpy's _reconstruct: an empty object that a state follows. Stand-ins only."""
    if not (isinstance(kind, type) and issubclass(kind, (Opaque, Array))):
        raise pickle.UnpicklingError("found an object of an unknown class")
    return kind()


ALLOWED = {("copyreg", "_reconstructor"): reconstruct, ("copy_reg", "_reconstructor"): reconstruct,
           ("builtins", "object"): Opaque, ("__builtin__", "object"): Opaque,
           ("chumpy.ch", "Ch"): ChumpyArray, ("chumpy", "Ch"): ChumpyArray, ("chumpy.reordering", "Select"): ChumpySelection,
           ("numpy", "ndarray"): Array, ("numpy", "dtype"): DType}
for module in ("numpy.core.multiarray", "numpy._core.multiarray"):
    ALLOWED[module, "_reconstruct"] = reconstruct
    ALLOWED[module, "scalar"] = scalar
for kind, name in ((SparseMatrix, "csc"), (RowMatrix, "csr")):
    for module in (f"scipy.sparse.{name}", f"scipy.sparse._{name}"):
        ALLOWED[module, f"{name}_matrix"] = kind


def dense(matrix):
    state = matrix.state
    shape = plain(state.get("_shape", state.get("shape")))
    data, indices, starts = (plain(state.get(key)) for key in ("data", "indices", "indptr"))
    rows, columns = (int(n) for n in shape)
    if rows < 0 or columns < 0 or rows * columns > 2**26:
        raise ConvertError(f"found a sparse matrix of {rows} x {columns}")
    lines, length = (columns, rows) if matrix.by_columns else (rows, columns)
    good = len(starts) == lines + 1 and len(indices) == len(data) and starts[0] == 0 and starts[-1] == len(data)
    if not good or np.any(np.diff(starts) < 0) or np.any(indices < 0) or np.any(indices >= length):
        raise ConvertError("found a sparse matrix whose indices do not fit its shape")
    result = np.zeros((lines, length))
    np.add.at(result, (np.repeat(np.arange(lines), np.diff(starts)), indices), data)
    return result.T if matrix.by_columns else result


def plain(value):
    """Any of the stand-ins as an array of numbers."""
    for _ in range(16):  # chumpy nests a few levels; a pickle can also hold itself
        if isinstance(value, Array):
            value = value.value
        elif isinstance(value, ChumpyArray):
            value = value.state.get("x")
        elif isinstance(value, ChumpySelection):
            source, indices = plain(value.state.get("a")), plain(value.state.get("idxs"))
            shape = plain(value.state.get("preferred_shape", np.shape(indices)))
            value = np.asarray(source).ravel()[np.asarray(indices, dtype=np.int64)].reshape([int(n) for n in shape])
        elif isinstance(value, SparseMatrix):
            value = dense(value)
        elif isinstance(value, (np.ndarray, np.generic, int, float)):
            return np.asarray(value)
        elif isinstance(value, (list, tuple)):
            return np.asarray([plain(entry) for entry in value])
        else:
            break
    raise ConvertError(f"found {type(value).__name__}, expected an array of numbers")


def read_npz(path):
    """The wanted arrays of an npz file. Arrays of objects (a sparse matrix) go through the restricted unpickler."""
    fields = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for name in FIELDS + OPTIONAL:
                if f"{name}.npy" not in archive.namelist():
                    continue
                if archive.getinfo(f"{name}.npy").file_size > LARGEST_ARRAY:
                    raise ConvertError(f"{path}: {name}: found an array of more than {LARGEST_ARRAY} bytes")
                stream = io.BytesIO(archive.read(f"{name}.npy"))
                version = np.lib.format.read_magic(stream)
                read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
                if version not in read_header:
                    raise ConvertError(f"{path}: {name}: found npy version {version}, expected 1.0 or 2.0")
                _, _, dtype = read_header[version](stream)
                if dtype.hasobject:
                    value = unpickle(stream, path, name, ALLOWED, encoding="latin1")
                    if isinstance(value, Array) and isinstance(value.value, list) and len(value.value) == 1:
                        value = value.value[0]
                    fields[name] = value
                else:
                    stream.seek(0)
                    fields[name] = np.lib.format.read_array(stream, allow_pickle=False)
    except (zipfile.BadZipFile, zlib.error, ValueError, EOFError, OSError, NotImplementedError, RuntimeError) as error:
        raise ConvertError(f"{path}: found a damaged npz file: {error}") from None
    return fields


def read_pickle(path):
    with open(path, "rb") as stream:
        content = unpickle(stream, path, "pickle", ALLOWED, encoding="latin1")
    if not isinstance(content, dict):
        raise ConvertError(f"{path}: found {type(content).__name__}, expected a dictionary with {', '.join(FIELDS)}")
    return content


def read_model(path):
    try:
        with open(path, "rb") as stream:
            start = stream.read(2)
    except OSError as error:
        raise ConvertError(f"{path}: cannot read: {error.strerror}") from None
    if not start:
        raise ConvertError(f"{path}: found an empty file, expected a body model (.npz or .pkl)")
    fields = read_npz(path) if start == b"PK" else read_pickle(path)
    missing = [name for name in FIELDS if name not in fields]
    if missing:
        raise ConvertError(f"{path}: found no {', '.join(missing)}, expected a body model in SMPL's layout")
    arrays = {}
    for name in (name for name in FIELDS + OPTIONAL if name in fields):
        try:
            arrays[name] = plain(fields[name])
        except ConvertError as error:
            raise ConvertError(f"{path}: {name}: {error}") from None
        except Exception as error:  # any inconsistency of the stand-ins' states
            raise ConvertError(f"{path}: {name}: found a damaged array: {error}") from None
        if arrays[name].dtype.kind not in "fiu":
            raise ConvertError(f"{path}: {name}: found {arrays[name].dtype}, expected numbers")
    return arrays


def check_model(arrays, path, shapes_wanted):
    """Brings the arrays into the body file's shapes and types. All that is wrong is told at once."""
    v, j = (arrays[name].shape[0] if arrays[name].ndim == 2 else 0 for name in ("v_template", "J_regressor"))
    expected = {"v_template": (v, 3), "shapedirs": (v, 3, None), "J_regressor": (j, v), "weights": (v, j), "f": (None, 3),
                "kintree_table": (2, j)}
    if "posedirs" in arrays:
        expected["posedirs"] = (v, 3, 9 * (j - 1))
    problems = []
    for name, shape in expected.items():
        found = arrays[name].shape
        if len(found) != len(shape) or 0 in found or any(e not in (None, f) for f, e in zip(found, shape)):
            text = ", ".join("any" if e is None else str(e) for e in shape)
            problems.append(f"{name}: found shape {list(found)}, expected [{text}]")
        elif arrays[name].dtype.kind == "f" and not np.all(np.isfinite(arrays[name])):
            place = [int(i) for i in np.argwhere(~np.isfinite(arrays[name]))[0]]
            problems.append(f"{name}: element {place}: found a number that is not finite")
    if not problems and (arrays["f"].min() < 0 or arrays["f"].max() >= v):
        problems.append(f"f: found vertex {int(arrays['f'].max())} or a negative one, expected 0 to {v - 1}")
    if not problems:
        parents = arrays["kintree_table"][0].astype(np.int64)
        parents[0] = -1  # files hold 2^32 - 1
        wrong = [k for k in range(1, j) if not 0 <= parents[k] < k]
        if wrong:
            problems.append(f"kintree_table: joint {wrong[0]}: found parent {parents[wrong[0]]}, expected an earlier joint")
        if arrays["shapedirs"].shape[2] < shapes_wanted:
            problems.append(f"shapedirs: found {arrays['shapedirs'].shape[2]} directions, expected at least {shapes_wanted}")
    if problems:
        raise ConvertError(f"{path}: not a body model in SMPL's layout:\n  " + "\n  ".join(problems))
    arrays["shapedirs"] = arrays["shapedirs"][:, :, :shapes_wanted]
    arrays["parents"] = parents
    return v, j


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", help="body model: .npz or .pkl")
    parser.add_argument("body", help="safetensors file to write")
    parser.add_argument("--shapes", type=int, default=10, metavar="N", help="keep the first N shape directions (default 10)")
    parser.add_argument("--unit", default="metre", help="unit of the model (default metre)")
    parser.add_argument("--up", default="y", choices=["x", "y", "z"], help="axis that points up (default y)")
    parser.add_argument("--front", default="z", choices=["x", "y", "z"], help="axis that the body faces (default z)")
    parser.add_argument("--joint-names", metavar="NAMES", help="names in the model's order, separated by blanks (24 joints: SMPL's)")
    parser.add_argument("--licence", default="see the model's own", help="licence text kept in the file")
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    if arguments.shapes < 1:
        raise ConvertError(f"--shapes: found {arguments.shapes}, expected at least 1")
    arrays = read_model(arguments.model)
    vertices, joints = check_model(arrays, arguments.model, arguments.shapes)
    names = arguments.joint_names or (SMPL_JOINTS if joints == 24 else " ".join(f"joint{k}" for k in range(joints)))
    if len(names.split()) != joints:
        raise ConvertError(f"--joint-names: found {len(names.split())} names, expected {joints}")
    tensors = {}
    for name in ("v_template", "shapedirs", "posedirs", "J_regressor", "weights", "f", "parents"):
        if name not in arrays:
            continue
        dtype, code = ("I32", "<i4") if name in ("f", "parents") else ("F32", "<f4")
        tensors[name] = (dtype, arrays[name].shape, np.ascontiguousarray(arrays[name], dtype=code).tobytes())
    metadata = {"joint_names": names, "unit": arguments.unit, "up": arguments.up, "front": arguments.front, "rest_pose": "T",
                "licence": arguments.licence, "source": os.path.basename(arguments.model)}
    write_safetensors(arguments.body, tensors, metadata)
    print(f"{arguments.body}: {vertices} vertices, {arrays['f'].shape[0]} faces, {joints} joints, {arguments.shapes} shape directions")


if __name__ == "__main__":
    run(main)
