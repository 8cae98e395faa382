"""An armature's action onto the identity's own armature, or onto its mesh where it has none."""

import math

import bpy

from . import meshes, motions, npt, results
from .transfers import Mistake, expect, expect_mesh, frames_wanted, opened


def armature_of(thing):
    """The armature that moves an object, or is it; None: there is none."""
    return thing if thing.type == "ARMATURE" else thing.find_armature()


class MotionJob:
    """In steps, as operators.Job: capture() reads a frame, on Blender's own thread; compute() keeps it, and transfers
    after the last one, on any thread."""

    def __init__(self, context):
        own = context.scene.npt
        self.identity, self.armature, self.rig_wanted = own.identity, own.armature, own.rig
        if self.identity is None:
            raise Mistake("No identity: pick the armature, or the mesh object, that is to move")
        if self.armature is None:
            raise Mistake("No armature: pick the one whose action is to be taken")
        self.target = armature_of(self.identity)
        if self.target is None:
            expect_mesh(context, self.identity, "The identity")
            if own.refine:
                raise Mistake("Refine can't work on an action: turn it off")
            if own.weights == "FILE" and not own.weights_file:
                raise Mistake("No weights: pick a .safetensors file")
        else:
            expect(context, self.target, "The identity's armature", "ARMATURE", "an armature")
        expect(context, self.armature, "The armature", "ARMATURE", "an armature")
        if self.armature == self.target:
            raise Mistake(f"'{self.armature.name}' would take its own action: pick two armatures")
        for armature in (self.armature, self.target or self.armature):
            if not armature.data.bones:
                raise Mistake(f"Armature '{armature.name}' has no bones")
        self.action = own.action or (self.armature.animation_data and self.armature.animation_data.action)
        self.frames = self.frames_of(context)
        self.weights, self.options = own.weights_named(), own.options()
        self.motion_options = own.motion_options()
        rate = context.scene.render.fps / context.scene.render.fps_base
        self.times = [(frame - self.frames[0]) / rate for frame in self.frames]
        self.total, self.done, self.notes, self.captures = len(self.frames), 0, [], []
        self.shown = context.scene.frame_current, context.scene.frame_subframe
        self.who = self.skeleton = self.source = self.moved = self.rig = None
        self.begun = False
        self.before = None  # the source's action, where another one was asked for

    def frames_of(self, context):
        own = context.scene.npt
        if not own.use_action_range:
            return frames_wanted(context)
        if self.action is None:
            raise Mistake(f"'{self.armature.name}' has no action: pick one, or turn off the action's range")
        first, last = self.action.frame_range
        return list(range(math.ceil(first), math.floor(last) + 1, own.frame_step)) or [math.ceil(first)]

    def capture(self, context):
        """The identity, the first time; and the bones of the next frame."""
        if not self.begun:
            self.begin(context)
        context.scene.frame_set(self.frames[self.done])
        if self.done == 0:
            self.world = motions.world_of(self.armature.evaluated_get(context.evaluated_depsgraph_get()))
        capture = motions.captured(context, self.armature, self.bones)
        if self.done + 1 == self.total:
            # Of Blender's data here: compute() touches none.
            clip = self.action.name if self.action is not None else self.armature.name
            self.source = motions.motion_of(
                context, self.armature, self.bones, self.world, [*self.captures, capture], self.times, clip
            )
        return capture

    def begin(self, context):
        self.begun, self.bones = True, motions.bones_of(self.armature)
        if self.target is None:
            self.who = meshes.captured(context, self.identity)
        else:
            self.own_bones = motions.bones_of(self.target)
            self.skeleton = motions.rest_of(context, self.target, self.own_bones, motions.world_of(self.target))
        self.put_action()

    def put_action(self):
        animation = self.armature.animation_data
        if self.action is None or (animation is not None and animation.action == self.action):
            return
        self.before = (animation is not None, animation.action if animation is not None else None)
        self.armature.animation_data_create().action = self.action

    def restore(self, context):
        """The frame that was shown, and the action, before the first capture."""
        if self.before is not None:
            had, action = self.before
            self.before = None
            if had:
                self.armature.animation_data.action = action
            else:
                self.armature.animation_data_clear()
        if self.begun:
            context.scene.frame_set(self.shown[0], subframe=self.shown[1])

    def compute(self, capture):
        self.captures.append(capture)
        if self.done + 1 == self.total:
            self.transfer()
        self.done += 1

    def transfer(self):
        pose = {"time": 0} if self.total == 1 else {}
        if self.target is not None:
            result = npt.transfer_motion(self.skeleton, self.source, **self.motion_options, **pose)
            self.moved = motions.matrices_of(result.sample(self.times), result.parents)
        else:
            hero = opened(self.weights, self.options).character(self.who)
            self.notes += [str(warning) for warning in hero.warnings]
            result = npt.transfer_motion(hero, self.source, **self.motion_options, **pose)
            self.rig = hero.skeleton()
            self.moved = motions.joint_motions(result, self.rig, self.times)
        self.notes += [str(warning) for warning in result.warnings]

    def said(self):
        """As operators.Job: no mesh's body made it."""
        return ""

    def finish(self, context):
        """A new action on the identity's armature, or a new object. Returns the one that moves."""
        if context.object is not None and context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        name = self.action.name if self.action is not None else self.armature.name
        if self.target is None:
            return self.new_object(context, name)
        motions.give_action(self.target, self.own_bones, self.moved, self.frames, f"{name} on {self.target.name}")
        held = motions.held_bones(self.target, self.own_bones)
        if held:
            more = f" and {len(held) - 1} more" if len(held) > 1 else ""
            self.notes.append(f"Constraints hold the bone '{held[0]}'{more}: mute them to see the action")
        results.choose(context, self.target)
        return self.target

    def new_object(self, context, name):
        made, frames = [], self.frames if self.total > 1 else []
        try:
            made.append(results.new_object(context, self.identity, f"{self.identity.name} as {name}"))
            if self.rig_wanted:
                made.append(results.armature_of(context, self.identity, self.rig, made[0].name + " rig"))
                results.give_weights(made[0], made[1], self.rig)
                results.pose_armature(context, made[1], self.rig, self.moved, frames)
            else:
                points = [motions.skinned(self.who.vertices, self.rig, moved) for moved in self.moved]
                if frames:
                    results.give_shape_keys(context, made[0], points, frames, [f"frame {f}" for f in frames])
                else:
                    results.give_pose(context, made[0], points[0])
        except Exception:
            results.discard(made)
            raise
        results.choose(context, made[0])
        return made[0]
