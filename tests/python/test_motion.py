"""Motions in the Python package: of arrays, of files and of bytes. Needs no program: python test_motion.py [unittest's
arguments]. With ../shared/data beside the sources real files are taken, too."""

import json
import os
import tempfile
import unittest
from pathlib import Path

import numpy as np

import npt

FOLDER = Path()
SHARED = Path(os.environ.get("NPT_SHARED", Path(__file__).resolve().parents[2] / "../shared")) / "data"

# A person in a T pose, 1.7 m tall; parents before children, and not depth first.
SKELETON = [
    ("Hips", -1, (0, 0.95, 0)),
    ("Spine", 0, (0, 0.1, 0)),
    ("LeftUpLeg", 0, (0.1, -0.05, 0)),
    ("RightUpLeg", 0, (-0.1, -0.05, 0)),
    ("Spine1", 1, (0, 0.12, 0)),
    ("LeftLeg", 2, (0, -0.42, 0)),
    ("RightLeg", 3, (0, -0.42, 0)),
    ("Spine2", 4, (0, 0.12, 0)),
    ("LeftFoot", 5, (0, -0.4, 0)),
    ("RightFoot", 6, (0, -0.4, 0)),
    ("Neck", 7, (0, 0.18, 0)),
    ("LeftShoulder", 7, (0.06, 0.12, 0)),
    ("RightShoulder", 7, (-0.06, 0.12, 0)),
    ("LeftToeBase", 8, (0, -0.06, 0.12)),
    ("RightToeBase", 9, (0, -0.06, 0.12)),
    ("Head", 10, (0, 0.1, 0)),
    ("LeftArm", 11, (0.12, 0, 0)),
    ("RightArm", 12, (-0.12, 0, 0)),
    ("LeftForeArm", 16, (0.28, 0, 0)),
    ("RightForeArm", 17, (-0.28, 0, 0)),
    ("LeftHand", 18, (0.25, 0, 0)),
    ("RightHand", 19, (-0.25, 0, 0)),
]
NAMES = [name for name, _, _ in SKELETON]
PARENTS = [parent for _, parent, _ in SKELETON]
PLACES = np.array([place for _, _, place in SKELETON])
ARM, HAND = NAMES.index("LeftArm"), NAMES.index("LeftHand")
FRAMES = 16
PLAIN = {"foot_lock": False, "clearance": 0, "touch": False, "key_tolerance": 0}


def curves():
    """The left arm sinks by 90 degrees, and the body goes 0.5 m forward."""
    t = np.linspace(0, 1, FRAMES)
    translations = np.tile(PLACES, (FRAMES, 1, 1))
    translations[:, 0, 2] = 0.5 * t
    rotations = np.zeros((FRAMES, len(NAMES), 4))
    rotations[:, :, 3] = 1
    rotations[:, ARM, 2], rotations[:, ARM, 3] = np.sin(-np.pi / 4 * t), np.cos(-np.pi / 4 * t)
    return {"translations": translations, "rotations": rotations}


def figure(**named):
    return npt.make_motion(NAMES, PARENTS, PLACES, name="figure", **named)


def document():
    """The figure as a glTF document: nodes alone."""
    nodes = [{"name": name, "translation": list(place)} for name, _, place in SKELETON]
    for j, parent in enumerate(PARENTS):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(j)
    root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes}
    root["skins"] = [{"joints": list(range(len(nodes)))}]
    root["extras"] = {"kept": [1, 2.50, "three"]}
    return json.dumps(root).encode()


class Motions(unittest.TestCase):
    def fails(self, message, f, *arguments, **named):
        with self.assertRaises(npt.Error) as caught:
            f(*arguments, **named)
        self.assertIn(message, str(caught.exception))
        return caught.exception


