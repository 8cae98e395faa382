"""Between Blender's meshes and npt's: the object's matrix, the scene's unit and the vertical axis are taken out and put back."""

import numpy as np

from . import npt

# Blender's z is up and a figure in the front view looks along -y; npt's y is up and it looks along z.
TO_NPT = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def metres(scene):
    """Blender's world, in the scene's unit, to npt's, in metres: [4, 4]"""
    scale = scene.unit_settings.scale_length
    return np.diag([scale, scale, scale, 1.0]) @ TO_NPT


def moved(points, matrix):
    """[V, 3] by a [4, 4]"""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def local_points(vertices):
    points = np.empty(3 * len(vertices), np.float32)
    vertices.foreach_get("co", points)
    return points.reshape(-1, 3)


def triangles_of(mesh):
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return triangles.reshape(-1, 3)


def captured(context, thing):
    """A mesh object as it stands, modifiers and all, as npt takes it: a copy, which other threads may read."""
    if thing.mode == "EDIT":
        thing.update_from_editmode()
    evaluated = thing.evaluated_get(context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    try:
        points = local_points(mesh.vertices).astype(np.float64)
        matrix = metres(context.scene) @ np.array(evaluated.matrix_world)
        return npt.Mesh(moved(points, matrix).astype(np.float32), triangles_of(mesh), thing.name)
    finally:
        evaluated.to_mesh_clear()


def back(context, points, matrix_world):
    """Points of npt's in the space of an object: float32, flat."""
    matrix = np.linalg.inv(metres(context.scene) @ np.array(matrix_world))
    return np.ascontiguousarray(moved(points.astype(np.float64), matrix), np.float32).ravel()
