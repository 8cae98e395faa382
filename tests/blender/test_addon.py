"""The Blender add-on in a real Blender against the program, run by tests/platforms/blender.sh:
blender --background --factory-startup --python test_addon.py -- ADDON_ZIP NPT_PROGRAM FOLDER [WHAT TO SHOW]"""

import json
import subprocess
import sys
import traceback
import unittest
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

ZIP, PROGRAM, FOLDER = sys.argv[sys.argv.index("--") + 1 :][:3]
FOLDER = Path(FOLDER)
FRAMES = 24
HEIGHT = 1.7


def run(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=FOLDER, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def read_obj(file):
    """Vertices in npt's axes."""
    lines = (FOLDER / file).read_text().splitlines()
    return np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)


def make_files():
    run("generate", "--out", "identity.obj", "--shape-seed", 3, "--pose", "rest")
    run("generate", "--out", "pose.obj", "--shape-seed", 8, "--pose", "natural", "--pose-seed", 9)
    run("generate", "--out", "ground_truth.obj", "--shape-seed", 3, "--pose", "natural", "--pose-seed", 9)
    run("generate", "--out", "upright.obj", "--shape-seed", 8, "--pose", "random", "--pose-seed", 2)
    (FOLDER / "list.txt").write_text("identity.obj pose.obj ground_truth.obj\n")
    (FOLDER / "walk").mkdir()
    for i in range(FRAMES):  # a swing of legs and arms: hips 1 and 2, knees 4 and 5, shoulders 16 and 17
        swing = 0.6 * np.sin(2 * np.pi * i / FRAMES)
        angles = np.zeros((24, 3))
        angles[1, 0], angles[2, 0], angles[4, 0], angles[5, 0] = swing, -swing, 0.5 - 0.4 * swing, 0.5 + 0.4 * swing
        angles[16], angles[17] = (0, 0.5 * swing, -1.1), (0, 0.5 * swing, 1.1)
        (FOLDER / "angles.txt").write_text("\n".join(" ".join(map(str, row)) for row in angles))
        run("generate", "--out", f"walk/{i:02}.obj", "--shape-seed", 8, "--pose", "angles.txt")


def fresh():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="npt_pose_transfer")


def load(file, name=None):
    bpy.ops.import_scene.obj(filepath=str(FOLDER / file), split_mode="OFF")
    thing = bpy.context.selected_objects[0]
    thing.name = name or Path(file).stem
    return thing


