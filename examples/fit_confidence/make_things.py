#!/usr/bin/env python3
"""Makes meshes that are no whole person, to judge how well a program tells people from things.

    make_things.py --npt build/release/bin/npt --count 80 --seed 1 OUT_FOLDER

This writes OUT_FOLDER/KIND/000.obj, 001.obj and so on, --count files of each kind:

    furniture   chairs, tables, shelves, lamps, wardrobes, sofas, beds, step ladders, vases, carts
    implicit    closed blobs: metaballs, gyroids, superquadrics and tori, by marching tetrahedra
    plants      trees, firs, cacti, mushrooms, palms, flowers in pots, tufts of grass
    pieces      parts of bodies: busts, heads, hands, feet, legs, arms, torsos, lower bodies
    garments    shirts, trousers, dresses, skirts, coats, gloves, boots, hats, with nobody in them

--kinds makes only some of them. "npt generate" makes the bodies of which pieces and garments are cut. The same seed
makes the same files with the same npt. Every mesh has 200 to 8000 vertices, is 0.3 to 2.5 metres long, stands on the
floor with y up, and faces any way. Faces are triangles or quads whose front is outside. It needs numpy.
"""

import argparse
import itertools
import os
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    sys.exit("error: this program needs numpy (Debian: python3-numpy)")

LEAST_VERTICES, MOST_VERTICES = 200, 8000
LEAST_LENGTH, MOST_LENGTH = 0.3, 2.5
UP = np.array([0.0, 1.0, 0.0])


# Meshes and the solids that they are made of


class Mesh:
    """Vertices, and faces as arrays of three or four indices. "detail" is about how fine to make the solids."""

    def __init__(self, detail=1.0):
        self.detail = detail
        self.step = 0.075 / detail
        self.parts, self.faces, self.count = [], [], 0

    def add(self, vertices, *faces):
        self.faces += [np.asarray(face, int) + self.count for face in faces if len(face)]
        self.parts.append(np.asarray(vertices, float))
        self.count += len(vertices)

    def vertices(self):
        return np.concatenate(self.parts) if self.parts else np.zeros((0, 3))

    def scaled(self, fine):
        """How many of something to make, where "fine" is right for a detail of one."""
        return max(1, int(round(fine * self.detail)))


def unit(vector):
    return np.asarray(vector, float) / max(np.linalg.norm(vector), 1e-12)


def side_of(axis):
    """A direction at right angles to an axis."""
    axis = unit(axis)
    return unit(np.cross(axis, [0, 0, 1] if abs(axis[2]) < 0.9 else [1, 0, 0]))


def frame(axis, side=None):
    """A rotation matrix whose columns are a side, the axis, and side x axis: it turns y to the axis."""
    axis = unit(axis)
    side = side_of(axis) if side is None else unit(side - axis * np.dot(side, axis))
    return np.stack([side, axis, np.cross(side, axis)], 1)


def turn_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def random_rotation(rng):
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return rotation * np.sign(np.linalg.det(rotation))


def box(mesh, size, at, rotation=None, roundness=0.0):
    """A box with its centre at a point, of quads about a step wide. Roundness makes it a cushion."""
    size = np.asarray(size, float)
    n = np.maximum(1, np.ceil(size / mesh.step - 0.25)).astype(int)
    if roundness > 0:
        n = np.maximum(n, 4)
    corners = []
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        i, j = (grid.ravel() for grid in np.meshgrid(np.arange(n[b]), np.arange(n[c]), indexing="ij"))
        for end in (0, 1):
            quads = np.zeros((i.size, 4, 3), int)
            quads[..., a] = end * n[a]
            quads[..., b] = np.stack([i, i + 1, i + 1, i], 1)
            quads[..., c] = np.stack([j, j, j + 1, j + 1], 1)
            corners.append(quads if end else quads[:, ::-1])
    lattice, index = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    p = lattice / n * 2.0 - 1.0
    x2, y2, z2 = (p**2).T
    ball = p * np.sqrt(np.stack([1 - y2 / 2 - z2 / 2 + y2 * z2 / 3, 1 - z2 / 2 - x2 / 2 + z2 * x2 / 3,
                                 1 - x2 / 2 - y2 / 2 + x2 * y2 / 3], 1))
    p = ((1 - roundness) * p + roundness * ball) * size / 2
    mesh.add((p if rotation is None else p @ rotation.T) + at, index.reshape(-1, 4))


def beam(mesh, start, end, width, depth):
    """A box from a point to another."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    box(mesh, [width, np.linalg.norm(end - start), depth], (start + end) / 2, frame(end - start))


def ring_faces(rings, sides, closed=False):
    """The quads between rings of vertices that go round their way to the next ring."""
    i, j = (g.ravel() for g in np.meshgrid(np.arange(rings if closed else rings - 1), np.arange(sides), indexing="ij"))
    up, next_j = (i + 1) % rings, (j + 1) % sides
    return np.stack([i * sides + j, i * sides + next_j, up * sides + next_j, up * sides + j], 1)


def lathe(mesh, profile, at=(0, 0, 0), axis=UP, sides=None, closed=False, scale=(1, 1, 1), side=None):
    """Turns a profile of (radius, height) about an axis.

    The profile goes up the outside; where it starts or ends at radius zero, it closes. A closed profile makes a ring.
    """
    points = [np.asarray(profile[0], float)]
    for p, q in zip(profile, list(profile[1:]) + ([profile[0]] if closed else [])):
        p, q = np.asarray(p, float), np.asarray(q, float)
        n = max(1, int(np.ceil(np.linalg.norm(q - p) / mesh.step - 0.25)))
        points += [p + (q - p) * k / n for k in range(1, n + 1)]
    points = np.array(points[:-1] if closed else points)
    if sides is None:
        sides = int(np.clip(2 * np.pi * points[:, 0].max() / mesh.step, 8, 32))
    first, last = (not closed and points[e, 0] < 1e-9 for e in (0, -1))
    rings = points[int(first): len(points) - int(last)]
    angle = np.arange(sides) * 2 * np.pi / sides
    circle = np.stack([np.cos(angle), np.zeros(sides), -np.sin(angle)], 1)
    vertices = [(circle[None] * rings[:, None, :1] + UP * rings[:, None, 1:]).reshape(-1, 3)]
    faces, j, total = [ring_faces(len(rings), sides, closed)], np.arange(sides), len(rings) * sides
    if first:
        vertices.append(UP[None] * points[0, 1])
        faces.append(np.stack([np.full(sides, total), (j + 1) % sides, j], 1))
    if last:
        vertices.append(UP[None] * points[-1, 1])
        top = (len(rings) - 1) * sides
        faces.append(np.stack([np.full(sides, total + int(first)), top + j, top + (j + 1) % sides], 1))
    mesh.add((np.concatenate(vertices) * scale) @ frame(axis, side).T + at, *faces)


def rod(mesh, start, end, radius, end_radius=None, sides=None):
    """A cylinder, or a cone's lower part, from a point to another."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = np.linalg.norm(end - start)
    end_radius = radius if end_radius is None else end_radius
    lathe(mesh, [(0, 0), (radius, 0), (end_radius, length), (0, length)], start, end - start, sides)


