"""smpl_to_safetensors.py: npz, plain and Python 2 pickles with chumpy and scipy objects, and what has to be refused."""

import io
import pickle
import sys
import unittest
import zipfile

try:
    import numpy as np
except ImportError:
    print("SKIPPED: numpy is not installed")
    sys.exit(0)

from pickle_bytes import Global, Reduce, dumps
from support import ConverterTest

V, J = 6, 24


def model():
    """A body model in SMPL's layout with 6 vertices."""
    random = np.random.RandomState(5)
    weights = random.rand(V, J)
    parents = np.array([2**32 - 1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21])
    regressor = np.where(random.rand(J, V) < 0.4, random.rand(J, V), 0)
    return {"v_template": random.randn(V, 3), "shapedirs": random.randn(V, 3, 12), "J_regressor": regressor,
            "weights": weights / weights.sum(axis=1, keepdims=True), "f": np.array([[0, 1, 2], [3, 4, 5]], dtype=np.uint32),
            "kintree_table": np.array([parents, np.arange(J)]), "posedirs": random.randn(V, 3, 207)}


def array(values, by_columns=False):
    """A pickled numpy array, as Python 2 wrote it."""
    values = np.asarray(values)
    code = values.dtype.kind + str(values.dtype.itemsize)
    dtype = Reduce(Global("numpy", "dtype"), (code.encode(), 0, 1), state=(3, b"<", None, None, None, -1, -1, 0))
    empty = (Global("numpy", "ndarray"), (0,), b"b")
    state = (1, values.shape, dtype, by_columns, values.tobytes(order="F" if by_columns else "C"))
    return Reduce(Global("numpy.core.multiarray", "_reconstruct"), empty, state=state)


def new_object(module, name, state):
    arguments = (Global(module, name), Global("__builtin__", "object"), None)
    return Reduce(Global("copy_reg", "_reconstructor"), arguments, state=state)


def chumpy(values):
    return new_object("chumpy.ch", "Ch", {"x": array(values), "_dirty_vars": None})


def chumpy_slice(values, keep):
    """What chumpy makes of values[:, :, :keep]."""
    indices = np.arange(values.size).reshape(values.shape)[:, :, :keep]
    state = {"a": chumpy(values), "idxs": array(indices.ravel()), "preferred_shape": indices.shape}
    return new_object("chumpy.reordering", "Select", state)


def sparse(values):
    """scipy.sparse.csc_matrix"""
    rows, columns = np.nonzero(values.T)[::-1]
    starts = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=values.shape[1]))])
    state = {"data": array(values[rows, columns]), "indices": array(rows.astype(np.int32)),
             "indptr": array(starts.astype(np.int32)), "_shape": values.shape, "format": b"csc", "maxprint": 50}
    return new_object("scipy.sparse.csc", "csc_matrix", state)


def old_pickle(**changes):
    m = model()
    fields = {b"v_template": chumpy(m["v_template"]), b"shapedirs": chumpy_slice(m["shapedirs"], 10),
              b"J_regressor": sparse(m["J_regressor"]), b"weights": array(m["weights"], by_columns=True), b"f": array(m["f"]),
              b"kintree_table": array(m["kintree_table"]), b"bs_type": b"lrotmin", b"bs_style": b"lbs"}
    fields.update({key.encode(): value for key, value in changes.items()})
    return dumps(fields)


def npz(**changes):
    out = io.BytesIO()
    np.savez(out, **{**model(), **changes})
    return out.getvalue()


class SmplConverter(ConverterTest):
    script = "smpl_to_safetensors.py"

    def assert_holds_model(self, tensors, shapes=10, posedirs=True):
        m = model()
        m["shapedirs"] = m["shapedirs"][:, :, :shapes]
        m["parents"] = np.concatenate([[-1], m["kintree_table"][0, 1:]])
        names = ["v_template", "shapedirs", "posedirs", "J_regressor", "weights", "f", "parents"]
        self.assertEqual(list(tensors), names if posedirs else names[:2] + names[3:])
        for name, (dtype, shape, data) in tensors.items():
            self.assertEqual((dtype, tuple(shape)), ("I32" if name in ("f", "parents") else "F32", m[name].shape), name)
            found = np.frombuffer(data, "<i4" if dtype == "I32" else "<f4").reshape(shape)
            self.assertTrue(np.array_equal(found, m[name].astype(found.dtype)), name)


