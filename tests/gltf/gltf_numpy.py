"""glTF evaluated with numpy, from the specification alone: an opinion that owes nothing to npt's code."""
import base64
import json
import struct

import numpy as np

TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Gltf:
    def __init__(self, path):
        data = open(path, "rb").read()
        length = struct.unpack_from("<I", data, 12)[0]
        self.doc = json.loads(data[20:20 + length])
        self.binary = data[28 + length:]

    def buffer(self, number):
        uri = self.doc["buffers"][number].get("uri")
        return base64.b64decode(uri.split(",")[1]) if uri else self.binary

    def rows(self, view, offset, count, kind, width):
        v = self.doc["bufferViews"][view]
        item = np.dtype(kind).itemsize * width
        stride = v.get("byteStride", item)
        start = v.get("byteOffset", 0) + offset
        data = self.buffer(v["buffer"])
        return np.array([np.frombuffer(data, kind, width, start + i * stride) for i in range(count)])

    def accessor(self, number):
        a = self.doc["accessors"][number]
        kind, width = np.dtype(TYPES[a["componentType"]]), WIDTHS[a["type"]]
        values = np.zeros((a["count"], width), kind)
        if "bufferView" in a:
            values = self.rows(a["bufferView"], a.get("byteOffset", 0), a["count"], kind, width)
        if "sparse" in a:
            s = a["sparse"]
            at = self.rows(s["indices"]["bufferView"], s["indices"].get("byteOffset", 0), s["count"],
                           np.dtype(TYPES[s["indices"]["componentType"]]), 1)[:, 0]
            values = values.copy()
            values[at] = self.rows(s["values"]["bufferView"], s["values"].get("byteOffset", 0), s["count"], kind, width)
        if a.get("normalized") and kind != np.float32:
            return np.maximum(values / float(np.iinfo(kind).max), -1.0)
        return values.astype(np.float64)

    def sample(self, sampler, time, width, rotation):
        times = self.accessor(sampler["input"])[:, 0]
        values = self.accessor(sampler["output"])
        how = sampler.get("interpolation", "LINEAR")
        values = values.reshape(len(times), 3 if how == "CUBICSPLINE" else 1, width)
        middle = values[:, 1] if how == "CUBICSPLINE" else values[:, 0]
        if time <= times[0]:
            result = middle[0]
        elif time >= times[-1]:
            result = middle[-1]
        else:
            k = int(np.searchsorted(times, time, side="right")) - 1
            span = times[k + 1] - times[k]
            t = (time - times[k]) / span
            if how == "STEP":
                result = middle[k]
            elif how == "CUBICSPLINE":
                result = ((2 * t**3 - 3 * t**2 + 1) * middle[k] + span * (t**3 - 2 * t**2 + t) * values[k, 2]
                          + (3 * t**2 - 2 * t**3) * middle[k + 1] + span * (t**3 - t**2) * values[k + 1, 0])
            elif rotation:
                a, b = middle[k] / np.linalg.norm(middle[k]), middle[k + 1] / np.linalg.norm(middle[k + 1])
                d = a @ b
                angle = np.arccos(min(abs(d), 1.0))
                if angle < 1e-8:
                    result = a
                else:
                    result = (np.sin((1 - t) * angle) * a + np.sign(d) * np.sin(t * angle) * b) / np.sin(angle)
            else:
                result = (1 - t) * middle[k] + t * middle[k + 1]
        return result / np.linalg.norm(result) if rotation else result

    def local(self, node, moved):
        if "matrix" in node:
            return np.array(node["matrix"], np.float64).reshape(4, 4).T
        x, y, z, w = np.array(moved.get("rotation", node.get("rotation", [0, 0, 0, 1])), np.float64)
        n = np.sqrt(x * x + y * y + z * z + w * w)
        x, y, z, w = x / n, y / n, z / n, w / n
        matrix = np.eye(4)
        matrix[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                          [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                          [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        matrix[:3, :3] *= np.array(moved.get("scale", node.get("scale", [1, 1, 1])), np.float64)
        matrix[:3, 3] = moved.get("translation", node.get("translation", [0, 0, 0]))
        return matrix

    def positions(self, clip=None, time=0.0):
        """[V, 3]: the meshes of the scene in the order of its nodes, each attribute set once."""
        doc, nodes = self.doc, self.doc.get("nodes", [])
        moved = [{} for _ in nodes]
        if clip is not None:
            animation = doc["animations"][clip]
            for channel in animation["channels"]:
                target = channel["target"]
                if "node" not in target:
                    continue
                path = target["path"]
                width = {"rotation": 4, "weights": 0}.get(path, 3)
                if path == "weights":
                    width = len(doc["meshes"][nodes[target["node"]]["mesh"]]["primitives"][0]["targets"])
                moved[target["node"]][path] = self.sample(animation["samplers"][channel["sampler"]], time, width,
                                                          path == "rotation")
        world, order = [None] * len(nodes), []

        def visit(number, above):
            world[number] = above @ self.local(nodes[number], moved[number])
            order.append(number)
            for child in nodes[number].get("children", []):
                visit(child, world[number])

        children = {c for n in nodes for c in n.get("children", [])}
        roots = [n for n in range(len(nodes)) if n not in children]
        if "scenes" in doc:
            roots = doc["scenes"][doc.get("scene", 0)].get("nodes", [])
        for root in roots:
            visit(root, np.eye(4))
        result = []
        for number in order:
            node = nodes[number]
            if "mesh" not in node:
                continue
            mesh, done = doc["meshes"][node["mesh"]], []
            for primitive in mesh["primitives"]:
                key = json.dumps([primitive["attributes"], primitive.get("targets")])
                if key in done:
                    continue
                done.append(key)
                result.append(self.primitive(primitive, mesh, node, moved[number], world, number))
        return np.concatenate(result)

    def primitive(self, primitive, mesh, node, moved, world, number):
        attributes = primitive["attributes"]
        points = self.accessor(attributes["POSITION"])
        weights = moved.get("weights", node.get("weights", mesh.get("weights")))
        for i, target in enumerate(primitive.get("targets", [])):
            if "POSITION" in target and weights is not None:
                points = points + weights[i] * self.accessor(target["POSITION"])
        points = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        if "skin" not in node or "JOINTS_0" not in attributes:
            return (points @ world[number].T)[:, :3]
        skin = self.doc["skins"][node["skin"]]
        binds = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
        if "inverseBindMatrices" in skin:
            binds = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = np.array([world[j] @ binds[i] for i, j in enumerate(skin["joints"])])
        sets = [s for s in range(8) if "JOINTS_%d" % s in attributes]
        number_of = np.concatenate([self.accessor(attributes["JOINTS_%d" % s]) for s in sets], axis=1).astype(int)
        share = np.concatenate([self.accessor(attributes["WEIGHTS_%d" % s]) for s in sets], axis=1)
        total = share.sum(axis=1, keepdims=True)
        share = np.where(total > 0, share / np.where(total > 0, total, 1), np.eye(share.shape[1])[0])
        number_of = np.where((total > 0) & (share > 0), number_of, 0)
        return np.einsum("vk,vkij,vj->vi", share, joints[number_of], points)[:, :3]