def ellipsoid(mesh, radii, at, axis=UP, rings=6, sides=10, side=None):
    """An ellipsoid whose second radius goes along the axis."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, max(3, rings) + 1)
    profile = [(max(0.0, np.cos(a)) if 0 < k < len(angle) - 1 else 0.0, np.sin(a)) for k, a in enumerate(angle)]
    step, mesh.step = mesh.step, 10.0
    lathe(mesh, profile, at, axis, max(5, sides), scale=radii, side=side)
    mesh.step = step


def hoop(mesh, radius, thick, at, axis, sides=None):
    """A torus."""
    angle = np.arange(8) * np.pi / 4
    step, mesh.step = mesh.step, 10.0
    lathe(mesh, [(radius + thick * np.cos(a), thick * np.sin(a)) for a in angle], at, axis, sides or 16, closed=True)
    mesh.step = step


def tube(mesh, path, radii, sides=8, rounded=False, ribs=0, rib_depth=0.0):
    """A closed tube along a path. Rounded ends are half balls; ribs run along it."""
    path, radii = np.asarray(path, float), np.broadcast_to(radii, len(path)).astype(float)
    if rounded:
        angle = np.array([0.35, 0.8, 1.2])
        head, tail = unit(path[0] - path[1]), unit(path[-1] - path[-2])
        path = np.concatenate([path[0] + np.sin(angle[::-1, None]) * head * radii[0], path,
                               path[-1] + np.sin(angle[:, None]) * tail * radii[-1]])
        radii = np.concatenate([np.cos(angle[::-1]) * radii[0], radii, np.cos(angle) * radii[-1]])
    tangents = np.gradient(path, axis=0)
    side, vertices = side_of(tangents[0]), []
    angle = np.arange(sides) * 2 * np.pi / sides
    wave = 1 + rib_depth * np.cos(ribs * angle)
    for p, r, t in zip(path, radii, tangents):
        side = unit(side - unit(t) * np.dot(side, unit(t)))
        across = np.cross(unit(t), side)
        vertices.append(p + r * wave[:, None] * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * across))
    total, j, top = len(path) * sides, np.arange(sides), (len(path) - 1) * sides
    vertices.append(np.stack([path[0], path[-1]]))
    mesh.add(np.concatenate(vertices), ring_faces(len(path), sides),
             np.stack([np.full(sides, total), (j + 1) % sides, j], 1),
             np.stack([np.full(sides, total + 1), top + j, top + (j + 1) % sides], 1))


def strip(mesh, path, widths, side, fold=0.0):
    """A blade of two quads across, folded along its middle: an open surface."""
    path, side = np.asarray(path, float), unit(side)
    widths = np.asarray(widths, float)[:, None]
    up = unit(np.cross(path[-1] - path[0], side))
    rows = np.stack([path + widths * (side - fold * up), path, path - widths * (side + fold * up)], 1)
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(len(path) - 1), np.arange(2), indexing="ij"))
    at = i * 3 + j
    mesh.add(rows.reshape(-1, 3), np.stack([at, at + 1, at + 4, at + 3], 1))


def pick(rng, *choices):
    return choices[rng.integers(len(choices))]


# Furniture


def legs(mesh, rng, width, depth, height, inset=0.04, wide=None):
    """Four legs below a width x depth top: straight or splayed, square or round."""
    wide = rng.uniform(0.03, 0.06) if wide is None else wide
    splay, is_round = pick(rng, 0.0, 0.0, rng.uniform(0.02, 0.1)), rng.random() < 0.5
    for x, z in itertools.product((-1, 1), (-1, 1)):
        top = np.array([x * (width / 2 - inset), height, z * (depth / 2 - inset)])
        foot = top + [x * splay, -height, z * splay]
        if is_round:
            rod(mesh, foot, top, wide * 0.35, wide * 0.55)
        else:
            beam(mesh, foot, top, wide, wide)


def chair(mesh, rng):
    w, d, h = rng.uniform(0.38, 0.6), rng.uniform(0.38, 0.55), rng.uniform(0.38, 0.75)
    back, thick = rng.uniform(0.3, 0.7), rng.uniform(0.02, 0.08)
    legs(mesh, rng, w, d, h)
    box(mesh, [w, thick, d], [0, h + thick / 2, 0], roundness=pick(rng, 0, 0.25))
    lean = rng.uniform(0, 0.15)
    low, high = np.array([0, h, -d / 2 + 0.02]), np.array([0, h + back, -d / 2 - lean])
    style = rng.integers(3)
    if style == 0:
        beam(mesh, low, high, w * 0.95, 0.03)
    else:
        for x in (-1, 1):
            beam(mesh, low + [x * w * 0.45, 0, 0], high + [x * w * 0.45, 0, 0], 0.035, 0.035)
        count = rng.integers(2, 6)
        for k in range(count):
            t = (k + 1) / count
            if style == 1:
                at = low + (high - low) * t
                beam(mesh, at - [w * 0.45, 0.03, 0], at + [w * 0.45, -0.03, 0], 0.02, 0.06)
            else:
                x = [w * 0.9 * (t - 0.5 - 0.5 / count), 0, 0]
                rod(mesh, low + x, high + x, 0.012)
        beam(mesh, high - [w * 0.5, 0, 0], high + [w * 0.5, 0, 0], 0.03, 0.05)
    if rng.random() < 0.4:
        for x in (-1, 1):
            beam(mesh, [x * w * 0.5, h + 0.22, -d / 2], [x * w * 0.5, h + 0.22, d / 2], 0.05, 0.03)
            rod(mesh, [x * w * 0.5, h, d * 0.4], [x * w * 0.5, h + 0.21, d * 0.4], 0.018)


def table(mesh, rng):
    w, d, h, thick = rng.uniform(0.5, 2), rng.uniform(0.45, 1), rng.uniform(0.35, 1.1), rng.uniform(0.02, 0.06)
    if rng.random() < 0.4:
        r, foot = rng.uniform(0.3, 0.7), rng.uniform(0.18, 0.3)
        lathe(mesh, [(0, 0), (r, 0), (r, thick), (0, thick)], [0, h, 0])
        lathe(mesh, [(0, 0), (foot, 0), (foot, 0.03), (0.05, 0.08), (0.04, h), (0, h)])
        return
    box(mesh, [w, thick, d], [0, h + thick / 2, 0])
    legs(mesh, rng, w, d, h)
    if rng.random() < 0.5:
        box(mesh, [w * 0.9, 0.09, d * 0.9], [0, h - 0.045, 0])
    if rng.random() < 0.4:
        lathe(mesh, [(0, 0), (0.07, 0), (0.14, 0.07), (0.13, 0.075), (0.06, 0.015), (0, 0.015)],
              [rng.uniform(-0.2, 0.2) * w, h + thick, 0])


def shelf(mesh, rng):
    w, d, h, thick = rng.uniform(0.4, 1.3), rng.uniform(0.2, 0.45), rng.uniform(0.7, 2.2), 0.025
    boards = rng.integers(3, 7)
    for x in (-1, 1):
        box(mesh, [thick, h, d], [x * (w + thick) / 2, h / 2, 0])
    if rng.random() < 0.5:
        box(mesh, [w, h, 0.012], [0, h / 2, -d / 2 - 0.006])
    gap = (h - 0.08) / (boards - 1)
    for k in range(boards):
        y = 0.05 + k * gap
        box(mesh, [w, thick, d], [0, y, 0])
        x = -w / 2 + 0.03
        while k + 1 < boards and rng.random() < 0.75 and x < w / 2 - 0.1:
            book = [rng.uniform(0.025, 0.07), min(gap - 0.05, rng.uniform(0.15, 0.32)), rng.uniform(0.5, 0.9) * d]
            box(mesh, book, [x + book[0] / 2, y + thick / 2 + book[1] / 2, 0])
            x += book[0] + 0.004


def lamp(mesh, rng):
    h, base = pick(rng, rng.uniform(0.3, 0.6), rng.uniform(1.2, 2)), rng.uniform(0.1, 0.2)
    lathe(mesh, [(0, 0), (base, 0), (base, 0.02), (base * 0.3, 0.05), (0, 0.05)])
    top = np.array([0, h, 0])
    if rng.random() < 0.35:
        reach, t = rng.uniform(0.2, 0.5) * h, np.linspace(0, 1, 14)
        path = np.stack([reach * t**3, h * np.sin(t * 1.9) / np.sin(1.57), 0 * t], 1)
        tube(mesh, path, 0.014, 8)
        top = path[-1]
    else:
        rod(mesh, [0, 0.04, 0], top, rng.uniform(0.01, 0.03))
    low, high, tall = rng.uniform(0.13, 0.28), rng.uniform(0.06, 0.15), rng.uniform(0.16, 0.3)
    lathe(mesh, [(low, -tall / 2), (high, tall / 2), (high - 0.006, tall / 2), (low - 0.006, -tall / 2)], top,
          closed=True, sides=20)
    ellipsoid(mesh, [0.035, 0.05, 0.035], top)


def wardrobe(mesh, rng):
    w, d, h, doors = rng.uniform(0.7, 1.6), rng.uniform(0.4, 0.65), rng.uniform(1.2, 2.2), rng.integers(1, 4)
    box(mesh, [w, h, d], [0, 0.08 + h / 2, 0])
    for k in range(doors):
        wide = w / doors
        x = -w / 2 + (k + 0.5) * wide
        box(mesh, [wide - 0.02, h - 0.06, 0.02], [x, 0.08 + h / 2, d / 2 + 0.012])
        ellipsoid(mesh, [0.02, 0.06, 0.02], [x + wide * 0.4, 0.08 + h / 2, d / 2 + 0.04])
    legs(mesh, rng, w, d, 0.08, wide=0.06)
    if rng.random() < 0.5:
        box(mesh, [w + 0.08, 0.05, d + 0.06], [0, h + 0.105, 0])


def sofa(mesh, rng):
    w, d, h, seats = rng.uniform(0.8, 2.2), rng.uniform(0.7, 1), rng.uniform(0.3, 0.45), rng.integers(1, 4)
    back, arm, soft = rng.uniform(0.3, 0.55), rng.uniform(0.1, 0.22), rng.uniform(0.1, 0.35)
    legs(mesh, rng, w, d, 0.1, wide=0.05)
    box(mesh, [w, h - 0.1, d], [0, 0.1 + (h - 0.1) / 2, 0], roundness=0.05)
    box(mesh, [w, back + h - 0.1, 0.2], [0, 0.1 + (back + h - 0.1) / 2, -d / 2 + 0.06], roundness=soft * 0.6)
    for x in (-1, 1):
        if rng.random() < 0.92:
            box(mesh, [arm, h + 0.1, d], [x * (w / 2 + arm / 2), 0.1 + (h + 0.1) / 2, 0], roundness=soft * 0.6)
    wide = w / seats
    for k in range(seats):
        x = -w / 2 + (k + 0.5) * wide
        box(mesh, [wide * 0.98, 0.16, d * 0.8], [x, h + 0.07, 0.06], roundness=soft)
        box(mesh, [wide * 0.95, back * 0.9, 0.16], [x, h + 0.1 + back / 2, -d / 2 + 0.2], roundness=soft)


def bed(mesh, rng):
    w, d, h, head = rng.uniform(0.8, 1.8), rng.uniform(1.8, 2.1), rng.uniform(0.2, 0.5), rng.uniform(0.3, 0.8)
    legs(mesh, rng, w, d, h, wide=0.07)
    box(mesh, [w, 0.1, d], [0, h, 0])
    box(mesh, [w * 0.97, 0.2, d * 0.97], [0, h + 0.15, 0], roundness=0.1)
    box(mesh, [w, head + 0.2, 0.05], [0, h + head / 2, -d / 2 - 0.02])
    if rng.random() < 0.4:
        box(mesh, [w, 0.35, 0.05], [0, h + 0.1, d / 2 + 0.02])
    pillows = 1 if w < 1.2 else 2
    for k in range(pillows):
        box(mesh, [w / pillows * 0.8, 0.14, 0.4], [(k - (pillows - 1) / 2) * w / 2, h + 0.3, -d / 2 + 0.28],
            roundness=0.7)


def ladder(mesh, rng):
    h, low, high, spread = rng.uniform(0.7, 2.2), rng.uniform(0.4, 0.6), rng.uniform(0.25, 0.38), rng.uniform(0.25, 0.4)
    steps, flat = rng.integers(3, 8), rng.random() < 0.6
    for z in (-1, 1):
        for x in (-1, 1):
            beam(mesh, [x * low / 2, 0, z * spread * h], [x * high / 2, h, z * 0.04], 0.05, 0.025)
        for k in range(1, steps + 1 if z > 0 else 3):
            t = k / (steps + 0.3) if z > 0 else k / 3
            wide, at = (low + (high - low) * t) / 2, np.array([0, h * t, z * (spread * h * (1 - t) + 0.04 * t)])
            if flat and z > 0:
                box(mesh, [2 * wide, 0.025, 0.09], at)
            else:
                rod(mesh, at - [wide, 0, 0], at + [wide, 0, 0], 0.015)
    box(mesh, [high + 0.06, 0.03, 0.2], [0, h, 0])


def vase(mesh, rng):
    h, n = rng.uniform(0.3, 0.9), 10
    y = np.linspace(0, 1, n)
    phase, swing = rng.uniform(0, 6.28), rng.uniform(0.15, 0.6)
    r = h * rng.uniform(0.15, 0.32) * (1 + swing * np.sin(phase + rng.uniform(3, 6) * y))
    wall = 0.012
    outside = [(0, 0)] + [(a, b) for a, b in zip(r, y * h)]
    inside = [(max(a - wall, 0.01), b) for a, b in zip(r[::-1], y[::-1] * h)][:-1] + [(0, h * 0.06)]
    mesh.step = min(mesh.step, h / 8)
    lathe(mesh, outside + inside, sides=mesh.scaled(20))
    if rng.random() < 0.45:
        for x in (-1, 1):
            t = np.linspace(0, np.pi, 12)
            path = np.stack([x * (r[4] + h * 0.14 * np.sin(t)), h * (0.5 + 0.18 * np.cos(t)), 0 * t], 1)
            tube(mesh, path, h * 0.02, 8)


def cart(mesh, rng):
    w, d, h, deep = rng.uniform(0.4, 0.7), rng.uniform(0.6, 1.3), rng.uniform(0.15, 0.6), rng.uniform(0.12, 0.45)
    wheel = rng.uniform(0.06, min(0.28, h + 0.08))
    box(mesh, [w, 0.02, d], [0, h, 0])
    for s in (-1, 1):
        box(mesh, [0.02, deep, d], [s * w / 2, h + deep / 2, 0])
        box(mesh, [w, deep, 0.02], [0, h + deep / 2, s * d / 2])
    for z in (-1, 1):
        rod(mesh, [-w / 2 - 0.05, wheel, z * d * 0.36], [w / 2 + 0.05, wheel, z * d * 0.36], 0.014)
        for x in (-1, 1):
            at = np.array([x * (w / 2 + 0.05), wheel, z * d * 0.36])
            if wheel > 0.15:
                hoop(mesh, wheel - 0.02, 0.02, at, [1, 0, 0], mesh.scaled(20))
                for a in np.arange(6) * np.pi / 3:
                    rod(mesh, at, at + (wheel - 0.02) * np.array([0, np.cos(a), np.sin(a)]), 0.008, sides=6)
            else:
                rod(mesh, at - [0.02, 0, 0], at + [0.02, 0, 0], wheel, sides=mesh.scaled(14))
            beam(mesh, [x * w * 0.45, wheel, at[2]], [x * w * 0.45, max(h, wheel + 0.02), at[2]], 0.03, 0.03)
    grip = np.array([0, h + deep + rng.uniform(0.05, 0.4), -d / 2 - rng.uniform(0.05, 0.3)])
    for x in (-1, 1):
        rod(mesh, [x * w * 0.45, h + deep * 0.5, -d / 2], grip + [x * w * 0.45, 0, 0], 0.014)
    rod(mesh, grip - [w * 0.5, 0, 0], grip + [w * 0.5, 0, 0], 0.016)


FURNITURE = [chair, table, shelf, lamp, wardrobe, sofa, bed, ladder, vase, cart]


# Blobs


def marching_tetrahedra(values):
    """The surface where values on a grid change sign, in steps of the grid; above zero is inside.

    Each cell is six tetrahedra about its diagonal, so that neighbours meet. Vertices are shared.
    """
    shape, flat = values.shape, np.where(values == 0, 1e-9, values).ravel()
    strides = (shape[1] * shape[2], shape[2], 1)
    base = np.arange(flat.size).reshape(shape)[:-1, :-1, :-1].reshape(-1, 1)
    tetrahedra = []
    for i, j, k in itertools.permutations(range(3)):
        a, b, c = strides[i], strides[i] + strides[j], sum(strides)
        is_even = (i, j, k) in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        tetrahedra.append(base + np.array([0, a, b, c] if is_even else [0, b, a, c]))
    tetrahedra = np.concatenate(tetrahedra)
    case = (flat[tetrahedra] > 0) @ np.array([1, 2, 4, 8])
    edges = []  # (triangles, 3 corners, 2 ends of the grid's edge)
    for number in range(1, 15):
        inside = [k for k in range(4) if number >> k & 1]
        outside = [k for k in range(4) if k not in inside]
        order = outside + inside if len(inside) == 3 else inside + outside
        if sum(p > q for p, q in itertools.combinations(order, 2)) % 2:
            order[2:] = order[:1:-1]
        a, b, c, d = order
        if len(inside) == 1:
            triangles = [((a, b), (a, c), (a, d))]
        elif len(inside) == 3:
            triangles = [((a, b), (a, d), (a, c))]
        else:
            triangles = [((a, c), (a, d), (b, d)), ((a, c), (b, d), (b, c))]
        chosen = tetrahedra[case == number]
        edges += [chosen[:, np.array(triangle)] for triangle in triangles]
    edges = np.sort(np.concatenate(edges), axis=2)
    keys, faces = np.unique(edges[..., 0] * flat.size + edges[..., 1], return_inverse=True)
    p, q = keys // flat.size, keys % flat.size
    t = np.clip(flat[p] / (flat[p] - flat[q]), 0.05, 0.95)[:, None]
    at_p, at_q = (np.stack(np.unravel_index(node, shape), 1).astype(float) for node in (p, q))
    return at_p + t * (at_q - at_p), faces.reshape(-1, 3)


def chain(rng, count, reach):
    """Points near each other, in a box from -1 to 1."""
    points = [rng.uniform(-0.3, 0.3, 3)]
    while len(points) < count:
        points.append(np.clip(points[rng.integers(len(points))] + unit(rng.normal(size=3)) * reach, -0.58, 0.58))
    return points


def metaballs(rng, p):
    total = np.zeros(p.shape[:-1])
    for centre in chain(rng, rng.integers(3, 14), rng.uniform(0.22, 0.36)):
        total += np.exp(-np.sum((p - centre) ** 2, -1) / rng.uniform(0.1, 0.24) ** 2)
    return total - 0.42


def gyroid(rng, p):
    rate = rng.uniform(3.5, 6)
    x, y, z = np.moveaxis(p @ random_rotation(rng).T * rate + rng.uniform(0, 6, 3), -1, 0)
    wave = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    solid = 0.55 - np.abs(wave) if rng.random() < 0.4 else wave + rng.uniform(0.1, 0.7)
    return np.minimum(solid / rate, rng.uniform(0.7, 0.9) - np.linalg.norm(p, axis=-1))


def joined(fields, sharp=14.0):
    """The smooth union of shapes."""
    return np.log(np.sum(np.exp(np.clip(sharp * np.stack(fields), -60, 60)), 0)) / sharp


def superquadrics(rng, p):
    fields = []
    for centre in chain(rng, rng.integers(1, 6), rng.uniform(0.25, 0.5)):
        size, (e, f) = rng.uniform(0.12, 0.42, 3), rng.uniform(0.3, 2.2, 2)
        x, y, z = np.moveaxis(np.abs((p - centre) @ random_rotation(rng).T) / size + 1e-6, -1, 0)
        inside = ((x ** (2 / f) + y ** (2 / f)) ** (f / e) + z ** (2 / e)) ** (e / 2)
        fields.append((1 - inside) * size.min())
    return joined(fields, 20)


def tori(rng, p):
    fields, at = [], rng.uniform(-0.2, 0.2, 3)
    for _ in range(rng.integers(1, 6)):
        radius, thick, turn = rng.uniform(0.2, 0.42), rng.uniform(0.09, 0.16), random_rotation(rng)
        x, y, z = np.moveaxis((p - at) @ turn, -1, 0)
        fields.append(thick - np.hypot(np.hypot(x, z) - radius, y))
        angle = rng.uniform(0, 6.28)
        at = np.clip(at + turn @ np.array([np.cos(angle), 0, np.sin(angle)]) * radius * 1.3, -0.4, 0.4)
    return joined(fields, 25)


def blob(mesh, rng, field):
    n = max(14, int(round(rng.integers(28, 41) * min(1.0, mesh.detail))))
    line = np.linspace(-1, 1, n)
    values = field(rng, np.stack(np.meshgrid(line, line, line, indexing="ij"), -1))
    edge = np.ones(values.shape, bool)
    edge[1:-1, 1:-1, 1:-1] = False
    values[edge] = np.minimum(values[edge], -1e-3)
    vertices, faces = marching_tetrahedra(values)
    vertices, faces = kept(vertices, faces, largest_component(len(vertices), faces))
    vertices = smoothed(vertices, [faces], 2)
    stretch = rng.uniform(0.6, 1.4, 3) * ([1, 1, 1] if rng.random() < 0.5 else [1, 2, 1])
    vertices = vertices * stretch @ random_rotation(rng).T if rng.random() < 0.4 else vertices * stretch
    mesh.add(vertices * pick(rng, rng.uniform(0.3, 1), rng.uniform(1, 2.5)) / np.ptp(vertices, axis=0).max(), faces)


IMPLICIT = [lambda mesh, rng, field=field: blob(mesh, rng, field) for field in (metaballs, gyroid, superquadrics, tori)]


# Plants


def tree(mesh, rng):
    leaf_balls, depth, spread = rng.random() < 0.4, rng.integers(2, 5), rng.uniform(0.4, 0.8)
    shrink, flare = rng.uniform(0.6, 0.75), rng.uniform(0.05, 0.09)

    def branch(start, way, length, radius, level):
        way, path = unit(way), [start]
        for _ in range(4):
            way = unit(way + rng.normal(size=3) * 0.12 + UP * 0.05)
            path.append(path[-1] + way * length / 4)
        tube(mesh, path, np.linspace(radius, radius * 0.65, 5), max(5, mesh.scaled(9 - 2 * (depth - level))))
        if level == 0:
            if leaf_balls:
                size = length * rng.uniform(0.45, 0.8)
                ellipsoid(mesh, size * rng.uniform(0.7, 1.2, 3), path[-1], rings=mesh.scaled(6), sides=mesh.scaled(9))
            for _ in range(0 if leaf_balls else mesh.scaled(10)):
                at, side = path[rng.integers(1, 5)], unit(rng.normal(size=3))
                along = unit(rng.normal(size=3) + way) * rng.uniform(0.05, 0.1)
                strip(mesh, [at, at + along * 0.5, at + along], [0.003, 0.025, 0.002], np.cross(along, side))
            return
        for k in range(rng.integers(2, 4) if level < depth else rng.integers(3, 5)):
            angle = 2.4 * k + rng.uniform(0, 1.5)
            out = frame(way) @ np.array([np.cos(angle), 0, np.sin(angle)])
            start = path[-1] if k < 2 else path[rng.integers(2, 5)]
            branch(start, way + out * spread * rng.uniform(0.8, 1.4), length * shrink * rng.uniform(0.8, 1.2),
                   radius * 0.6, level - 1)

    branch(np.zeros(3), UP, rng.uniform(0.5, 0.9), flare, depth)


def fir(mesh, rng):
    h, layers, wide = rng.uniform(0.6, 2.2), rng.integers(3, 8), rng.uniform(0.2, 0.35)
    rod(mesh, [0, 0, 0], [0, h * 0.8, 0], h * 0.035, h * 0.01)
    for k in range(layers):
        t = k / layers
        r, y, tall = h * wide * (1 - 0.8 * t), h * (0.15 + 0.75 * t), h * 0.9 / layers + h * 0.08
        lathe(mesh, [(0, 0.03 * h), (r, 0), (r * 0.5, tall * 0.45), (0, tall)], [0, y, 0], sides=mesh.scaled(18))


def cactus(mesh, rng):
    style = rng.integers(4)
    if style == 0:  # A prickly pear.
        pads = [(np.zeros(3), UP)]
        for _ in range(rng.integers(5, 14)):
            at, way = pads[rng.integers(len(pads))]
            pads.append((at + way * rng.uniform(0.2, 0.28), unit(way + rng.normal(size=3) * [0.6, 0.1, 0.3])))
        for at, way in pads:
            side = rng.normal(size=3)
            ellipsoid(mesh, [0.11, 0.15, 0.035], at + way * 0.14, way, mesh.scaled(9), mesh.scaled(14), side)
        return
    h, r, ribs = rng.uniform(1, 2.3), rng.uniform(0.07, 0.16), rng.integers(6, 11)
    sides = ribs * (2 if mesh.detail < 1 else 3)
    n = max(6, mesh.scaled(h / 0.08))
    lean = rng.normal(size=2) * 0.04
    y = np.linspace(r * 0.6, h - r, n)
    swell = 1 + 0.12 * np.sin(np.linspace(0, 3, n))
    trunk = np.stack([lean[0] * y**2, y, lean[1] * y**2], 1)
    tube(mesh, trunk, r * swell, sides, True, ribs, rng.uniform(0.03, 0.12))
    angle = rng.uniform(0, 6.28)
    for k in range(rng.integers(1, 5)):  # Arms, often two opposite ones.
        angle += np.pi + rng.normal() * 0.3
        out, at = np.array([np.cos(angle), 0, np.sin(angle)]), trunk[int(n * rng.uniform(0.3, 0.65))]
        reach, rise, bend = r + rng.uniform(0.12, 0.35), rng.uniform(0.2, 0.45) * h, 0.12
        thin = r * rng.uniform(0.5, 0.8)
        turn = np.linspace(0, np.pi / 2, 6)[:, None]
        path = np.concatenate([at + out * np.linspace(0.3, 1, 4)[:-1, None] * (reach - bend),
                               at + out * (reach - bend + bend * np.sin(turn)) + UP * bend * (1 - np.cos(turn)),
                               at + out * reach + UP * (bend + rise * np.linspace(0.15, 1, 7)[:, None])])
        tube(mesh, path, thin, sides, True, ribs, 0.06)


def mushroom(mesh, rng):
    for k in range(rng.integers(1, 6)):
        size = rng.uniform(0.5, 1) * pick(rng, 0.3, 0.5)
        at = np.array([0, 0, 0]) if k == 0 else np.array([rng.uniform(-0.4, 0.4), 0, rng.uniform(-0.4, 0.4)])
        stem, cap, tall = size * rng.uniform(0.08, 0.2), size * rng.uniform(0.35, 0.7), size * rng.uniform(0.25, 0.6)
        mesh.step = size / 8 / mesh.detail
        lathe(mesh, [(0, 0), (stem * 1.4, 0), (stem, size * 0.4), (stem * 0.8, size), (0, size)], at,
              sides=mesh.scaled(14))
        angle = np.linspace(0, np.pi / 2, 7)
        dome = [(cap * np.cos(a), tall * np.sin(a)) for a in angle[:-1]] + [(0, tall)]
        lathe(mesh, [(0, size * 0.05), (cap * 0.9, -size * 0.03)] + dome, at + UP * size * 0.9,
              unit(UP + rng.normal(size=3) * 0.08), sides=mesh.scaled(24))


def palm(mesh, rng):
    h, n, lean = rng.uniform(0.6, 1.9), 16, rng.uniform(-0.4, 0.4)
    t = np.linspace(0, 1, n)
    trunk = np.stack([lean * t**2, h * t, 0 * t], 1)
    tube(mesh, trunk, (0.075 - 0.03 * t) * (1 + 0.12 * (np.arange(n) % 2)), mesh.scaled(10))
    fronds, long, droop = rng.integers(7, 15), rng.uniform(0.4, 0.8), rng.uniform(0.5, 1.2)
    for k in range(fronds):
        angle = 2 * np.pi * k / fronds + rng.uniform(-0.2, 0.2)
        out, s = np.array([np.cos(angle), 0, np.sin(angle)]), np.linspace(0, 1, 10)[:, None]
        path = trunk[-1] + out * long * s * 0.9 + UP * long * (rng.uniform(0.3, 0.7) * s - droop * s**2)
        across = np.cross(UP, out)
        strip(mesh, path, 0.06 * np.sin(np.pi * np.linspace(0.08, 0.98, 10)), across, 0.4)
        for row in range(1, mesh.scaled(9)):
            at = path[min(9, row)]
            for x in (-1, 1):
                tip = at + across * x * 0.16 * (1 - row / 14) + out * 0.08 - UP * 0.06
                strip(mesh, [at, (at + tip) / 2, tip], [0.012, 0.014, 0.002], out, 0.2)
    for _ in range(rng.integers(0, 5)):
        ellipsoid(mesh, [0.06, 0.07, 0.06], trunk[-1] + rng.normal(size=3) * 0.07 - UP * 0.07)


def flower(mesh, rng):
    low, high, tall = rng.uniform(0.08, 0.13), rng.uniform(0.12, 0.2), rng.uniform(0.15, 0.32)
    rim = high + 0.012
    lathe(mesh, [(0, 0), (low, 0), (high, tall), (rim, tall), (rim, tall + 0.03), (high - 0.01, tall + 0.03),
                 (high - 0.015, tall - 0.02), (0, tall - 0.02)], sides=mesh.scaled(18))
    for _ in range(rng.integers(1, 7)):
        h, out = rng.uniform(0.25, 0.9), rng.normal(size=3) * [0.15, 0, 0.15]
        foot, t = np.array([0, tall - 0.03, 0]) + out * 0.3, np.linspace(0, 1, 8)[:, None]
        stem = foot + UP * h * t + out * t**2
        tube(mesh, stem, 0.008, 6)
        axis = unit(stem[-1] - stem[-2] + rng.normal(size=3) * 0.04)
        turn, petals, size = frame(axis), rng.integers(5, 10), rng.uniform(0.04, 0.1)
        ellipsoid(mesh, [size * 0.5, size * 0.25, size * 0.5], stem[-1], axis, 4, 8)
        for k in range(petals):
            a = 2 * np.pi * k / petals
            way = unit(turn @ np.array([np.cos(a), rng.uniform(0.1, 0.5), np.sin(a)]))
            ellipsoid(mesh, [size * 0.4, size * 0.7, size * 0.08], stem[-1] + way * size * 0.9, way, 5, 7,
                      np.cross(way, axis))
        for at in stem[2:5:2]:
            a = rng.uniform(0, 6.28)
            way, s = np.array([np.cos(a), 0.4, np.sin(a)]), np.linspace(0, 1, 6)[:, None]
            leaf = at + way * 0.2 * s - UP * 0.15 * s**2
            strip(mesh, leaf, 0.04 * np.sin(np.pi * np.linspace(0.05, 0.99, 6)), np.cross(UP, way), 0.3)


def grass(mesh, rng):
    h, wide, spread = rng.uniform(0.3, 1.2), rng.uniform(0.006, 0.02), rng.uniform(0.03, 0.2)
    for _ in range(mesh.scaled(rng.integers(30, 160))):
        a, lean, tall = rng.uniform(0, 6.28), rng.uniform(0.05, 0.8), h * rng.uniform(0.5, 1)
        out, s = np.array([np.cos(a), 0, np.sin(a)]), np.linspace(0, 1, 7)[:, None]
        foot = rng.normal(size=3) * [spread, 0, spread]
        path = foot + UP * tall * (s - 0.35 * lean * s**2) + out * tall * lean * s**2
        strip(mesh, path, wide * (1.02 - s[:, 0] ** 2), np.cross(UP, out), 0.2)


PLANTS = [tree, cactus, mushroom, palm, flower, grass, fir]


# Surfaces of triangles: neighbours, cuts and smoothing


def kept(vertices, faces, keep):
    """The faces whose vertices are all kept, and their vertices."""
    faces = faces[keep[faces].all(1)]
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(-1, 3)


def components(count, faces):
    """A number for each vertex, the same in a component: the least of its vertices."""
    label = np.arange(count)
    while True:
        least = label[faces].min(1)
        new = label.copy()
        for k in range(faces.shape[1]):
            np.minimum.at(new, faces[:, k], least)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new


def largest_component(count, faces):
    """Whether each vertex is in the component with the most vertices."""
    label = components(count, faces)
    return label == np.bincount(label).argmax()


def without_crumbs(vertices, faces, least=25):
    label = components(len(vertices), faces)
    return kept(vertices, faces, np.bincount(label, minlength=len(vertices))[label] >= least)


def directed_edges(faces):
    return np.concatenate([np.stack([f, np.roll(f, -1, 1)], 2).reshape(-1, 2) for f in faces])


def boundary(faces):
    """The directed edges of one face only."""
    edges = directed_edges(faces)
    count = edges.max() + 1
    return edges[~np.isin(edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0])]


def normals_of(vertices, faces):
    total = np.zeros_like(vertices)
    for f in faces:
        for k in range(f.shape[1]):
            a, b, c = vertices[f[:, k - 1]], vertices[f[:, k]], vertices[f[:, (k + 1) % f.shape[1]]]
            np.add.at(total, f[:, k], np.cross(b - a, c - b))
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def smoothed(vertices, faces, rounds):
    """Moves vertices half way to the mean of their neighbours; those at a border stay in it."""
    edges, border = directed_edges(faces), boundary(faces)
    edges = np.concatenate([edges, edges[:, ::-1]])
    if len(border):
        at_border = np.zeros(len(vertices), bool)
        at_border[border] = True
        edges = np.concatenate([edges[~at_border[edges[:, 0]]], border, border[:, ::-1]])
    count = np.bincount(edges[:, 0], minlength=len(vertices))[:, None]
    for _ in range(rounds):
        total = np.zeros_like(vertices)
        np.add.at(total, edges[:, 0], vertices[edges[:, 1]])
        vertices = np.where(count > 0, 0.5 * vertices + 0.5 * total / np.maximum(count, 1), vertices)
    return vertices


def thickened(vertices, faces, thick):
    """A closed surface of an open one: a second layer inside, joined at the borders."""
    n, border = len(vertices), boundary(faces)
    inner = vertices - thick * normals_of(vertices, faces)
    sides = np.stack([border[:, 1], border[:, 0], border[:, 0] + n, border[:, 1] + n], 1)
    return np.concatenate([vertices, inner]), faces + [f[:, ::-1] + n for f in faces] + ([sides] if len(sides) else [])


def refined(vertices, faces):
    """Each triangle as four."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, 1)], 2), axis=2).reshape(-1, 2)
    pairs, index = np.unique(edges, axis=0, return_inverse=True)
    m = index.reshape(-1, 3) + len(vertices)
    a, b, c = faces.T
    rows = [(a, m[:, 0], m[:, 2]), (m[:, 0], b, m[:, 1]), (m[:, 2], m[:, 1], c), (m[:, 0], m[:, 1], m[:, 2])]
    return np.concatenate([vertices, vertices[pairs].mean(1)]), np.concatenate([np.stack(row, 1) for row in rows])


