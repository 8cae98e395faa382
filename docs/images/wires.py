#!/usr/bin/env python3
"""Makes OBJ files that `npt render` draws as a wireframe and as a chessboard by UVs, of GLB files without animation: each
triangle is cut into small ones whose vertices have colours.
usage: wires.py OUT_FOLDER MESH.glb ...        makes OUT_FOLDER/NAME-wires.obj and OUT_FOLDER/NAME-uv.obj
All of one call are one character: they are scaled alike, the first to a height of 1.8 m.
SQUARES along a side of the UV space (default 24) in the environment. Python's standard library is enough."""

import math
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from coloured import accessor, matrix_of, read_glb, times  # noqa: E402

SURFACE, LINE, LIGHT, DARK = (0.62, 0.72, 0.83), (0.10, 0.16, 0.24), (0.93, 0.90, 0.82), (0.24, 0.42, 0.60)
HEIGHT = 1.8
STEP = 0.007        # metres between vertices of small triangles
HALF_LINE = 0.0028  # metres, so that a line is about a pixel wide


def triangles_of(path):
    """Corners as places and UVs, three a triangle."""
    scene, binary = read_glb(path)
    corners = []

    def visit(index, above):
        node = scene["nodes"][index]
        m = times(above, matrix_of(node))
        for primitive in scene["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            attributes = primitive["attributes"]
            places = [tuple(m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k] for k in range(3))
                      for x, y, z in accessor(scene, binary, attributes["POSITION"])]
            uvs = accessor(scene, binary, attributes["TEXCOORD_0"])
            order = [value[0] for value in accessor(scene, binary, primitive["indices"])]
            corners.extend((places[i], uvs[i]) for i in order)
        for child in node.get("children", []):
            visit(child, m)

    for root in scene["scenes"][scene.get("scene", 0)]["nodes"]:
        visit(root, matrix_of({}))
    return [corners[i:i + 3] for i in range(0, len(corners) - 2, 3)]


def mixed(weights, values):
    return tuple(sum(w * value[k] for w, value in zip(weights, values)) for k in range(len(values[0])))


class Writer:
    """One vertex for those that agree in place and colour."""

    def __init__(self, path):
        self.file, self.numbers = path.open("w"), {}

    def number(self, place, colour):
        line = "v {:.5f} {:.5f} {:.5f} {:.3f} {:.3f} {:.3f}\n".format(*place, *colour)
        if line not in self.numbers:
            self.numbers[line] = len(self.numbers) + 1
            self.file.write(line)
        return self.numbers[line]

    def triangle(self, numbers):
        if len(set(numbers)) == 3:
            self.file.write("f {} {} {}\n".format(*numbers))


def draw(triangle, squares, wires, board):
    places, uvs = [corner[0] for corner in triangle], [corner[1] for corner in triangle]
    sides = [math.dist(places[(k + 1) % 3], places[(k + 2) % 3]) for k in range(3)]
    half = sum(sides) / 2
    area = math.sqrt(max(half * (half - sides[0]) * (half - sides[1]) * (half - sides[2]), 0))
    heights = [2 * area / side if side > 0 else 0 for side in sides]  # of the corners above their opposite sides
    n = min(max(2, math.ceil(max(sides) / STEP)), 40)

    def vertex(i, j):
        weights = (i / n, j / n, (n - i - j) / n)
        edge = min(w * h for w, h in zip(weights, heights)) < HALF_LINE
        return weights, wires.number(mixed(weights, places), LINE if edge else SURFACE)

    for i in range(n):
        for j in range(n - i):
            small = [((i, j), (i + 1, j), (i, j + 1))]
            if i + j + 1 < n:
                small.append(((i + 1, j), (i + 1, j + 1), (i, j + 1)))
            for cells in small:
                found = [vertex(*cell) for cell in cells]
                wires.triangle([number for _, number in found])
                u, v = mixed([sum(w[k] for w, _ in found) / 3 for k in range(3)], uvs)
                colour = DARK if (math.floor(u * squares) + math.floor(v * squares)) % 2 else LIGHT
                board.triangle([board.number(mixed(w, places), colour) for w, _ in found])


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, squares = Path(sys.argv[1]), int(os.environ.get("SQUARES", "24"))
    out.mkdir(parents=True, exist_ok=True)
    scale = None
    for path in map(Path, sys.argv[2:]):
        triangles = triangles_of(path)
        lows, highs = ([limit(place[1] for triangle in triangles for place, _ in triangle)] for limit in (min, max))
        scale = scale or HEIGHT / (highs[0] - lows[0])  # that of the first for all
        triangles = [[(tuple(scale * x for x in place), uv) for place, uv in triangle] for triangle in triangles]
        wires, board = (Writer(out / f"{path.stem}-{kind}.obj") for kind in ("wires", "uv"))
        for triangle in triangles:
            draw(triangle, squares, wires, board)


if __name__ == "__main__":
    main()
