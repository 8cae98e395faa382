"""Between Blender's armatures and npt's motions: bones are joints, and their matrices frame by frame are the curves. And
back: a new action."""

import bpy
import numpy as np
from mathutils import Matrix

from . import meshes, npt, results

LEAST_BONES = 10  # of a skeleton that deforms; below that, no bone of the armature is left out


def bones_of(armature):
    """The bones that deform and those above them, parents first: controls and helpers are no joints."""
    bones, open_bones = [], [bone for bone in armature.data.bones if bone.parent is None]
    while open_bones:
        bones.append(open_bones.pop())
        open_bones.extend(bones[-1].children)
    kept = set()
    for bone in (b for b in bones if b.use_deform):
        while bone is not None:
            kept.add(bone.name)
            bone = bone.parent
    return [bone for bone in bones if bone.name in kept] if len(kept) >= LEAST_BONES else bones


def parents_of(bones):
    numbers = {bone.name: j for j, bone in enumerate(bones)}
    return [numbers[bone.parent.name] if bone.parent is not None else -1 for bone in bones]


def in_parents(matrices, parents):
    """[J, 4, 4] of the armature's space, in their parents."""
    return np.array([m if p < 0 else np.linalg.inv(matrices[p]) @ m for m, p in zip(matrices, parents)])


def parts(matrices):
    """Translations [J, 3], rotations [J, 4] (x, y, z, w) and scales [J, 3] of [J, 4, 4]."""
    decomposed = [Matrix(m.tolist()).decompose() for m in matrices]
    turns = [(turn.x, turn.y, turn.z, turn.w) for _, turn, _ in decomposed]
    return np.array([tuple(d[0]) for d in decomposed]), np.array(turns), np.array([tuple(d[2]) for d in decomposed])


def world_of(thing):
    return np.array(thing.matrix_world)


def rest_of(context, armature, bones, world, **clip):
    """An armature as npt takes it: a skeleton, or with `clip` a motion. world: of the armature, [4, 4]"""
    parents = parents_of(bones)
    shifts, turns, scales = parts(in_parents([np.array(bone.matrix_local) for bone in bones], parents))
    return npt.make_motion(
        [bone.name for bone in bones],
        parents,
        shifts,
        turns,
        rest_scales=scales,
        base=(meshes.metres(context.scene) @ world)[:3],
        name=armature.name,
        **clip,
    )


def captured(context, armature, bones):
    """The bones as they stand, with all that moves them, in Blender's world: [J, 4, 4]"""
    evaluated = armature.evaluated_get(context.evaluated_depsgraph_get())
    world = world_of(evaluated)
    return np.array([world @ np.array(evaluated.pose.bones[bone.name].matrix) for bone in bones])


def motion_of(context, armature, bones, world, captures, times, clip):
    """captures: of each frame, as captured() has them; times: seconds. One frame is a pose: it stands for two."""
    if len(captures) == 1:
        captures, times = captures * 2, [0, 1]
    parents, inverse = parents_of(bones), np.linalg.inv(world)
    frames = [parts(in_parents(inverse @ capture, parents)) for capture in captures]
    translations, rotations = (np.array([frame[k] for frame in frames]) for k in (0, 1))
    return rest_of(
        context, armature, bones, world, times=times, translations=translations, rotations=rotations, clip=clip
    )