# Bodies


class Bodies:
    """Bodies that npt makes, all with the same faces, and where their vertices are on the mean body at rest."""

    def __init__(self, npt):
        self.npt = npt
        self.rest, self.faces = self.make("--shape", "zero", "--pose", "rest")

    def make(self, *options):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "body.obj")
            run = subprocess.run([self.npt, "generate", "--out", path, *options], capture_output=True, text=True)
            if run.returncode != 0:
                sys.exit("error: " + self.npt + " generate " + " ".join(options) + ": " + run.stderr.strip())
            with open(path) as file:
                lines = [line.split() for line in file]
        vertices = np.array([line[1:4] for line in lines if line and line[0] == "v"], float)
        faces = np.array([[int(c.split("/")[0]) for c in line[1:4]] for line in lines if line and line[0] == "f"])
        return vertices, faces - 1

    def draw(self, rng, *poses):
        options = ["--seed", str(rng.integers(1, 10**6)), "--pose", pick(rng, *poses)]
        vertices, faces = self.make(*options, *(["--proportions"] if rng.random() < 0.5 else []))
        if not np.array_equal(faces, self.faces):
            sys.exit("error: the bodies that npt generates do not have the same faces")
        return vertices


# Regions are on the mean body at rest: a T pose, 1.75 m tall, arms along x at y = 0.46, feet at -0.94, face along +z.
# The neck is at y = 0.53, the waist at 0.1, the crotch at -0.2, the wrists at x = 0.7, the ankles at y = -0.85.

