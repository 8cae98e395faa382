"""What comes out: a copy of the identity in the pose, with shape keys, or with an armature."""

import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import meshes


def new_object(context, identity, name):
    """A copy of the identity as it stands: its modifiers applied, with its vertex groups, UVs, colours and materials."""
    depsgraph = context.evaluated_depsgraph_get()
    evaluated = identity.evaluated_get(depsgraph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    mesh.name = name
    made = bpy.data.objects.new(name, mesh)
    made.matrix_world = evaluated.matrix_world
    for slot, own in zip(made.material_slots, identity.material_slots):
        if own.link == "OBJECT":
            slot.link, slot.material = "OBJECT", own.material
    kept = {group.name for group in made.vertex_groups}
    for group in identity.vertex_groups:
        if group.name not in kept:
            made.vertex_groups.new(name=group.name)
    link_beside(context, identity, made)
    # What an object's place, turn and scale can't say, such as a shear by its parents, goes into the mesh.
    context.view_layer.update()
    rest = made.matrix_world.inverted_safe() @ evaluated.matrix_world
    if max(abs(rest[r][c] - (r == c)) for r in range(4) for c in range(4)) > 1e-5:
        mesh.transform(rest)
    return made


def link_beside(context, identity, made):
    for collection in identity.users_collection or [context.scene.collection]:
        collection.objects.link(made)


def choose(context, made):
    for thing in context.view_layer.objects:
        thing.select_set(False)
    made.select_set(True)
    context.view_layer.objects.active = made


def give_pose(context, made, points):
    made.data.vertices.foreach_set("co", meshes.back(context, points, made.matrix_world))
    made.data.update()


def give_shape_keys(context, made, results, frames, names):
    """A shape key for each result, at its frame 1 and at its neighbours' 0: played, the figure goes from one to the next."""
    made.shape_key_add(name="Basis", from_mix=False)
    keys = made.data.shape_keys
    for points, name in zip(results, names):
        block = made.shape_key_add(name=name, from_mix=False)
        block.data.foreach_set("co", meshes.back(context, points, made.matrix_world))
    action = bpy.data.actions.new(made.name)
    keys.animation_data_create().action = action
    for i, frame in enumerate(frames):
        times = [(frame, 1.0)]
        if i > 0:
            times.insert(0, (frames[i - 1], 0.0))
        if i + 1 < len(frames):
            times.append((frames[i + 1], 0.0))
        add_curve(action, f'key_blocks["{bpy.utils.escape_identifier(keys.key_blocks[i + 1].name)}"].value', 0, times)
    made.data.update()


def add_curve(action, path, index, times, **group):
    curve = action.fcurves.new(path, index=index, **group)
    curve.keyframe_points.add(len(times))
    curve.keyframe_points.foreach_set("co", np.array(times, np.float32).ravel())
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def armature_of(context, identity, rig, name):
    """An armature in world space: bones from joint to joint."""
    to_world = np.linalg.inv(meshes.metres(context.scene))
    places = [Vector(p) for p in meshes.moved(rig.places, to_world)]
    size = max((p - places[0]).length for p in places)
    made = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    link_beside(context, identity, made)
    choose(context, made)
    bpy.ops.object.mode_set(mode="EDIT")
    bones = []
    for j, joint in enumerate(rig.names):
        bone = made.data.edit_bones.new(joint)
        parent = int(rig.parents[j])
        bone.head = places[j]
        children = [places[c] for c in range(len(places)) if rig.parents[c] == j]
        middle = sum(children, Vector()) / len(children) if children else places[j]
        if (middle - places[j]).length > 0.01 * size:
            bone.tail = middle
        elif parent >= 0 and (places[j] - places[parent]).length > 0.01 * size:
            bone.tail = places[j] + 0.5 * (places[j] - places[parent])
        else:
            bone.tail = places[j] + Vector((0, 0, 0.05 * size))
        if parent >= 0:
            bone.parent = bones[parent]
        bones.append(bone)
    bpy.ops.object.mode_set(mode="OBJECT")
    made.show_in_front = True
    return made


def give_weights(made, armature, rig):
    for name in rig.names:
        if made.vertex_groups.get(name):
            made.vertex_groups.remove(made.vertex_groups[name])
    vertex = np.repeat(np.arange(len(rig.start) - 1), np.diff(rig.start).astype(np.int64))
    for j, name in enumerate(rig.names):
        group = made.vertex_groups.new(name=name)
        for i in np.flatnonzero((rig.joints == j) & (rig.weights > 0)):
            group.add([int(vertex[i])], float(rig.weights[i]), "REPLACE")
    modifier = made.modifiers.new("Armature", "ARMATURE")
    modifier.object = armature
    made.parent = armature


def joint_poses(context, armature, rig, motions):
    """Each bone's rotation, and the root's location, from [J, 3, 4] of npt's."""
    to_npt = meshes.metres(context.scene)
    to_world = np.linalg.inv(to_npt)
    world = []
    for motion in motions:
        full = np.vstack([motion, [0, 0, 0, 1]])
        world.append(Matrix((to_world @ full @ to_npt).tolist()))
    poses = []
    for j, name in enumerate(rig.names):
        rest = armature.data.bones[name].matrix_local
        parent = int(rig.parents[j])
        basis = rest.inverted() @ (world[parent].inverted() if parent >= 0 else Matrix()) @ world[j] @ rest
        poses.append((basis.to_quaternion(), basis.to_translation()))
    return poses


def pose_armature(context, armature, rig, all_motions, frames):
    """One pose, or keys at the frames."""
    last = {}
    curves = {}
    for motions, frame in zip(all_motions, frames or [None]):
        for j, (turn, shift) in enumerate(joint_poses(context, armature, rig, motions)):
            name = rig.names[j]
            bone = armature.pose.bones[name]
            bone.rotation_mode = "QUATERNION"
            if name in last and last[name].dot(turn) < 0:
                turn.negate()
            last[name] = turn
            values = [("rotation_quaternion", i, x) for i, x in enumerate(turn)]
            if int(rig.parents[j]) < 0:
                values += [("location", i, x) for i, x in enumerate(shift)]
                bone.location = shift
            bone.rotation_quaternion = turn
            for path, i, x in values if frame is not None else ():
                key = f'pose.bones["{bpy.utils.escape_identifier(name)}"].{path}', i, name
                curves.setdefault(key, []).append((frame, x))
    if frames:
        action = bpy.data.actions.new(armature.name)
        armature.animation_data_create().action = action
        for (path, i, name), times in curves.items():
            add_curve(action, path, i, times, action_group=name)


def discard(made):
    """Takes away what was made before something failed."""
    for thing in made:
        data = thing.data
        bpy.data.objects.remove(thing)
        (bpy.data.meshes if isinstance(data, bpy.types.Mesh) else bpy.data.armatures).remove(data)