class Arrays(Motions):
    def test_what_it_is(self):
        motion = figure(**curves(), clip="sink")
        self.assertEqual((motion.names, motion.parents.tolist(), len(motion)), (NAMES, PARENTS, len(NAMES)))
        self.assertEqual((motion.clip, motion.clips, motion.rate, motion.unit), ("sink", ["sink"], 30, 1))
        self.assertEqual((motion.up, motion.rest_pose, motion.root_joint), ("y", "T", "Hips"))
        self.assertAlmostEqual(motion.length, 0.5)
        self.assertGreater(motion.confidence, 0.8)
        self.assertTrue(np.allclose(motion.root_shift, [0, 0, 0.5]))
        self.assertTrue(np.array_equal(motion.base, np.eye(3, 4)))
        self.assertEqual(repr(motion), "npt.Motion(figure, 22 joints, clip 'sink', 0.5 s)")
        roles = motion.roles
        self.assertEqual(roles["leftHand"], (HAND, "LeftHand", 1.0))
        self.assertEqual(roles["hips"].name, "Hips")
        self.assertNotIn("leftIndexProximal", roles)

    def test_frames(self):
        given = curves()
        motion = figure(**given)
        self.assertEqual(len(motion.times), FRAMES)
        self.assertTrue(np.allclose(motion.times, np.arange(FRAMES) / 30))
        self.assertTrue(np.allclose(motion.translations, given["translations"], atol=1e-6))
        self.assertTrue(np.allclose(motion.rotations, given["rotations"], atol=1e-6))
        self.assertTrue(np.allclose(motion.positions[0, HAND], [0.71, 1.41, 0], atol=1e-5))
        self.assertTrue(np.allclose(motion.positions[-1, HAND], [0.18, 0.88, 0.5], atol=1e-5))
        self.assertTrue(np.allclose(motion.rest().positions[0, HAND], [0.71, 1.41, 0], atol=1e-5))
        self.assertEqual(motion.sample(0.25).positions.shape, (1, len(NAMES), 3))
        self.assertEqual(motion.sample(fps=8).times.tolist(), [0, 0.125, 0.25, 0.375, 0.5])
        self.assertTrue(np.array_equal(motion.sample([9]).positions[0], motion.positions[-1]))
        self.fails("times: found other values", motion.sample, [np.nan])
        self.fails("fps: found 0", motion.sample, fps=0)

    def test_onto_another(self):
        motion, hero = figure(**curves()), figure(base=2 * np.eye(3, 4))
        result = npt.transfer_motion(hero, motion, clip_name="mine", **PLAIN)
        self.assertEqual((result.clip, result.names, result.warnings), ("mine", NAMES, ()))
        self.assertGreater(result.confidence, 0.8)
        self.assertTrue(np.allclose(result.positions, 2 * motion.positions, atol=1e-4))
        still = npt.transfer_motion(hero, motion, time=0.5, **PLAIN)
        self.assertEqual((still.length, len(still.times)), (0, 1))
        self.assertTrue(np.allclose(still.positions[0], 2 * motion.positions[-1], atol=1e-4))
        seen = []
        npt.transfer_motion(hero, motion, progress=seen.append)
        self.assertEqual((seen[0], seen[-1]), (0, 1))
        with self.assertRaises(npt.Stopped):
            npt.transfer_motion(hero, motion, stop=lambda: True)

    def test_bone_maps(self):
        self.assertIn('leftHand "LeftHand" 1\n', figure().bone_map())
        self.assertNotIn("leftHand", figure(bone_map={"leftHand": None}).roles)
        hero = figure(bone_map="leftLowerArm -\n")
        warning = npt.transfer_motion(hero, figure(**curves())).warnings[0]
        self.assertEqual((warning.code, warning.skeleton), ("joints_missing", "character"))
        self.assertEqual(warning.roles, ("leftLowerArm",))
        self.assertIn("figure has no joint for leftLowerArm", str(warning))
        crossed = figure(bone_map={"leftHand": "RightHand", "rightHand": "LeftHand"})
        self.assertEqual(crossed.roles["leftHand"].joint, 21)
        file = FOLDER / "map.txt"
        file.write_text("leftHand -\n")
        self.assertNotIn("leftHand", figure(bone_map=file).roles)
        self.fails("no joint 'Tail'", figure, bone_map={"hips": "Tail"})

    def test_refused(self):
        given = curves()
        short = dict(given, translations=given["translations"][1:])
        self.fails("translations: found shape [15, 22, 3], expected [16, 22, 3]", figure, **short)
        self.fails("parents: found shape [2], expected [22]", npt.make_motion, NAMES, [-1, 0], PLACES)
        ring = [3, *PARENTS[1:]]
        self.fails("joint 'Hips': found parent 3, expected -1 or a joint", npt.make_motion, NAMES, ring, PLACES)
        given["translations"][2, 0, 1] = np.nan
        self.fails("figure: joint 'Hips'", figure, **given)
        motion = figure(**curves())
        self.fails("figure: found a skeleton without a clip", npt.transfer_motion, motion, figure())
        file = FOLDER / "a.glb"
        self.fails("a character that is no file of a rig", npt.transfer_motion(figure(), motion).save, file)
        self.fails("npt_transfer_motion didn't make", motion.save, file)
        onto = npt.transfer_motion
        self.fails("clearance: found 2, expected a number from 0 to 1", onto, motion, motion, clearance=2)
        self.fails("root_motion: found 'hips', expected one of keep", onto, motion, motion, root_motion="hips")
        self.fails("apply: found no time", npt.transfer_motion, motion, motion, apply=True)
        links = ["link"] * len(NAMES)
        chain = npt.make_motion(links, np.arange(len(NAMES)) - 1, PLACES, name="chain", **curves())
        self.assertLess(chain.confidence, 0.3)
        error = self.fails("chain: found a skeleton that is not recognised", npt.transfer_motion, motion, chain)
        self.assertEqual(error.code, "not_recognised")