REGIONS = {
    "bust": lambda x, y, z, t, s: (y > 0.2 + 0.14 * t) & (np.abs(x) < 0.18 + 0.1 * t),
    "head": lambda x, y, z, t, s: (y > 0.52 + 0.06 * t) & (np.abs(x) < 0.15),
    "hand": lambda x, y, z, t, s: s * x > 0.42 + 0.2 * t,
    "foot": lambda x, y, z, t, s: (y < -0.75 + 0.3 * t) & (s * x > 0),
    "leg": lambda x, y, z, t, s: (y < -0.22 + 0.16 * t + 0.5 * (s * x - 0.08)) & (s * x > 0),
    "arm": lambda x, y, z, t, s: (s * x > 0.15 + 0.12 * t) & (y > 0.36),
    "torso": lambda x, y, z, t, s: (np.abs(x) < 0.16 + 0.05 * t) & (y > -0.2 + 0.15 * t) & (y < 0.51),
    "lower body": lambda x, y, z, t, s: y < 0.18 * t,
}


def piece(mesh, rng, bodies, name):
    vertices = bodies.draw(rng, "natural", "natural", "random", "wide", "rest")
    keep = REGIONS[name](*bodies.rest.T, rng.random(), pick(rng, -1, 1))
    vertices, faces = kept(vertices, bodies.faces, keep)
    vertices, faces = kept(vertices, faces, largest_component(len(vertices), faces))
    while len(vertices) < LEAST_VERTICES:
        vertices, faces = refined(vertices, faces)
    if name in ("head", "bust", "hand", "foot") and rng.random() < 0.3:  # Parts larger than life, as statues have.
        vertices = vertices * rng.uniform(1.2, 3)
    mesh.add(vertices, faces)


