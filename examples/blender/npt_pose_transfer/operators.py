"""The operators. In the window a transfer runs beside Blender, frame by frame, and can be cancelled; from scripts and in background
it runs straight through. Nothing of the scene changes before all is computed."""

import threading

import bpy

from . import meshes, npt, results
from .motion_job import MotionJob
from .transfers import Mistake, expect_mesh, frames_wanted, opened


class Job:
    """A transfer in steps: capture() reads the scene, on Blender's own thread; compute() may run on any."""

    def __init__(self, context):
        own = context.scene.npt
        self.identity, self.source, self.rig_wanted = own.identity, own.source, own.rig
        self.poses, self.frames, self.names = [], [], []
        if self.identity is None:
            raise Mistake("No identity: pick the mesh object that is to take the pose")
        expect_mesh(context, self.identity, "The identity")
        if own.source == "COLLECTION":
            if own.collection is None:
                raise Mistake("No collection: pick the one that holds the poses")
            self.poses = sorted(
                (o for o in own.collection.all_objects if o.type == "MESH" and o != self.identity), key=lambda o: o.name
            )
            if not self.poses:
                raise Mistake(f"Collection '{own.collection.name}' holds no mesh object to take a pose from")
            self.frames = [context.scene.frame_start + i for i in range(len(self.poses))]
            self.names = [o.name for o in self.poses]
        else:
            if own.pose is None:
                raise Mistake("No pose: pick the mesh object whose pose is to be taken")
            if own.pose == self.identity:
                raise Mistake(f"Identity and pose are both '{own.pose.name}': pick two objects")
            self.poses = [own.pose]
            if own.source == "FRAMES":
                self.frames = frames_wanted(context)
                self.names = [f"frame {f}" for f in self.frames]
        for pose in self.poses:
            expect_mesh(context, pose, "The pose")
        if own.rig and own.refine:
            raise Mistake("A rig can't do what Refine does: turn one of the two off")
        self.weights, self.options = own.weights_named(), own.options()
        if own.weights == "FILE" and not own.weights_file:
            raise Mistake("No weights: pick a .safetensors file")
        self.total = len(self.frames) or 1
        self.shown = context.scene.frame_current, context.scene.frame_subframe
        self.done, self.notes, self.points, self.motions, self.rig = 0, [], [], [], None
        self.who = self.tracker = self.character = None
        self.kind, self.confidence = "", 1.0  # what was recognised, and the lowest confidence so far
        self.others = []  # further frames, from which the sequence may start

    def capture(self, context):
        """The identity and a sequence's frames to start from, the first time; and the next pose."""
        if self.who is None:
            self.who = meshes.captured(context, self.identity)
            self.others = [self.pose_at(context, i) for i in npt.frames_to_try(len(self.frames))]
        return self.pose_at(context, self.done)

    def pose_at(self, context, i):
        if self.source == "FRAMES":
            context.scene.frame_set(self.frames[i])
            return meshes.captured(context, self.poses[0])
        return meshes.captured(context, self.poses[i])

    def restore(self, context):
        """The frame that was shown before the first capture."""
        if self.source == "FRAMES":
            context.scene.frame_set(self.shown[0], subframe=self.shown[1])

    def compute(self, mesh):
        transfer = opened(self.weights, self.options)
        if not self.frames:
            self.character, pose = transfer.prepare(self.who, mesh)
        else:
            if self.tracker is None:
                self.character, self.tracker = transfer.character(self.who), npt.PoseTracker(transfer)
                pose = self.tracker.start(mesh, self.others, len(self.character))
            else:
                pose = self.tracker.next(mesh, len(self.character))
        if self.rig_wanted:
            result = transfer.report(self.character, pose)
            self.expect_body(result)
            self.rig = self.rig or self.character.skeleton()
            self.motions.append(transfer.motions(self.character, pose))
        else:
            result = transfer.apply(self.character, pose)
            self.points.append(result.vertices)
        name = self.names[self.done] + ": " if self.source == "FRAMES" else ""
        self.notes += [name + str(warning) for warning in result.warnings]
        if result.kind:
            self.kind, self.confidence = result.kind, min(self.confidence, result.confidence)
        self.done += 1

    def said(self):
        """How the result was made; empty: by the network."""
        return self.kind and f"{self.kind.capitalize()} by body estimation, confidence {self.confidence:.0%}"

    @staticmethod
    def expect_body(result):
        if result.method != "body":
            why = next((w.text.split(":")[0] for w in result.warnings if w.code == "no_surface"), None)
            raise npt.Error("No rig: " + (why or "these weights and this method estimate no body"))

    def finish(self, context):
        """Makes the new object. Returns it."""
        if context.object is not None and context.object.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        of = self.poses[0].name if self.source != "COLLECTION" else context.scene.npt.collection.name
        made = []
        try:
            made.append(results.new_object(context, self.identity, f"{self.identity.name} as {of}"))
            if self.rig is not None:
                made.append(results.armature_of(context, self.identity, self.rig, made[0].name + " rig"))
                results.give_weights(made[0], made[1], self.rig)
                results.pose_armature(context, made[1], self.rig, self.motions, self.frames)
            elif self.frames:
                results.give_shape_keys(context, made[0], self.points, self.frames, self.names)
            else:
                results.give_pose(context, made[0], self.points[0])
        except Exception:
            results.discard(made)
            raise
        results.choose(context, made[0])
        return made[0]