def shown(thing):
    """The vertices of an object as shown, in npt's axes and metres."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    points = np.array([evaluated.matrix_world @ v.co for v in mesh.vertices])
    evaluated.to_mesh_clear()
    points *= bpy.context.scene.unit_settings.scale_length
    return points @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


class Addon(unittest.TestCase):
    def setUp(self):
        fresh()
        self.own = bpy.context.scene.npt

    def pair(self, pose="pose.obj"):
        self.own.identity, self.own.pose = load("identity.obj"), load(pose)
        return self.own.identity, self.own.pose

    def close(self, found, expected, most=1e-5 * HEIGHT):
        self.assertEqual(found.shape, expected.shape)
        difference = np.abs(found - expected).max()
        print(f"  {self._testMethodName}: within {difference:.2g} m")
        self.assertLess(difference, most)

    def transferred(self):
        before = set(bpy.data.objects)
        self.assertEqual(bpy.ops.npt.transfer(), {"FINISHED"})
        made = bpy.context.view_layer.objects.active
        self.assertNotIn(made, before)
        self.assertEqual(bpy.context.selected_objects, [made])
        return made

    def fails(self, message):
        before = {
            kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "armatures", "actions", "shape_keys")
        }
        with self.assertRaises(RuntimeError) as caught:
            bpy.ops.npt.transfer()
        self.assertIn(message, str(caught.exception))
        self.assertEqual({kind: len(getattr(bpy.data, kind)) for kind in before}, before)


class Transfers(Addon):
    def test_figure_onto_another(self):
        identity, pose = self.pair()
        original = shown(identity)
        made = self.transferred()
        self.assertEqual(made.name, "identity as pose")
        run("transfer", "--identity", "identity.obj", "--pose", "pose.obj", "--out", "out.obj")
        self.close(shown(made), read_obj("out.obj"))
        self.assertTrue(np.array_equal(shown(identity), original))
        # The identity's vertices and faces, in its order.
        self.assertEqual(len(made.data.vertices), 6890)
        self.assertEqual(
            [tuple(p.vertices) for p in made.data.polygons], [tuple(p.vertices) for p in identity.data.polygons]
        )
        import npt_pose_transfer

        found = npt_pose_transfer.npt.pmd(shown(made), read_obj("ground_truth.obj"))
        expected = json.loads(run("evaluate", "--list", "list.txt", "--json"))["sets"][0]["pmd"]
        print(f"  PMD {found:.6e}, npt evaluate's {expected:.6e}")
        self.assertLess(abs(found - expected), 1e-7)

    def test_animals(self):
        """Without named weights four-legged animals are posed as by the program, and no animal poses a person."""
        import npt_pose_transfer

        body = ["generate", "--body", npt_pose_transfer.npt._transfer._weights_file("quadruped")]
        run(*body, "--shape", "zero", "--pose", "rest", "--out", "animal.obj")
        run(*body, "--shape-seed", 3, "--pose", "natural", "--pose-seed", 1, "--out", "animal_pose.obj")
        self.own.identity, self.own.pose = load("animal.obj"), load("animal_pose.obj")
        self.assertEqual(self.own.weights, "DEFAULT")
        made = self.transferred()
        run("transfer", "--identity", "animal.obj", "--pose", "animal_pose.obj", "--out", "out.obj")
        self.close(shown(made), read_obj("out.obj"))
        job = npt_pose_transfer.operators.Job(bpy.context)
        job.compute(job.capture(bpy.context))
        self.assertRegex(job.said(), "^Four-legged animal by body estimation, confidence [89][0-9]%|100%$")
        self.own.rig = True
        self.assertEqual(len(self.transferred().parent.data.bones), 35)
        self.own.rig, self.own.identity = False, load("identity.obj")
        self.fails("found a pose of the domain 'quadruped', expected one of 'human'")

    def test_network_and_options(self):
        self.pair("upright.obj")
        self.own.method, self.own.mirror, self.own.pairings, self.own.seed = "network", True, 2, 4
        made = self.transferred()
        run(
            "transfer",
            "--identity",
            "identity.obj",
            "--pose",
            "upright.obj",
            "--out",
            "out.obj",
            "--method",
            "network",
            "--mirror",
            "--pairings",
            2,
            "--seed",
            4,
        )
        self.close(shown(made), read_obj("out.obj"))

    def test_units_matrices_and_modifiers(self):
        """In centimetres, each object with a place, a turn and a scale of its own; the pose is what a modifier makes of it."""
        identity, pose = self.pair("upright.obj")
        self.own.method = "network"
        plain = shown(self.transferred())
        self.own.method = "automatic"
        by_body = shown(self.transferred())
        self.own.method = "network"
        scene = bpy.context.scene
        scene.unit_settings.scale_length = 0.01
        for thing in identity, pose:
            world = thing.matrix_world.copy()
            thing.rotation_euler = (0.3, 0.2, 1.0)
            thing.scale = (20, 20, 20)
            thing.location = (3, 2, 1)
            bpy.context.view_layer.update()
            change = thing.matrix_world.inverted()
            for v in thing.data.vertices:
                v.co = change @ (100 * (world @ v.co))
        bpy.context.view_layer.update()
        moved = self.transferred()
        self.close(shown(moved), plain)
        self.assertLess(np.abs(np.array(moved.matrix_world) - np.array(identity.matrix_world)).max(), 1e-5)
        # Other roundings make body estimation draw other points of the surface: millimetres.
        self.own.method = "automatic"
        self.close(shown(self.transferred()), by_body, 0.01)
        self.own.method = "network"
        # Some of the pose comes from a modifier.
        shift = pose.modifiers.new("shift", "DISPLACE")
        shift.direction, shift.strength, shift.mid_level = "X", 1, 0
        for v in pose.data.vertices:
            v.co.x -= 1
        self.close(shown(self.transferred()), plain)

    def test_sheared(self):
        """A turned object in one that is wider than high: no object alone can have such a matrix."""
        identity, pose = self.pair()
        plain = shown(self.transferred())
        holder = bpy.data.objects.new("holder", None)
        bpy.context.scene.collection.objects.link(holder)
        holder.scale = (2, 1, 0.5)
        bpy.context.view_layer.update()
        points = shown(identity)
        identity.parent = holder
        identity.rotation_euler = (0.5, 0.4, 0.3)
        bpy.context.view_layer.update()
        change = identity.matrix_world.inverted()
        for v, p in zip(identity.data.vertices, points):
            v.co = change @ Vector((p[0], -p[2], p[1]))
        bpy.context.view_layer.update()
        self.close(shown(self.transferred()), plain, 0.01)
        self.own.rig = True
        made = self.transferred()
        self.close(shown(made), plain, 0.01)
        made.parent.data.pose_position = "REST"
        self.close(shown(made), points)

    def test_modifiers_of_the_identity(self):
        identity, _ = self.pair()
        identity.modifiers.new("split", "SUBSURF").levels = 1
        made = self.transferred()
        self.assertEqual(len(made.data.vertices), len(shown(identity)))
        self.assertGreater(len(made.data.vertices), 4 * 6890 - 100)
        self.assertEqual(len(made.modifiers), 0)

    def test_what_the_identity_has_is_kept(self):
        identity, _ = self.pair()
        mesh = identity.data
        mesh.materials.clear()
        for name in "skin", "cloth":
            mesh.materials.append(bpy.data.materials.new(name))
        for i, polygon in enumerate(mesh.polygons):
            polygon.material_index, polygon.use_smooth = i % 2, True
        uv = mesh.uv_layers.new(name="map")
        uv.data.foreach_set("uv", np.random.default_rng(0).random(2 * len(mesh.loops), np.float32))
        mesh.color_attributes.new("tint", "BYTE_COLOR", "CORNER")
        group = identity.vertex_groups.new(name="left")
        group.add(list(range(100)), 0.5, "REPLACE")
        identity.vertex_groups.new(name="empty")
        made = self.transferred()
        self.assertEqual([m.name for m in made.data.materials], ["skin", "cloth"])
        self.assertEqual([p.material_index for p in made.data.polygons[:4]], [0, 1, 0, 1])
        self.assertTrue(all(p.use_smooth for p in made.data.polygons))
        found, expected = np.empty(2 * len(mesh.loops), np.float32), np.empty(2 * len(mesh.loops), np.float32)
        made.data.uv_layers["map"].data.foreach_get("uv", found)
        uv.data.foreach_get("uv", expected)
        self.assertTrue(np.array_equal(found, expected))
        self.assertIn("tint", made.data.color_attributes)
        self.assertEqual([g.name for g in made.vertex_groups], ["left", "empty"])
        self.assertEqual([(g.group, g.weight) for g in made.data.vertices[7].groups], [(0, 0.5)])

    def test_undo(self):
        self.pair()
        bpy.ops.ed.undo_push(message="before")
        made = self.transferred().name
        bpy.ops.ed.undo_push(message="transferred")
        self.assertIn(made, bpy.data.objects)
        bpy.ops.ed.undo()
        self.assertNotIn(made, bpy.data.objects)
        self.assertEqual(bpy.context.scene.npt.identity.name, "identity")
        bpy.ops.ed.redo()
        self.assertIn(made, bpy.data.objects)
        from npt_pose_transfer.operators import NPT_OT_transfer

        self.assertEqual(NPT_OT_transfer.bl_options, {"REGISTER", "UNDO"})


class Sequences(Addon):
    @classmethod
    def setUpClass(cls):
        run("transfer", "--identity", "identity.obj", "--pose", "walk", "--out", "walked")
        cls.expected = [read_obj(f"walked/{i:02}.obj") for i in range(FRAMES)]

    def walker(self):
        """One mesh whose shape keys play the walk from frame 1 on."""
        walker = load("walk/00.obj", "walker")
        walker.shape_key_add(name="Basis")
        for i in range(FRAMES):
            key = walker.shape_key_add(name=f"{i}")
            key.data.foreach_set("co", read_obj(f"walk/{i:02}.obj").astype(np.float32).ravel())
            for frame in range(1, FRAMES + 1):
                key.value = float(frame == i + 1)
                key.keyframe_insert("value", frame=frame)
        return walker

    def plays(self, thing, frames):
        scene = bpy.context.scene
        worst = 0
        for i, frame in enumerate(frames):
            scene.frame_set(frame)
            found = shown(thing)
            self.assertEqual(found.shape, self.expected[i].shape)
            worst = max(worst, np.abs(found - self.expected[i]).max())
        print(f"  {self._testMethodName}: {len(frames)} frames within {worst:.2g} m")
        self.assertLess(worst, 1e-5 * HEIGHT)

    def test_frames_as_shape_keys(self):
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, FRAMES
        self.own.identity, self.own.pose, self.own.source = load("identity.obj"), self.walker(), "FRAMES"
        scene.frame_set(5)
        made = self.transferred()
        self.assertEqual(scene.frame_current, 5)
        keys = made.data.shape_keys.key_blocks
        self.assertEqual(len(keys), FRAMES + 1)
        self.assertEqual(keys[1].name, "frame 1")
        self.assertEqual(len(made.data.vertices), 6890)
        self.plays(made, range(1, FRAMES + 1))
        scene.frame_set(2, subframe=0.5)  # between two frames: the mean
        self.close(shown(made), (self.expected[1] + self.expected[2]) / 2)

    def test_collection(self):
        poses = bpy.data.collections.new("poses")
        bpy.context.scene.collection.children.link(poses)
        for i in range(3):
            poses.objects.link(load(f"walk/{i:02}.obj", f"p{i}"))
        self.own.identity, self.own.source, self.own.collection = load("identity.obj"), "COLLECTION", poses
        made = self.transferred()
        self.assertEqual([k.name for k in made.data.shape_keys.key_blocks], ["Basis", "p0", "p1", "p2"])
        self.plays(made, range(1, 4))

    def test_rig(self):
        self.own.identity, self.own.pose, self.own.source = load("identity.obj"), self.walker(), "FRAMES"
        self.own.identity.vertex_groups.new(name="hips")
        self.own.use_scene_range, self.own.frame_start, self.own.frame_end, self.own.rig = False, 1, 4, True
        made = self.transferred()
        armature = made.parent
        self.assertEqual(
            (armature.type, len(armature.data.bones), made.modifiers[0].object), ("ARMATURE", 40, armature)
        )
        self.assertEqual(armature.data.bones["leftLowerLeg"].parent.name, "leftUpperLeg")
        self.plays(made, range(1, 5))
        self.own.pose.animation_data_clear()

    def test_rig_of_one_pose(self):
        self.pair()
        self.own.rig = True
        made = self.transferred()
        run("transfer", "--identity", "identity.obj", "--pose", "pose.obj", "--out", "out.obj")
        self.close(shown(made), read_obj("out.obj"), 3e-5)  # bones' matrices are float32
        made.parent.data.pose_position = "REST"
        self.close(shown(made), read_obj("identity.obj"))

    def test_cancelled(self):
        """What the window's operator does between two frames, and nothing is left."""
        from npt_pose_transfer.operators import Job

        self.own.identity, self.own.pose, self.own.source = load("identity.obj"), self.walker(), "FRAMES"
        before = {
            kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "armatures", "actions", "shape_keys")
        }
        bpy.context.scene.frame_set(7)
        job = Job(bpy.context)
        for _ in range(2):
            job.compute(job.capture(bpy.context))
        self.assertEqual((job.done, bpy.context.scene.frame_current), (2, 2))
        job.restore(bpy.context)
        self.assertEqual(bpy.context.scene.frame_current, 7)
        del job
        self.assertEqual({kind: len(getattr(bpy.data, kind)) for kind in before}, before)