# Garments


def cloth(rng, bodies, vertices, keep, low, high, smoothing):
    """The part of a body that is kept, moved outward by a smooth distance from low to high."""
    base, wave = rng.uniform(low, low + 0.6 * (high - low)), np.zeros(len(vertices))
    for _ in range(4):
        wave += np.sin(bodies.rest @ (unit(rng.normal(size=3)) * rng.uniform(8, 45)) + rng.uniform(0, 6.28)) / 4
    out = np.clip(base + wave * 0.3 * (high - low), low, high)
    pushed = vertices + normals_of(vertices, [bodies.faces]) * out[:, None]
    pushed, faces = without_crumbs(*kept(pushed, bodies.faces, keep))
    return smoothed(pushed, [faces], smoothing), faces


def put(mesh, rng, vertices, faces, thick=None):
    """Adds cloth: one layer, or two that are closed at the hems."""
    thick = pick(rng, 0, 0.004, 0.008) if thick is None else thick
    if thick and 2 * len(vertices) + mesh.count < MOST_VERTICES * 0.9:
        vertices, faces = thickened(vertices, faces, thick)
    mesh.add(vertices, *faces)


def skirt_tube(mesh, rng, bodies, vertices, waist, length, flare, gap=0.0, pad=0.02, thick=None):
    """A flared tube that hangs from the waist of a posed body, open at the front by an angle of gap."""
    x, y, _ = bodies.rest.T
    trunk = np.abs(x) < 0.2
    band, hips = trunk & (np.abs(y - waist) < 0.03), trunk & (np.abs(y + 0.1) < 0.04)
    top, down = vertices[band].mean(0), unit(vertices[hips].mean(0) - vertices[band].mean(0) + 1e-6)
    side = unit(vertices[hips & (x > 0)].mean(0) - vertices[hips & (x < 0)].mean(0))
    side = unit(side - down * np.dot(side, down))
    front = np.cross(down, side)
    reach = []
    for way in (side, front):
        along = (vertices[band] - top) @ way
        reach.append(np.ptp(along) / 2 + pad)
        top = top + way * (along.min() + along.max()) / 2
    rows, columns = max(5, int(length / 0.035)), 44
    folds, deep, phase = rng.integers(5, 13), rng.uniform(0.02, 0.2), rng.uniform(0, 6.28)
    t = np.linspace(0, 1, rows)[:, None]
    ends = np.linspace(gap / 2, 2 * np.pi - gap / 2, columns, endpoint=gap > 0)[None]
    swell = 1 + flare * t ** rng.uniform(0.6, 1.3) + deep * t * np.sin(folds * ends + phase)
    swell = swell + 0.35 * np.clip(t * length / 0.2, 0, 1) * (1 - np.clip(t * length / 0.2, 0, 1) / 2)
    p = top + down * (t[..., None] * length)
    p = p + side * (reach[0] * swell * np.sin(ends))[..., None] + front * (reach[1] * swell * np.cos(ends))[..., None]
    i, j = (g.ravel() for g in np.meshgrid(np.arange(rows - 1), np.arange(columns - (gap > 0)), indexing="ij"))
    k = (j + 1) % columns
    # Round from the front to the side, and then down: the outside is at the front of these quads.
    faces = np.stack([i * columns + j, (i + 1) * columns + j, (i + 1) * columns + k, i * columns + k], 1)
    put(mesh, rng, p.reshape(-1, 3), [faces], thick)


