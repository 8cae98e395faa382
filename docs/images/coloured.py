#!/usr/bin/env python3
"""Makes coloured OBJ files of GLB files without animation, which `npt render` draws: the colours of materials, of their
PNG textures and of vertices, one for each corner. All of one call are scaled and moved alike: the highest is as high as
given, the lowest stands on the floor.
usage: coloured.py HEIGHT OUT_FOLDER FRAME.glb ...
Python's standard library is enough."""

import json
import struct
import sys
import zlib
from pathlib import Path

COMPONENTS = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
COUNTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
FULL = {5121: 255.0, 5123: 65535.0}


def read_glb(path):
    data = path.read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    scene = json.loads(data[20:20 + length])
    binary = data[20 + length + 8:] if len(data) > 20 + length else b""
    return scene, binary


def accessor(scene, binary, index):
    """Tuples of numbers; integers that stand for fractions become fractions where the file says so."""
    found = scene["accessors"][index]
    view = scene["bufferViews"][found["bufferView"]]
    kind, count = COMPONENTS[found["componentType"]], COUNTS[found["type"]]
    item = struct.Struct("<" + kind * count)
    stride = view.get("byteStride", item.size)
    begin = view.get("byteOffset", 0) + found.get("byteOffset", 0)
    values = [item.unpack_from(binary, begin + i * stride) for i in range(found["count"])]
    if found.get("normalized"):
        full = FULL[found["componentType"]]
        values = [tuple(number / full for number in value) for value in values]
    return values


def paeth(a, b, c):
    pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def read_png(data):
    """Width, height and a function that gives a pixel's colour in 0 to 1; None for other kinds of pictures."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        return None
    place, packed, palette = 8, b"", b""
    while place < len(data):
        length, kind = struct.unpack_from(">I4s", data, place)
        chunk = data[place + 8:place + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunk)
        elif kind == b"PLTE":
            palette = chunk
        elif kind == b"IDAT":
            packed += chunk
        place += 12 + length
    if depth != 8 or interlaced:
        return None
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    raw, stride, rows, before = zlib.decompress(packed), width * channels, [], bytearray(width * channels)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left = row[i - channels] if i >= channels else 0
            corner = before[i - channels] if i >= channels else 0
            added = (0, left, before[i], (left + before[i]) // 2, paeth(left, before[i], corner))[kind]
            row[i] = (row[i] + added) & 255
        rows.append(row)
        before = row

    def pixel(x, y):
        values = rows[y][x * channels:(x + 1) * channels]
        if colour == 3:
            values = palette[3 * values[0]:3 * values[0] + 3]
        elif channels < 3:
            values = [values[0]] * 3
        return tuple(value / 255 for value in values[:3])

    return width, height, pixel


def srgb(linear):
    linear = min(max(linear, 0.0), 1.0)
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def pictures_of(scene, binary):
    pictures = []
    for image in scene.get("images", []):
        if "bufferView" not in image:
            pictures.append(None)
            continue
        view = scene["bufferViews"][image["bufferView"]]
        begin = view.get("byteOffset", 0)
        pictures.append(read_png(binary[begin:begin + view["byteLength"]]))
    return pictures


def times(a, b):
    """Matrices of four columns as glTF has them, a after b."""
    return [sum(a[4 * k + row] * b[4 * column + k] for k in range(4)) for column in range(4) for row in range(4)]


def matrix_of(node):
    if "matrix" in node:
        return node["matrix"]
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    sx, sy, sz = node.get("scale", (1, 1, 1))
    t = node.get("translation", (0, 0, 0))
    return [sx * (1 - 2 * (y * y + z * z)), sx * 2 * (x * y + z * w), sx * 2 * (x * z - y * w), 0,
            sy * 2 * (x * y - z * w), sy * (1 - 2 * (x * x + z * z)), sy * 2 * (y * z + x * w), 0,
            sz * 2 * (x * z + y * w), sz * 2 * (y * z - x * w), sz * (1 - 2 * (x * x + y * y)), 0, *t, 1]


def corners_of(path):
    """Triangles' corners, three a triangle: places, and colours."""
    scene, binary = read_glb(path)
    pictures, places, colours = pictures_of(scene, binary), [], []

    def visit(index, above):
        node = scene["nodes"][index]
        matrix = times(above, matrix_of(node))
        if "mesh" in node:
            for primitive in scene["meshes"][node["mesh"]]["primitives"]:
                add(primitive, matrix)
        for child in node.get("children", []):
            visit(child, matrix)

    def add(primitive, matrix):
        attributes = primitive["attributes"]
        positions = [tuple(m[0] * x + m[4] * y + m[8] * z + m[12] for m in (matrix, matrix[1:], matrix[2:]))
                     for x, y, z in accessor(scene, binary, attributes["POSITION"])]
        material = scene.get("materials", [{}])[primitive["material"]] if "material" in primitive else {}
        surface = material.get("pbrMetallicRoughness", {})
        factor = surface.get("baseColorFactor", (1, 1, 1, 1))
        if "baseColorTexture" not in surface and "baseColorFactor" not in surface:
            factor = (0.6, 0.6, 0.6, 1)
        tint = accessor(scene, binary, attributes["COLOR_0"]) if "COLOR_0" in attributes else None
        picture, uvs = None, None
        if "baseColorTexture" in surface:
            named = surface["baseColorTexture"]
            picture = pictures[scene["textures"][named["index"]].get("source", 0)]
            uvs = accessor(scene, binary, attributes[f"TEXCOORD_{named.get('texCoord', 0)}"])
        order = [value[0] for value in accessor(scene, binary, primitive["indices"])] if "indices" in primitive \
            else list(range(len(positions)))
        for i in range(0, len(order) - 2, 3):
            corners = order[i:i + 3]
            for corner in corners:
                colour = [srgb(f * (tint[corner][k] if tint else 1)) for k, f in enumerate(factor[:3])]
                if picture:
                    width, height, pixel = picture
                    # A little inside the triangle, lest the neighbour's colour in the picture is met.
                    u, v = (0.7 * uvs[corner][k] + 0.1 * sum(uvs[other][k] for other in corners) for k in range(2))
                    texel = pixel(int(u % 1 * width) % width, int(v % 1 * height) % height)
                    colour = [c * t for c, t in zip(colour, texel)]
                places.append(positions[corner])
                colours.append(colour)

    for root in scene["scenes"][scene.get("scene", 0)]["nodes"]:
        visit(root, matrix_of({}))
    return places, colours


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    height, out = float(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    frames = [(Path(name), *corners_of(Path(name))) for name in sys.argv[3:]]
    lowest = min(place[1] for _, places, _ in frames for place in places)
    tall = max(max(place[1] for place in places) - lowest for _, places, _ in frames)
    scale = height / tall
    middle = sum(place[0] for place in frames[0][1]) / len(frames[0][1])
    for path, places, colours in frames:
        with (out / f"{path.stem}.obj").open("w") as file:
            # One vertex for corners that agree, so that shading stays smooth.
            numbers, faces = {}, []
            for (x, y, z), colour in zip(places, colours):
                line = f"v {(x - middle) * scale:.5f} {(y - lowest) * scale:.5f} {z * scale:.5f} " \
                    f"{colour[0]:.3f} {colour[1]:.3f} {colour[2]:.3f}\n"
                if line not in numbers:
                    numbers[line] = len(numbers) + 1
                    file.write(line)
                faces.append(numbers[line])
            for i in range(0, len(faces), 3):
                a, b, c = faces[i:i + 3]
                if a != b and b != c and c != a:
                    file.write(f"f {a} {b} {c}\n")


if __name__ == "__main__":
    main()