# A figure's joints in metres, z up, for one side; the other is its mirror image. Each with its parent, its place and
# whether it deforms.
FIGURE = {
    "root": (None, (0, 0, 0), False),
    "hips": ("root", (0, 0, 1.0), True),
    "spine": ("hips", (0, 0.02, 1.12), True),
    "chest": ("spine", (0, 0.03, 1.3), True),
    "neck": ("chest", (0, 0.01, 1.5), True),
    "head": ("neck", (0, 0, 1.6), True),
    "shoulder": ("chest", (0.04, 0, 1.44), True),
    "arm": ("shoulder", (0.18, 0, 1.44), True),
    "forearm": ("arm", (0.45, 0, 1.44), True),
    "hand": ("forearm", (0.7, 0, 1.44), True),
    "thigh": ("hips", (0.1, 0, 0.95), True),
    "shin": ("thigh", (0.1, -0.01, 0.52), True),
    "foot": ("shin", (0.1, 0.02, 0.08), True),
    "toes": ("foot", (0.1, -0.12, 0.02), True),
    "control": ("root", (0.5, 0, 0.1), False),
}
SIDED = ("shoulder", "arm", "forearm", "hand", "thigh", "shin", "foot", "toes", "control")
MIXAMO = {
    "root": "Root",
    "hips": "mixamorig:Hips",
    "spine": "mixamorig:Spine",
    "chest": "mixamorig:Spine1",
    "neck": "mixamorig:Neck",
    "head": "mixamorig:Head",
    "shoulder": "mixamorig:{}Shoulder",
    "arm": "mixamorig:{}Arm",
    "forearm": "mixamorig:{}ForeArm",
    "hand": "mixamorig:{}Hand",
    "thigh": "mixamorig:{}UpLeg",
    "shin": "mixamorig:{}Leg",
    "foot": "mixamorig:{}Foot",
    "toes": "mixamorig:{}ToeBase",
    "control": "{}Control",
}
RIGIFY = {
    **{joint: f"DEF-{joint}.{{}}" if joint in SIDED else f"DEF-{joint}" for joint in FIGURE},
    "hips": "DEF-spine",
    "spine": "DEF-spine.001",
    "chest": "DEF-spine.002",
    "neck": "DEF-spine.004",
    "head": "DEF-spine.005",
    "arm": "DEF-upper_arm.{}",
    "toes": "DEF-toe.{}",
}
LIMBS = (("arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot"))