def top_region(bodies, sleeve, hem, neck, opening=0.0):
    x, y, z = bodies.rest.T
    keep = (np.abs(x) < sleeve) & (y > hem) & (y < neck + 0.25 * np.abs(x))
    return keep & ~((np.abs(x) < opening) & (z > 0)) if opening else keep


def shirt(mesh, rng, bodies):
    vertices = bodies.draw(rng, "natural", "natural", "rest")
    keep = top_region(bodies, rng.uniform(0.58, 0.67), rng.uniform(-0.14, 0.04), rng.uniform(0.46, 0.5))
    vertices, faces = cloth(rng, bodies, vertices, keep, 0.006, 0.04, rng.integers(4, 12))
    put(mesh, rng, vertices, [faces])


def t_shirt(mesh, rng, bodies):
    vertices = bodies.draw(rng, "natural", "natural", "rest")
    keep = top_region(bodies, rng.uniform(0.2, 0.42), rng.uniform(-0.14, 0.06), rng.uniform(0.45, 0.49))
    vertices, faces = cloth(rng, bodies, vertices, keep, 0.006, 0.05, rng.integers(4, 12))
    put(mesh, rng, vertices, [faces])


def trousers(mesh, rng, bodies, least=-0.87, most=-0.72):
    vertices = bodies.draw(rng, "natural", "natural", "rest")
    y = bodies.rest[:, 1]
    keep = (y < rng.uniform(0.0, 0.13)) & (y > rng.uniform(least, most))
    vertices, faces = cloth(rng, bodies, vertices, keep, 0.006, 0.045, rng.integers(4, 12))
    put(mesh, rng, vertices, [faces])