class Files(Motions):
    def test_bvh(self):
        motion = figure(**curves())
        self.assertEqual(motion.save(FOLDER / "sink.bvh"), ())
        read = npt.read_motion(FOLDER / "sink.bvh")
        self.assertEqual((read.clip, read.rate, len(read.times)), ("sink", 30, FRAMES))
        self.assertAlmostEqual(read.unit, 0.01)
        order = [read.names.index(name) for name in NAMES]  # depth first, as the format wants it
        self.assertTrue(np.allclose(read.positions[:, order], motion.positions, atol=1e-5))
        self.assertEqual(npt.read_motion(motion.to_bytes("bvh")).names, read.names)
        self.assertEqual(npt.read_skeleton(FOLDER / "sink.bvh").clips, ["sink"])

    def test_gltf(self):
        """A clip in the character's own file, whose other text stays as it was."""
        file = FOLDER / "hero.gltf"
        file.write_bytes(document())
        motion = figure(**curves(), clip="sink")
        for character in (file, str(file), document(), npt.read_skeleton(file)):
            result = npt.transfer_motion(character, motion, **PLAIN)
            self.assertEqual(sorted(result.nodes.tolist()), list(range(len(NAMES))))
            root = json.loads(result.to_bytes())
            self.assertEqual([clip["name"] for clip in root["animations"]], ["sink"])
            before = json.loads(document())
            self.assertEqual((root["extras"], root["nodes"]), (before["extras"], before["nodes"]))
        result.save(FOLDER / "sunk.gltf")
        read = npt.read_motion(FOLDER / "sunk.gltf")
        self.assertTrue(np.allclose(read.positions, result.positions, atol=1e-5))
        notes = npt.save_motions([result, result], FOLDER / "two.gltf")
        self.assertIn("'sink_2'", notes[0])
        self.assertEqual(npt.read_skeleton(FOLDER / "two.gltf").clips, ["sink", "sink_2"])
        several = "found 2 clips, expected the name of one of them: 'sink', 'sink_2'"
        self.fails(several, npt.read_motion, FOLDER / "two.gltf")
        self.assertEqual(npt.transfer_motion(file, FOLDER / "two.gltf", clip="sink_2").clip, "sink_2")
        npt.transfer_motion(file, motion, time=0.5, apply=True, **PLAIN).save(FOLDER / "posed.gltf")
        posed = npt.read_skeleton(FOLDER / "posed.gltf")
        self.assertEqual(posed.clips, [])
        self.assertTrue(np.allclose(posed.rest().positions[0], read.positions[-1], atol=1e-4))

    def test_refused(self):
        self.fails("none.glb", npt.read_motion, FOLDER / "none.glb")
        self.fails("walk.mp4: found extension '.mp4'", npt.read_motion, "walk.mp4")
        self.fails("motion: found 7, expected a path or bytes", npt.read_motion, 7)
        self.fails("character: found bytes of no known format", npt.read_skeleton, b"junk")
        self.fails("the bytes of an FBX file, expected its path", npt.read_motion, b"Kaydara FBX Binary  ")
        if not npt.reads_fbx():
            self.fails("built with assimp", npt.read_motion, "walk.fbx")
        self.fails("motion: found no clip", npt.read_motion, document())

    def test_real_files(self):
        """A clip without a mesh on a character of another maker."""
        clip, character = SHARED / "clips/fair_dab.bvh", SHARED / "characters/humanoids/ai_witch.glb"
        if not (clip.is_file() and character.is_file()):
            self.skipTest("../shared/data isn't there")
        motion, hero = npt.read_motion(clip), npt.read_skeleton(character)
        self.assertEqual((motion.up, motion.rest_pose, len(motion.times)), ("z", "T", 339))
        result = npt.transfer_motion(hero, motion)
        result.save(FOLDER / "witch.glb")
        read = npt.read_motion(FOLDER / "witch.glb")
        self.assertEqual(read.clip, "fair_dab")
        self.assertLess(np.abs(read.sample(result.times).positions - result.positions).max(), 1e-6)
        before, after = character.read_bytes(), (FOLDER / "witch.glb").read_bytes()
        json_end = 20 + int.from_bytes(before[12:16], "little")
        self.assertIn(before[json_end + 8 :], after)  # the buffer's bytes
        if npt.reads_fbx():
            foreign = npt.transfer_motion(hero, SHARED / "clips/kenney_walk.fbx", clip="Walk")
            self.assertEqual(foreign.names, hero.names)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        unittest.main()