class Figure:
    """An armature of FIGURE's joints, which stretches by `size` and arms that hang by `lean` at rest."""

    def __init__(self, name, naming, size=(1, 1, 1), lean=0.0, roll=0.0):
        self.naming = naming
        self.object = bpy.data.objects.new(name, bpy.data.armatures.new(name))
        bpy.context.scene.collection.objects.link(self.object)
        bpy.context.view_layer.objects.active = self.object
        bpy.ops.object.mode_set(mode="EDIT")
        places = {}
        for side in (1, -1):
            for joint, (parent, place, deforms) in FIGURE.items():
                if self.bone(joint, side) in places:
                    continue
                at = Vector(place)
                if joint in ("forearm", "hand"):
                    at = Vector((0.18, 0, 1.44)) + Matrix.Rotation(lean, 3, "Y") @ (at - Vector((0.18, 0, 1.44)))
                at = Vector((side * at.x * size[0], at.y * size[1], at.z * size[2]))
                places[self.bone(joint, side)] = at
                bone = self.object.data.edit_bones.new(self.bone(joint, side))
                bone.head, bone.tail, bone.use_deform = at, at + Vector((0, 0, 0.05)), deforms
                if parent is not None:
                    bone.parent = self.object.data.edit_bones[self.bone(parent, side)]
                    if abs(bone.parent.head.z - at.z) + abs(bone.parent.head.x - at.x) > 0.05 and deforms:
                        bone.parent.tail = at
                bone.roll = roll
        bpy.ops.object.mode_set(mode="OBJECT")

    def bone(self, joint, side=1):
        sides = ("Left", "Right") if "mixamo" in self.naming["hips"] else ("L", "R")
        return self.naming[joint].format(sides[0 if side > 0 else 1])

    def heads(self):
        """The places of the joints in the world."""
        depsgraph = bpy.context.evaluated_depsgraph_get()
        own = self.object.evaluated_get(depsgraph)
        return {p.name: np.array(own.matrix_world @ p.head) for p in own.pose.bones}

    def directions(self):
        heads, found = self.heads(), []
        for side in (1, -1):
            for joint, following in LIMBS:
                way = heads[self.bone(following, side)] - heads[self.bone(joint, side)]
                found.append(way / np.linalg.norm(way))
        return np.array(found)

    def walks(self, frames, start=1):
        """Keys an action in which limbs swing and the hips go forward."""
        action = bpy.data.actions.new("Stroll")
        self.object.animation_data_create().action = action
        for i in range(frames):
            s = np.sin(2 * np.pi * i / (frames - 1))
            for side in (1, -1):
                for joint, swing in (("thigh", 0.5 * s), ("shin", 0.4 + 0.3 * s), ("arm", -0.4 * s), ("forearm", -0.3)):
                    bone = self.object.pose.bones[self.bone(joint, side)]
                    bone.rotation_mode = "XYZ"
                    bone.rotation_euler = (side * swing if joint != "shin" else swing, 0.1 * side, 0)
                    bone.keyframe_insert("rotation_euler", frame=start + i)
            hips = self.object.pose.bones[self.bone("hips")]
            hips.location = (0, 0, 0.04 * i)
            hips.keyframe_insert("location", frame=start + i)
        return action