def shorts(mesh, rng, bodies):
    trousers(mesh, rng, bodies, -0.55, -0.3)


def skirt(mesh, rng, bodies):
    vertices = bodies.draw(rng, "natural", "rest")
    skirt_tube(mesh, rng, bodies, vertices, rng.uniform(0.05, 0.12), rng.uniform(0.35, 0.95), rng.uniform(0.2, 1.3))


def dress(mesh, rng, bodies):
    vertices = bodies.draw(rng, "natural", "natural", "rest")
    waist, thick = rng.uniform(0.05, 0.14), pick(rng, 0, 0.005)
    keep = top_region(bodies, pick(rng, rng.uniform(0.18, 0.35), 0.64), waist - 0.06, rng.uniform(0.42, 0.49))
    shell, faces = cloth(rng, bodies, vertices, keep, 0.006, 0.02, rng.integers(3, 8))
    put(mesh, rng, shell, [faces], thick)
    skirt_tube(mesh, rng, bodies, vertices, waist, rng.uniform(0.4, 1), rng.uniform(0.2, 1), pad=0.012, thick=thick)


def coat(mesh, rng, bodies):
    vertices = bodies.draw(rng, "natural", "natural", "rest")
    waist, thick, is_open = rng.uniform(0.05, 0.1), pick(rng, 0, 0.008), rng.random() < 0.6
    keep = top_region(bodies, rng.uniform(0.6, 0.68), waist - 0.07, rng.uniform(0.49, 0.52), 0.025 if is_open else 0)
    shell, faces = cloth(rng, bodies, vertices, keep, 0.02, 0.06, rng.integers(4, 10))
    put(mesh, rng, shell, [faces], thick)
    skirt_tube(mesh, rng, bodies, vertices, waist, rng.uniform(0.35, 0.9), rng.uniform(0, 0.4),
               rng.uniform(0.2, 0.6) if is_open else 0, 0.04, thick)


