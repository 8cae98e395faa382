"""Scenes as npt evaluates them and as gltf_numpy.py does: python3 test_evaluation.py DUMP_GLTF [FILE.glb ...]

Without files: small ones made here, of every kind of accessor, interpolation and node.
"""
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np

from gltf_numpy import Gltf

KINDS = {np.dtype(np.int8): 5120, np.dtype(np.uint8): 5121, np.dtype(np.int16): 5122, np.dtype(np.uint16): 5123,
         np.dtype(np.uint32): 5125, np.dtype(np.float32): 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Builder:
    def __init__(self):
        self.doc = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "buffers": [{}]}
        self.data = b""

    def view(self, data, stride=None):
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.data += data
        self.doc["bufferViews"].append(view)
        return len(self.doc["bufferViews"]) - 1

    def add(self, accessor):
        self.doc["accessors"].append(accessor)
        return len(self.doc["accessors"]) - 1

    def accessor(self, values, normalized=False, pad=0):
        values = np.asarray(values)
        rows = values.reshape(len(values), -1)
        raw = [row.tobytes() + b"\x7f" * pad for row in rows]
        accessor = {"bufferView": self.view(b"".join(raw), len(raw[0]) if pad else None), "count": len(rows),
                    "componentType": KINDS[values.dtype], "type": TYPES[rows.shape[1]]}
        if normalized:
            accessor["normalized"] = True
        return self.add(accessor)

    def write(self, path):
        self.doc["buffers"][0]["byteLength"] = len(self.data)
        text = json.dumps(self.doc).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        with open(path, "wb") as f:
            f.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(data), len(text), 0x4E4F534A) + text)
            f.write(struct.pack("<II", len(data), 0x004E4942) + data)


def unit(rows):
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


def small_scene(path, random, positions, **how):
    """A node under turned and scaled ones, a chain of joints, morph targets, and a clip of everything."""
    b = Builder()
    n = 50
    attributes = {"POSITION": b.accessor(positions, **how)}
    joints = random.integers(0, 3, (n, 8)).astype(np.uint8)
    weights = random.random((n, 8)).astype(np.float32)
    weights[:5] = 0
    attributes["JOINTS_0"], attributes["JOINTS_1"] = b.accessor(joints[:, :4], pad=4), b.accessor(joints[:, 4:])
    attributes["WEIGHTS_0"], attributes["WEIGHTS_1"] = b.accessor(weights[:, :4]), b.accessor(weights[:, 4:])
    dense = b.accessor(random.normal(size=(n, 3)).astype(np.float32), pad=8)
    at, moved = np.array([3, 7, 40], np.uint16), random.normal(size=(3, 3)).astype(np.float32)
    sparse = {"count": 3, "indices": {"bufferView": b.view(at.tobytes()), "componentType": 5123},
              "values": {"bufferView": b.view(moved.tobytes())}}
    alone = b.add({"count": n, "componentType": 5126, "type": "VEC3", "sparse": sparse})
    over = b.add(dict(b.doc["accessors"][dense], sparse=sparse))
    corners = b.accessor(random.integers(0, n, 90).astype(np.uint16))
    plain = {"POSITION": attributes["POSITION"]}
    targets = [{"POSITION": dense}, {"POSITION": alone}, {"POSITION": over}]
    b.doc["meshes"] = [{"primitives": [{"attributes": attributes, "indices": corners, "targets": targets},
                                       {"attributes": attributes, "indices": corners, "targets": targets}],
                        "weights": [0.1, -0.2, 0.3]},
                       {"primitives": [{"attributes": plain, "mode": 5}, {"attributes": plain, "mode": 6}]}]
    binds = np.tile(np.eye(4), (3, 1, 1)) + 0.1 * random.normal(size=(3, 4, 4))
    binds[:, 3] = [0, 0, 0, 1]
    b.doc["skins"] = [{"joints": [2, 3, 4],
                       "inverseBindMatrices": b.accessor(binds.transpose(0, 2, 1).reshape(3, 16).astype(np.float32))}]
    turned = [float(x) for x in unit(random.normal(size=(1, 4)))[0]]
    matrix = np.eye(4)
    matrix[:3] += 0.2 * random.normal(size=(3, 4))
    b.doc["nodes"] = [{"children": [1, 2, 5], "rotation": turned, "scale": [1, 2, 0.5], "translation": [1, 2, 3]},
                      {"mesh": 0, "skin": 0}, {"children": [3]}, {"children": [4], "rotation": turned},
                      {"translation": [0, 1, 0]}, {"mesh": 1, "matrix": matrix.T.reshape(-1).tolist()},
                      {"mesh": 0, "weights": [1, 0, 2]}]
    b.doc["scenes"] = [{"nodes": []}, {"nodes": [6, 0]}]
    b.doc["scene"] = 1
    times = b.accessor(np.array([0.1, 0.4, 0.9, 1.5], np.float32))
    samplers, channels = [], []

    def move(node, target, values, interpolation, normalized=False):
        samplers.append({"input": times, "output": b.accessor(values, normalized), "interpolation": interpolation})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": target}})

    move(0, "rotation", unit(random.normal(size=(4, 4))), "LINEAR")
    move(2, "rotation", unit(random.normal(size=(12, 4))), "CUBICSPLINE")
    move(3, "rotation", np.round(32767 * unit(random.normal(size=(4, 4)))).astype(np.int16), "LINEAR", True)
    move(4, "rotation", unit(random.normal(size=(4, 4))), "STEP")
    move(4, "translation", random.normal(size=(12, 3)).astype(np.float32), "CUBICSPLINE")
    move(2, "scale", (1 + 0.1 * random.random((4, 3))).astype(np.float32), "LINEAR")
    move(3, "translation", random.normal(size=(4, 3)).astype(np.float32), "STEP")
    move(1, "weights", random.normal(size=12).astype(np.float32), "LINEAR")
    move(6, "weights", random.normal(size=36).astype(np.float32), "CUBICSPLINE")
    b.doc["animations"] = [{"name": "all", "samplers": samplers, "channels": channels}]
    b.write(path)