class GoodModels(SmplConverter):
    def test_old_pickles_with_chumpy_and_scipy(self):
        tensors, metadata = self.converted(self.file("a.pkl", old_pickle()), "--licence", "none")
        self.assert_holds_model(tensors, posedirs=False)
        self.assertEqual(metadata["joint_names"].split()[0], "pelvis")
        self.assertEqual((metadata["unit"], metadata["up"], metadata["licence"]), ("metre", "y", "none"))

    def test_npz(self):
        tensors, _ = self.converted(self.file("a.npz", npz()), "--shapes", "12")
        self.assert_holds_model(tensors, shapes=12)

    def test_npz_with_an_array_of_objects(self):
        boxed = io.BytesIO()
        np.lib.format.write_array_header_1_0(boxed, {"descr": "|O", "fortran_order": False, "shape": ()})
        dtype = Reduce(Global("numpy", "dtype"), (b"O8", 0, 1), state=(3, b"|", None, None, None, -1, -1, 63))
        empty = (Global("numpy", "ndarray"), (0,), b"b")
        holder = Reduce(Global("numpy.core.multiarray", "_reconstruct"), empty,
                        state=(1, (), dtype, False, [sparse(model()["J_regressor"])]))
        out = io.BytesIO(npz())
        with zipfile.ZipFile(out) as source, zipfile.ZipFile(self.folder / "a.npz", "w") as target:
            for name in source.namelist():
                changed = boxed.getvalue() + dumps(holder)
                target.writestr(name, changed if name == "J_regressor.npy" else source.read(name))
        tensors, _ = self.converted(self.folder / "a.npz")
        self.assert_holds_model(tensors)

    def test_pickles_of_python_3(self):
        tensors, _ = self.converted(self.file("a.pkl", pickle.dumps(model())))
        self.assert_holds_model(tensors)


class BadModels(SmplConverter):
    def test_code_is_never_run(self):
        marker = self.folder / "run"
        attack = Reduce(Global("os", "system"), (f"echo > '{marker}'",))
        self.refused(self.file("a.pkl", old_pickle(weights=attack)), "a.pkl", "os.system", "refused")
        self.refused(self.file("a.pkl", dumps(attack)), "os.system")
        self.assertFalse(marker.exists())

    def test_every_truncation_is_refused(self):
        for name, data in (("a.pkl", old_pickle()), ("a.npz", npz())):
            for length in [0, 1, 3] + [len(data) * k // 8 for k in range(1, 8)] + [len(data) - 1]:
                self.refused(self.file(name, data[:length]), name)

    def test_wrong_arrays_are_all_named(self):
        m = model()
        data = npz(weights=m["weights"][:, :5], f=m["f"][:, :2])
        self.refused(self.file("a.npz", data), "weights: found shape [6, 5], expected [6, 24]",
                     "f: found shape [2, 2], expected [any, 3]")
        bad = m["v_template"].copy()
        bad[4, 1] = np.nan
        self.refused(self.file("a.npz", npz(v_template=bad)), "v_template: element [4, 1]")
        self.refused(self.file("a.npz", npz(posedirs=m["posedirs"][:, :, :9])), "posedirs: found shape [6, 3, 9]", "[6, 3, 207]")
        self.refused(self.file("a.npz", npz(f=m["f"] + 3)), "f: found vertex 8", "0 to 5")
        table = m["kintree_table"].copy()
        table[0, 5] = 9
        self.refused(self.file("a.npz", npz(kintree_table=table)), "joint 5", "parent 9")
        self.refused(self.file("a.npz", npz()), "found 12 directions, expected at least 300", options=("--shapes", "300"))

    def test_missing_arrays_are_all_named(self):
        out = io.BytesIO()
        np.savez(out, v_template=np.zeros((3, 3)))
        self.refused(self.file("a.npz", out.getvalue()), "shapedirs, J_regressor, weights, f, kintree_table")

    def test_unknown_or_damaged_objects_are_refused(self):
        unknown = new_object("chumpy.linalg", "Svd", {})
        self.refused(self.file("a.pkl", old_pickle(weights=unknown)), "chumpy.linalg.Svd")
        self.refused(self.file("a.pkl", old_pickle(weights=new_object("chumpy.ch", "Ch", {"y": 1}))), "weights")
        broken = sparse(model()["J_regressor"])
        broken.state["indices"] = array(np.full(len(broken.state["data"].state[4]) // 8, 99, dtype=np.int32))
        self.refused(self.file("a.pkl", old_pickle(J_regressor=broken)), "J_regressor", "do not fit its shape")
        self.refused(self.file("a.pkl", dumps([1])), "a.pkl", "list")


if __name__ == "__main__":
    unittest.main()