def pair(mesh, rng, bodies, keep, low, high, smoothing, upright):
    """Two of something, of the body at rest, side by side."""
    vertices, faces = cloth(rng, bodies, bodies.draw(rng, "rest"), keep, low, high, smoothing)
    gap, thick = rng.uniform(0.02, 0.12), pick(rng, 0, 0.003)
    right = vertices[:, 0] > 0
    for sign, chosen in ((1, right), (-1, ~right)):
        part, own = kept(vertices, faces, chosen)
        part = part - (part.min(0) + part.max(0)) / 2
        if upright:
            turn = np.array([[0, -sign, 0], [sign, 0, 0], [0, 0, 1.0]])  # The finger tips to the top.
            part = part @ turn.T
        part = part @ turn_y(rng.normal() * 0.25).T
        part = part - [part[:, 0].min() - gap / 2 if sign > 0 else part[:, 0].max() + gap / 2, 0, 0]
        while len(part) < LEAST_VERTICES / 2:
            part, own = refined(part, own)
        put(mesh, rng, part - [0, part[:, 1].min(), 0], [own], thick)


def gloves(mesh, rng, bodies):
    keep = np.abs(bodies.rest[:, 0]) > rng.uniform(0.55, 0.69)
    pair(mesh, rng, bodies, keep, 0.005, 0.009, 2, rng.random() < 0.7)


def boots(mesh, rng, bodies):
    keep = bodies.rest[:, 1] < rng.uniform(-0.8, -0.45)
    pair(mesh, rng, bodies, keep, 0.006, 0.02, rng.integers(4, 9), False)


def hat(mesh, rng, bodies):
    r, tall, thick = rng.uniform(0.09, 0.13), rng.uniform(0.1, 0.2), 0.006
    mesh.step = 0.03 / mesh.detail
    style, oval, sides = rng.integers(4), [1, 1, rng.uniform(1.05, 1.3)], mesh.scaled(28)
    turn = np.linspace(0, np.pi / 2, 7)
    if style == 0:  # A hat with a brim. The profiles start below the crown, inside.
        brim, dip, top = r + rng.uniform(0.05, 0.2), rng.uniform(-0.04, 0.05), r * rng.uniform(0.7, 1.05)
        lathe(mesh, [(0, tall - thick), (top - thick, tall - thick), (r - thick, -thick), (brim, dip - thick),
                     (brim, dip), (r, 0), (top, tall), (0, tall)], sides=sides, scale=oval)
    elif style == 1:  # A cap with a peak.
        dome, lining = ([(a * np.cos(t), b * np.sin(t)) for t in turn[:-1]] + [(0, b)]
                        for a, b in ((r, tall), (r - thick, tall - thick)))
        lathe(mesh, lining[::-1] + dome, sides=sides, scale=oval)
        box(mesh, [1.5 * r, 0.008, r * 1.6], [0, 0.004, r * oval[2] * 1.1], roundness=0.6)
    elif style == 2:  # A pointed hat.
        brim, tall = r + rng.uniform(0, 0.16), rng.uniform(0.2, 0.45)
        lathe(mesh, [(0, tall - 2 * thick), (r - thick, 0), (brim, -0.01), (brim, -0.004), (r, 0.012),
                     (r * 0.5, tall * 0.5), (0, tall)], sides=sides, scale=oval)
    else:  # A woollen one, from the top of a head.
        x, y, z = bodies.rest.T
        keep = (y > rng.uniform(0.67, 0.71) + 0.12 * np.clip(z, -0.1, 0.1)) & (np.abs(x) < 0.15)
        vertices, faces = cloth(rng, bodies, bodies.draw(rng, "rest"), keep, 0.01, 0.03, 15)
        while len(vertices) < LEAST_VERTICES:
            vertices, faces = refined(vertices, faces)
        put(mesh, rng, vertices, [faces])
        if rng.random() < 0.5:
            ellipsoid(mesh, [0.03] * 3, vertices[vertices[:, 1].argmax()] + UP * 0.02, rings=8, sides=12)


GARMENTS = [shirt, t_shirt, trousers, shorts, dress, skirt, coat, gloves, boots, hat]


# Files


def finished(mesh, rng):
    """The mesh turned about y, on the floor, within the lengths."""
    vertices = mesh.vertices() @ turn_y(rng.uniform(0, 2 * np.pi)).T
    length = np.ptp(vertices, axis=0).max()
    vertices = vertices * np.clip(length, LEAST_LENGTH * 1.02, MOST_LENGTH * 0.98) / length
    low, high = vertices.min(0), vertices.max(0)
    return vertices - [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]


def made(make, seed):
    """Makes a mesh, again with more or less detail until its number of vertices is right."""
    detail = 1.0
    for _ in range(14):
        rng, mesh = np.random.default_rng(seed), Mesh(detail)
        make(mesh, rng)
        if LEAST_VERTICES <= mesh.count <= MOST_VERTICES:
            return finished(mesh, np.random.default_rng(seed + [1])), mesh.faces
        detail *= 1.3 if mesh.count < LEAST_VERTICES else 0.87
    sys.exit("error: no detail gives %d to %d vertices, but %d" % (LEAST_VERTICES, MOST_VERTICES, mesh.count))


def write_obj(path, vertices, faces):
    with open(path, "w") as file:
        file.write("".join("v %.6f %.6f %.6f\n" % tuple(v) for v in vertices.tolist()))
        for f in faces:
            line = "f" + " %d" * f.shape[1] + "\n"
            file.write("".join(line % tuple(row) for row in (f + 1).tolist()))


def main():
    kinds = ["furniture", "implicit", "plants", "pieces", "garments"]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT_FOLDER", help="write the meshes to folders in this one")
    parser.add_argument("--npt", default="npt", help="the npt program, which makes the bodies (default: npt)")
    parser.add_argument("--count", type=int, default=80, help="make this many meshes of each kind (default: 80)")
    parser.add_argument("--seed", type=int, default=1, help="draw everything from this seed (default: 1)")
    parser.add_argument("--kinds", nargs="+", choices=kinds, default=kinds, help="make only these (default: all)")
    arguments = parser.parse_args()
    makers = {"furniture": FURNITURE, "implicit": IMPLICIT, "plants": PLANTS}
    if {"pieces", "garments"} & set(arguments.kinds):
        bodies = Bodies(arguments.npt)
        makers["pieces"] = [lambda mesh, rng, name=name: piece(mesh, rng, bodies, name) for name in REGIONS]
        makers["garments"] = [lambda mesh, rng, make=make: make(mesh, rng, bodies) for make in GARMENTS]
    for kind in arguments.kinds:
        folder, counts = os.path.join(arguments.out, kind), []
        os.makedirs(folder, exist_ok=True)
        for k in range(arguments.count):
            make = makers[kind][k % len(makers[kind])]
            vertices, faces = made(make, [arguments.seed, kinds.index(kind), k])
            write_obj(os.path.join(folder, "%03d.obj" % k), vertices, faces)
            counts.append(len(vertices))
        if counts:
            print("%s: %d meshes of %d to %d vertices" % (kind, len(counts), min(counts), max(counts)), flush=True)


if __name__ == "__main__":
    main()