def small_scenes(folder):
    random = np.random.default_rng(1)
    p = random.normal(size=(50, 3))
    kinds = [("float", p.astype(np.float32), {}), ("interleaved", p.astype(np.float32), {"pad": 12}),
             ("short", np.round(30 * p).astype(np.int16), {"pad": 2}),
             ("byte", np.round(30 * p).astype(np.int8), {"normalized": True, "pad": 1}),
             ("ushort", np.round(9000 * abs(p)).astype(np.uint16), {"normalized": True, "pad": 2}),
             ("ubyte", np.round(30 * abs(p)).astype(np.uint8), {"pad": 1})]
    for name, positions, how in kinds:
        path = os.path.join(folder, name + ".glb")
        small_scene(path, random, positions, **how)
        yield path


def check(dump, path):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([dump, path, folder], check=True, stdout=subprocess.DEVNULL)
        # Only libdraco reads what Draco compressed: of those files npt's own copy is evaluated.
        gltf = Gltf(path)
        own = "KHR_draco_mesh_compression" in gltf.doc.get("extensionsUsed", [])
        gltf = Gltf(os.path.join(folder, "scene.glb")) if own else gltf
        rest = np.fromfile(os.path.join(folder, "rest.bin")).reshape(-1, 3)
        height = np.ptp(rest[:, 1])
        worst = np.abs(gltf.positions() - rest).max()
        frames = np.fromfile(os.path.join(folder, "frames.bin")).reshape(-1, 2 + rest.size)
        for row in frames:
            worst = max(worst, np.abs(gltf.positions(int(row[0]), row[1]) - row[2:].reshape(-1, 3)).max())
        print("%s: %d vertices, %d frames, worst difference %.1e of the height" %
              (os.path.basename(path), len(rest), len(frames), worst / height))
        return worst <= 1e-5 * height


def main():
    dump, files = sys.argv[1], sys.argv[2:]
    with tempfile.TemporaryDirectory() as folder:
        good = [check(dump, path) for path in (files or list(small_scenes(folder)))]
    sys.exit(0 if all(good) and good else 1)


main()
