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
from mathutils import Vector

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
        self.transferred()  # with a warning
        self.own.rig = True
        self.fails("No rig: Torus is not recognised as a person")

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