class Actions(Addon):
    """An armature's action on another armature."""

    def figures(self):
        source = Figure("walker", MIXAMO)
        target = Figure("hero", RIGIFY, size=(0.9, 1, 0.7), lean=0.6, roll=0.5)
        source.walks(9, start=3)
        own = self.own
        own.identity, own.armature, own.source, own.foot_lock = target.object, source.object, "ACTION", False
        return source, target

    def moved(self, thing):
        before = set(bpy.data.actions), set(bpy.data.objects)
        self.assertEqual(bpy.ops.npt.transfer(), {"FINISHED"})
        self.assertEqual(bpy.context.view_layer.objects.active, thing)
        self.assertEqual(set(bpy.data.objects), before[1])
        (action,) = set(bpy.data.actions) - before[0]
        self.assertEqual(thing.animation_data.action, action)
        return action

    def follows(self, source, target, frames, most=1.0):
        """The target's limbs point where the source's do, and its bones keep their lengths."""
        scene, lengths = bpy.context.scene, []
        worst = 0
        for frame in frames:
            scene.frame_set(frame)
            cosines = (source.directions() * target.directions()).sum(axis=1)
            worst = max(worst, np.degrees(np.arccos(np.clip(cosines, -1, 1))).max())
            heads = target.heads()
            lengths.append(
                [
                    np.linalg.norm(heads[target.bone(a, side)] - heads[target.bone(b, side)])
                    for side in (1, -1)
                    for a, b in LIMBS
                ]
            )
        print(f"  {self._testMethodName}: limbs within {worst:.2g} degrees")
        self.assertLess(worst, most)
        self.assertLess((np.ptp(lengths, axis=0) / np.mean(lengths, axis=0)).max(), 1e-5)

    def test_onto_another_armature(self):
        source, target = self.figures()
        old = bpy.data.actions.new("Idle")
        target.object.animation_data_create().action = old
        bones, own = [b.name for b in target.object.data.bones], source.object.animation_data.action
        bpy.context.scene.frame_set(5)
        action = self.moved(target.object)
        self.assertEqual(action.name, "Stroll on hero")
        self.assertEqual(bpy.context.scene.frame_current, 5)
        self.assertEqual((source.object.animation_data.action, old.use_fake_user), (own, True))
        self.assertEqual([b.name for b in target.object.data.bones], bones)
        self.assertEqual(tuple(action.frame_range), (3, 11))
        self.assertNotIn(target.bone("control"), {curve.group.name for curve in action.fcurves})
        self.follows(source, target, range(3, 12))
        # The hips go as far as the legs are long, of the way.
        scene = bpy.context.scene
        ways = []
        for figure in source, target:
            ends = []
            for frame in 3, 11:
                scene.frame_set(frame)
                ends.append(figure.heads()[figure.bone("hips")])
            ways.append(np.linalg.norm((ends[1] - ends[0])[:2]))
        self.assertLess(abs(ways[1] / ways[0] - 0.7), 0.05)

    def test_modes_matrices_and_units(self):
        source, target = self.figures()
        scene = bpy.context.scene
        scene.unit_settings.scale_length = 0.01
        for figure, place in ((source, (20, 5, 0)), (target, (-70, 8, 3))):
            figure.object.scale = (100, 100, 100)
            figure.object.location = place
        target.object.pose.bones[target.bone("thigh")].rotation_mode = "XZY"
        target.object.pose.bones[target.bone("arm")].rotation_mode = "AXIS_ANGLE"
        target.object.data.bones[target.bone("forearm")].use_inherit_rotation = False
        bpy.context.view_layer.update()
        action = self.moved(target.object)
        paths = {curve.data_path.split(".")[-1] for curve in action.fcurves if curve.group.name == target.bone("arm")}
        self.assertEqual(paths, {"location", "rotation_axis_angle", "scale"})
        self.follows(source, target, range(3, 12))

    def test_what_moves_the_source(self):
        """Another action than its own, a constraint, and the object itself."""
        source, target = self.figures()
        stroll = source.object.animation_data.action
        other = bpy.data.actions.new("Other")
        source.object.animation_data.action = other
        self.own.action = stroll
        empty = bpy.data.objects.new("empty", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.rotation_euler = (0.4, 0, 0)
        constraint = source.object.pose.bones[source.bone("hand")].constraints.new("COPY_ROTATION")
        constraint.target, constraint.mix_mode, constraint.owner_space = empty, "ADD", "LOCAL"
        self.assertEqual(self.moved(target.object).name, "Stroll on hero")
        self.assertEqual(source.object.animation_data.action, other)
        source.object.animation_data.action = stroll
        self.follows(source, target, range(3, 12))

    def test_mesh_with_an_armature(self):
        source, target = self.figures()
        mesh = load("identity.obj")
        mesh.modifiers.new("Armature", "ARMATURE").object = target.object
        self.own.identity = mesh
        self.own.use_action_range, self.own.use_scene_range = False, False
        self.own.frame_start, self.own.frame_end, self.own.frame_step = 4, 8, 2
        action = self.moved(target.object)
        self.assertEqual(tuple(action.frame_range), (4, 8))
        self.follows(source, target, (4, 6, 8))

    def test_pose(self):
        source, target = self.figures()
        self.own.use_action_range, self.own.use_scene_range = False, False
        self.own.frame_start = self.own.frame_end = 5
        action = self.moved(target.object)
        self.assertTrue(all(len(curve.keyframe_points) == 1 for curve in action.fcurves))
        self.follows(source, target, (5,))

    def test_constraints_of_the_target(self):
        _, target = self.figures()
        target.object.pose.bones[target.bone("hand")].constraints.new("COPY_LOCATION")
        from npt_pose_transfer.motion_job import MotionJob

        job = MotionJob(bpy.context)
        while job.done < job.total:
            job.compute(job.capture(bpy.context))
        job.restore(bpy.context)
        job.finish(bpy.context)
        self.assertIn(f"Constraints hold the bone '{target.bone('hand')}': mute them to see the action", job.notes)

    def test_mesh_without_armature(self):
        """Shape keys, or an armature of npt's."""
        source, _ = self.figures()
        self.own.identity = load("identity.obj")
        self.own.use_action_range, self.own.use_scene_range = False, False
        self.own.frame_start, self.own.frame_end, self.own.frame_step = 3, 9, 3
        made = self.transferred()
        self.assertEqual([k.name for k in made.data.shape_keys.key_blocks], ["Basis", "frame 3", "frame 6", "frame 9"])
        played = []
        for frame in 3, 6, 9:
            bpy.context.scene.frame_set(frame)
            played.append(shown(made))
        self.own.rig = True
        rigged = self.transferred()
        self.assertEqual(len(rigged.parent.data.bones), 40)
        for frame, points in zip((3, 6, 9), played):
            bpy.context.scene.frame_set(frame)
            self.close(shown(rigged), points, 1e-4)

    def test_mistakes(self):
        source, target = self.figures()
        self.own.identity = None
        self.fails("No identity: pick the armature, or the mesh object, that is to move")
        self.own.identity = source.object
        self.fails("'walker' would take its own action: pick two armatures")
        self.own.identity, self.own.armature = target.object, None
        self.fails("No armature: pick the one whose action is to be taken")
        self.own.armature = source.object
        source.object.animation_data_clear()
        self.fails("'walker' has no action: pick one, or turn off the action's range")
        self.own.use_action_range, self.own.use_scene_range = False, False
        self.own.frame_start, self.own.frame_end = 5, 4
        self.fails("No frames: the first, 5, lies behind the last, 4")
        self.own.frame_end = 6
        few = bpy.data.objects.new("few", bpy.data.armatures.new("few"))
        bpy.context.scene.collection.objects.link(few)
        self.own.identity = few
        self.fails("Armature 'few' has no bones")
        leg = Figure("leg", {joint: f"a{i}.{{}}" for i, joint in enumerate(FIGURE)}, size=(0, 0.1, 0.01))
        self.own.identity = leg.object
        self.fails("leg: found a skeleton that is not recognised as a person's")
        self.own.source = "OBJECT"
        self.own.pose = load("pose.obj")
        self.fails("The identity 'leg' is an armature: pick a mesh object")


class Shown:
    """Stands in for a panel's layout: which settings are drawn."""

    def __init__(self):
        self.drawn = []

    def prop(self, settings, name, **_):
        getattr(settings, name)
        self.drawn.append(name)

    def row(self, **_):
        return self

    column = row

    def __getattr__(self, _):
        return lambda *_, **__: None


class Panels(Addon):
    def test_settings_of_each_source(self):
        from types import SimpleNamespace

        from npt_pose_transfer.panel import NPT_PT_options, NPT_PT_transfer

        sources = {"OBJECT": {"pose"}, "COLLECTION": {"collection"}, "FRAMES": {"pose", "use_scene_range", "frame_step"}}
        sources["ACTION"] = {"armature", "action", "use_action_range", "foot_lock", "in_place", "clearance"}
        for source, own in sources.items():
            self.own.source = source
            for panel in NPT_PT_transfer, NPT_PT_options:
                layout = Shown()
                panel.draw(SimpleNamespace(layout=layout), bpy.context)
                if panel == NPT_PT_transfer:
                    self.assertEqual(set(layout.drawn), own | {"identity", "source", "rig"})


class BadInput(Addon):
    def test_nothing_picked(self):
        self.fails("No identity: pick the mesh object that is to take the pose")
        self.own.identity = load("identity.obj")
        self.fails("No pose: pick the mesh object whose pose is to be taken")
        self.own.pose = self.own.identity
        self.fails("Identity and pose are both 'identity': pick two objects")
        self.own.source = "COLLECTION"
        self.fails("No collection: pick the one that holds the poses")
        self.own.collection = bpy.data.collections.new("poses")
        self.fails("Collection 'poses' holds no mesh object to take a pose from")

    def test_no_meshes(self):
        identity, pose = self.pair()
        light = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
        bpy.context.scene.collection.objects.link(light)
        self.own.pose = light
        self.fails("The pose 'lamp' is a light: pick a mesh object")
        self.own.identity, self.own.pose = light, pose
        self.fails("The identity 'lamp' is a light: pick a mesh object")
        empty = bpy.data.objects.new("nothing", bpy.data.meshes.new("nothing"))
        self.own.identity, self.own.pose = identity, empty
        self.fails("The pose 'nothing' isn't in this view layer")
        bpy.context.scene.collection.objects.link(empty)
        self.fails("nothing: found no vertices")

    def test_frames_and_options(self):
        self.pair()
        self.own.source, self.own.use_scene_range, self.own.frame_start, self.own.frame_end = "FRAMES", False, 5, 4
        self.fails("No frames: the first, 5, lies behind the last, 4")
        self.own.source, self.own.rig, self.own.refine = "OBJECT", True, True
        self.fails("A rig can't do what Refine does: turn one of the two off")
        self.own.refine, self.own.method = False, "network"
        self.fails("No rig: ")
        self.own.rig, self.own.weights = False, "FILE"
        self.fails("No weights: pick a .safetensors file")
        self.own.weights_file = str(FOLDER / "none.safetensors")
        self.fails("none.safetensors: found no such file")

    def test_no_person(self):
        self.pair()
        bpy.ops.mesh.primitive_torus_add()
        self.own.pose = bpy.context.object
        self.fails("Torus: found a mesh that is not recognised as a person")
        self.own.rig = True
        self.fails("Torus: found a mesh that is not recognised as a person")

    def test_edit_mode(self):
        identity, _ = self.pair()
        bpy.context.view_layer.objects.active = identity
        bpy.ops.object.mode_set(mode="EDIT")
        made = self.transferred()
        self.assertEqual(made.mode, "OBJECT")


try:
    make_files()
    bpy.ops.preferences.addon_install(filepath=ZIP, overwrite=True)
    print(f"Blender {bpy.app.version_string}, numpy {np.__version__}, Python {sys.version.split()[0]}")
    program = unittest.main(module=__name__, argv=["test_addon.py", *sys.argv[sys.argv.index("--") + 4 :]], exit=False)
    status = 0 if program.result.wasSuccessful() and program.result.testsRun else 1
except BaseException:
    traceback.print_exc()
    status = 1
sys.stdout.flush()
sys.stderr.flush()
import os  # noqa: E402

os._exit(status)  # Blender's own end would hide the status