class NPT_OT_transfer(bpy.types.Operator):
    bl_idname = "npt.transfer"
    bl_label = "Transfer Pose"
    bl_description = "Make a copy of the identity in the pose, or give its armature the action. Esc cancels"
    bl_options = {"REGISTER", "UNDO"}

    running = None  # the operator at work, in the window

    @classmethod
    def poll(cls, context):
        return cls.running is None and context.scene is not None

    def begin(self, context):
        try:
            self.job = (MotionJob if context.scene.npt.source == "ACTION" else Job)(context)
            return True
        except Mistake as mistake:
            self.report({"ERROR"}, str(mistake))
            return False

    def execute(self, context):
        if not self.begin(context):
            return {"CANCELLED"}
        try:
            while self.job.done < self.job.total:
                self.job.compute(self.job.capture(context))
        except (npt.Error, MemoryError) as error:
            self.report({"ERROR"}, str(error) or "Out of memory")
            return {"CANCELLED"}
        finally:
            self.job.restore(context)
        return self.end(context)

    def end(self, context):
        self.job.finish(context)
        if self.job.said():
            self.report({"INFO"}, self.job.said())
        self.say_notes()
        return {"FINISHED"}

    def say_notes(self):
        notes = list(dict.fromkeys(self.job.notes))
        for note in notes[:3]:
            self.report({"WARNING"}, note)
        if len(notes) > 3:
            self.report({"WARNING"}, f"and {len(notes) - 3} frames more")

    # In the window: Blender's thread captures a frame, another computes it, a timer looks whether it is done.
    def invoke(self, context, event):
        if not self.begin(context):
            return {"CANCELLED"}
        NPT_OT_transfer.running, self.cancelled, self.error, self.worker = self, False, None, None
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.05, window=context.window)
        manager.progress_begin(0, self.job.total)
        manager.modal_handler_add(self)
        self.show(context)
        return {"RUNNING_MODAL"}

    def work(self, pose):
        try:
            self.job.compute(pose)
        except BaseException as error:  # told on Blender's thread
            self.error = error

    def show(self, context):
        context.window_manager.progress_update(self.job.done)
        text = f"npt: {self.job.done} of {self.job.total}" if self.job.frames else "npt: at work"
        context.workspace.status_text_set(text + (", stops after this one" if self.cancelled else ". Esc cancels"))
        for area in context.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()

    def modal(self, context, event):
        if event.type == "ESC":
            self.cancelled = True
            self.show(context)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.worker is not None:
            if self.worker.is_alive():
                return {"PASS_THROUGH"}
            self.worker.join()
            self.worker = None
            self.show(context)
        try:
            if self.error is not None:
                raise self.error
            if self.cancelled:
                self.report({"INFO"}, "Cancelled: nothing was changed")
                return self.leave(context, {"CANCELLED"})
            if self.job.done == self.job.total:
                self.job.restore(context)
                return self.leave(context, self.end(context))
            self.worker = threading.Thread(target=self.work, args=(self.job.capture(context),), daemon=True)
            self.worker.start()
            return {"RUNNING_MODAL"}
        except (npt.Error, MemoryError) as error:
            self.report({"ERROR"}, str(error) or "Out of memory")
        except ReferenceError:
            self.report({"ERROR"}, "An object was removed while its pose was being transferred")
        except Exception:
            self.leave(context, {})
            raise
        return self.leave(context, {"CANCELLED"})

    def leave(self, context, result):
        NPT_OT_transfer.running = None
        self.job.restore(context)
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        return result


class NPT_OT_cancel(bpy.types.Operator):
    bl_idname = "npt.cancel"
    bl_label = "Cancel"
    bl_description = "Stop the transfer after the frame that is being computed; nothing is changed"

    @classmethod
    def poll(cls, context):
        return NPT_OT_transfer.running is not None

    def execute(self, context):
        NPT_OT_transfer.running.cancelled = True
        return {"FINISHED"}


classes = [NPT_OT_transfer, NPT_OT_cancel]