def matrices_of(frames, parents):
    """npt.MotionFrames: [F, J, 4, 4] of the roots' coordinates."""
    x, y, z, w = np.moveaxis(frames.rotations.astype(np.float64), -1, 0)
    count, joints = x.shape
    local = np.zeros((count, joints, 4, 4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    local[..., :3, :3] = np.moveaxis(np.array(rows), (0, 1), (-2, -1)) * frames.scales[..., None, :]
    local[..., :3, 3] = frames.translations
    local[..., 3, 3] = 1
    for j, parent in enumerate(parents):
        if parent >= 0:
            local[:, j] = local[:, parent] @ local[:, j]
    return local


def channels(bone, matrices, parent, parent_matrices):
    """What a bone's channels are for these matrices of the armature's space: locations, rotations, scales, [F] each.

    Blender knows how a bone inherits from its parent."""
    basis = []
    for f, matrix in enumerate(matrices):
        above = {}
        if parent is not None:
            above = {
                "parent_matrix": Matrix(parent_matrices[f].tolist()),
                "parent_matrix_local": parent.matrix_local,
            }
        own = Matrix(matrix.tolist())
        basis.append(bone.convert_local_to_pose(own, bone.matrix_local, invert=True, **above).decompose())
    return [b[0] for b in basis], [b[1] for b in basis], [b[2] for b in basis]


def turn_values(turns, mode):
    """Rotations as a bone's mode has them: the channel's name and [F, 3 or 4]."""
    values, last = [], None
    for turn in turns:
        if mode == "QUATERNION":
            turn = -turn if last is not None and last.dot(turn) < 0 else turn
            values.append(tuple(turn))
            last = turn
        elif mode == "AXIS_ANGLE":
            axis, angle = turn.to_axis_angle()
            values.append((angle, *axis))
        else:
            last = turn.to_euler(mode) if last is None else turn.to_euler(mode, last)
            values.append(tuple(last))
    names = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return names.get(mode, "rotation_euler"), np.array(values)


def add_channel(action, bone, path, frames, values):
    """values: [F, N]. What stays the same gets one key."""
    for i, column in enumerate(np.asarray(values, np.float32).T):
        still = np.abs(column - column[0]).max() < 1e-6
        times = list(zip(frames, column))[: 1 if still else None]
        name = bpy.utils.escape_identifier(bone.name)
        results.add_curve(action, f'pose.bones["{name}"].{path}', i, times, action_group=bone.name)


def give_action(armature, bones, moved, frames, name):
    """A new action on the armature, in each bone's own mode of rotation; the one before it stays in the file.
    moved: [F, J, 4, 4] of the armature's space"""
    action = bpy.data.actions.new(name)
    try:
        for j, (bone, p) in enumerate(zip(bones, parents_of(bones))):
            parent = bones[p] if p >= 0 else None
            shifts, turns, scales = channels(bone, moved[:, j], parent, moved[:, p] if p >= 0 else None)
            add_channel(action, bone, "location", frames, [tuple(shift) for shift in shifts])
            path, values = turn_values(turns, armature.pose.bones[bone.name].rotation_mode)
            add_channel(action, bone, path, frames, values)
            add_channel(action, bone, "scale", frames, [tuple(scale) for scale in scales])
    except Exception:
        bpy.data.actions.remove(action)
        raise
    animation = armature.animation_data_create()
    if animation.action is not None:
        animation.action.use_fake_user = True
    animation.action = action
    return action


def held_bones(armature, bones):
    """Those with constraints, which may take them elsewhere than keys say."""
    poses = [armature.pose.bones[bone.name] for bone in bones]
    return [p.name for p in poses if any(not c.mute and c.influence > 0 for c in p.constraints)]


def joint_motions(result, skeleton, times):
    """How the joints of a character's skeleton move from where the mesh stands: a list of [J, 3, 4], as those of
    PoseTransfer.motions."""
    moved = matrices_of(result.sample(times), result.parents)
    numbers = [result.names.index(name) for name in skeleton.names]
    back = np.tile(np.eye(4), (len(numbers), 1, 1))
    back[:, :3, 3] = -skeleton.places
    base = np.vstack([result.base, [0, 0, 0, 1]])
    return [(base @ frame[numbers] @ back)[:, :3] for frame in moved]


def skinned(points, skeleton, motions):
    """[V, 3] moved by the joints, [J, 3, 4], and the skin weights."""
    full = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    moves = np.tensordot(skeleton.weight_matrix().astype(np.float64), motions, 1)
    return np.einsum("vij,vj->vi", moves, full)
