"""The Python package against the program. Run with the package's Python: python test_npt.py NPT_PROGRAM [unittest's arguments]"""

import gc
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import tracemalloc
import unittest
import warnings
from pathlib import Path

import numpy as np

import npt
from npt import _meshes

PROGRAM = ""
FOLDER = Path()


def run(*arguments):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], check=True, cwd=FOLDER, capture_output=True, text=True
    ).stdout


def read_obj(file):
    """Vertices as the program read them, to the bit, and triangles."""
    vertices, faces = [], []
    for line in (FOLDER / file).read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([np.float32(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return np.array(vertices, np.float32), np.array(faces, np.int32)


def read_ply(file):
    """A PLY as npt writes it: float32 x y z, faces of three."""
    data = (FOLDER / file).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = {
        words[1]: int(words[2]) for words in map(str.split, data[:end].decode().splitlines()) if words[0] == "element"
    }
    vertices = np.frombuffer(data, "<f4", 3 * counts["vertex"], end).reshape(-1, 3)
    face = np.dtype([("count", "u1"), ("corners", "<u4", 3)])
    faces = np.frombuffer(data, face, counts["face"], end + vertices.nbytes)
    assert (faces["count"] == 3).all()
    return vertices, faces["corners"].astype(np.uint32)


def make_animals():
    """animal.obj: the template of the shipped weights at rest; animal_pose.obj: another shape in a natural pose."""
    body = ["generate", "--body", npt._transfer._weights_file("quadruped")]
    run(*body, "--shape", "zero", "--pose", "rest", "--out", "animal.obj")
    run(*body, "--shape-seed", 3, "--pose", "natural", "--pose-seed", 1, "--out", "animal_pose.obj")


class Figures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not (FOLDER / "identity.obj").exists():
            run("generate", "--out", "identity.obj", "--shape-seed", 3, "--pose", "rest")
            run("generate", "--out", "pose.obj", "--shape-seed", 8, "--pose", "natural", "--pose-seed", 9)
            run("generate", "--out", "paper.obj", "--shape-seed", 8, "--pose", "random", "--pose-seed", 2)
            t = np.linspace(0, 7, 400)
            knot = np.stack([t * np.cos(9 * t), t * np.sin(9 * t), np.cos(40 * t)], axis=1) * 0.2
            lines = ["v %.9g %.9g %.9g" % tuple(p) for p in knot]
            lines += [f"f {i + 1} {i + 2} {i + 40}" for i in range(len(knot) - 40)]
            (FOLDER / "knot.obj").write_text("\n".join(lines) + "\n")
        cls.identity, cls.pose, cls.paper, cls.knot = map(
            read_obj, ("identity.obj", "pose.obj", "paper.obj", "knot.obj")
        )

    def close(self, found, expected, height=1.7):
        """1e-5 of the mesh's height; says whether it is the same bits."""
        self.assertEqual(found.shape, expected.shape)
        difference = float(np.abs(found.astype(np.float64) - expected).max())
        print(
            f"  {self._testMethodName}: {'the same bits' if np.array_equal(found, expected) else f'within {difference:.2g} m'}"
        )
        self.assertLessEqual(difference, 1e-5 * height)

    def same(self, found, expected):
        """The same bits where the library is that of the program's build; else 1e-5 of the height."""
        self.close(found, expected)
        if os.environ.get("NPT_SAME_BUILD"):
            self.assertTrue(np.array_equal(found, expected))

    def fails(self, message, f, *arguments, **named):
        with self.assertRaises(npt.Error) as caught:
            f(*arguments, **named)
        self.assertIn(message, str(caught.exception))


class Program(Figures):
    """The results are the program's."""

    def transferred(self, *arguments, pose="pose.obj"):
        run("transfer", "--identity", "identity.obj", "--pose", pose, "--out", "out.obj", *arguments)
        return read_obj("out.obj")[0]

    def test_by_body_estimation(self):
        transfer = npt.PoseTransfer("human")
        result = transfer.apply(self.identity, self.pose)
        self.assertEqual((result.method, result.warnings), ("body", ()))
        self.assertEqual(result.confidence, min(result.character_confidence, result.pose_confidence))
        self.assertGreater(result.confidence, 0.85)
        self.assertIs(result.mesh.faces, self.identity[1])
        measures = transfer.measure(self.identity, self.pose, result)
        run("transfer", "--identity", "identity.obj", "--pose", "pose.obj", "--out", "o.obj", "--report", "r.jsonl")
        expected = json.loads((FOLDER / "r.jsonl").read_text())["measures"]
        self.assertEqual(measures.common_stretch, expected["common_stretch"])
        self.assertEqual(measures.stretched_vertex, expected["stretched_vertex"])
        self.assertEqual(measures.character_coverage, expected["identity_coverage"])
        self.assertGreater(measures.pose_coverage, 0.9)
        with self.assertRaisesRegex(npt.Error, "result: found 3 vertices"):
            transfer.measure(self.identity, self.pose, npt.Mesh(result.vertices[:3], None))
        self.same(result.vertices, self.transferred())
        self.same(transfer(self.identity, self.pose), result.vertices)

    def test_by_the_network(self):
        for name in npt.shipped_weights():
            weights = npt._transfer._weights_file(name)
            expected = self.transferred("--method", "network", "--weights", weights, pose="paper.obj")
            self.close(npt.PoseTransfer(name, method="network")(self.identity, self.paper), expected)

    def test_options(self):
        found = npt.PoseTransfer(method="network", pairings=2, mirror=True, seed=4)(self.identity, self.paper)
        expected = self.transferred("--method", "network", "--pairings", 2, "--mirror", "--seed", 4, pose="paper.obj")
        self.close(found, expected)
        found = npt.PoseTransfer(refine=True, refine_radius=0.1)(self.identity, self.pose)
        self.close(found, self.transferred("--refine", "--refine-radius", 0.1))
        in_feet = (self.identity[0] / np.float32(0.3048), self.identity[1])
        large = (self.identity[0] * np.float32(100), self.identity[1])
        warned = npt.PoseTransfer(method="network").apply(large, self.paper).warnings
        self.assertEqual([(w.code, w.mesh, w.value) for w in warned], [("unit_assumed", "identity", 0.01)])
        self.assertIn("; PoseTransfer(unit=...) sets the unit", str(warned[0]))
        result = npt.PoseTransfer(method="network", unit="foot").apply(
            in_feet, (self.paper[0] / np.float32(0.3048), self.paper[1])
        )
        self.assertEqual(result.warnings, ())
        self.close(result.vertices * 0.3048, self.transferred("--method", "network", pose="paper.obj"))

    def walk(self):
        """Twenty frames as files and as meshes: the pose, swaying."""
        (FOLDER / "walk").mkdir(exist_ok=True)
        poses = []
        for i in range(20):
            moved = self.pose[0] + np.float32(0.01 * np.sin(i)) * self.pose[0][:, 1:2] * np.float32([1, 0, 0])
            text = "".join("v %.9g %.9g %.9g\n" % tuple(v) for v in moved) + "".join(
                "f %d %d %d\n" % tuple(f + 1) for f in self.pose[1]
            )
            (FOLDER / "walk" / f"{i:02}.obj").write_text(text)
            poses.append((moved, self.pose[1]))
        return poses

    def test_sequence(self):
        poses = self.walk()
        run("transfer", "--identity", "identity.obj", "--pose", "walk", "--out", "walked")
        transfer = npt.PoseTransfer()
        results = list(transfer.sequence(self.identity, poses))
        self.assertEqual(len(results), 20)
        for i, found in enumerate(results):
            self.same(found.vertices, read_obj(f"walked/{i:02}.obj")[0])
        hero, tracker = transfer.character(self.identity), npt.PoseTracker(transfer)
        for i, pose in enumerate(poses[:3]):
            tracked = tracker.next(pose, len(hero))
            self.same(transfer.apply(hero, tracked).vertices, results[i].vertices)
        tracker.restart()
        self.fails("a frame that the tracker has left behind", transfer, hero, tracked)

    def test_clip(self):
        self.walk()
        run("transfer", "--identity", "pose.obj", "--pose", "walk", "--out", "walk.glb")
        files = [FOLDER / name for name in ("identity.obj", "walk.glb", "found.glb")]
        transfer, seen = npt.PoseTransfer(), []
        for options, named in (([], {}), (["--in-place", "--names", "smpl"], {"in_place": True, "names": "smpl"})):
            program = ["--identity", "identity.obj", "--pose", "walk.glb", "--clip", "walk", "--fps", 10, *options]
            run("transfer", *program, "--out", "expected.glb")
            result = npt.animate(transfer, *files, clip="walk", fps=10, progress=seen.append, **named)
            found, expected = ((FOLDER / name).read_bytes() for name in ("found.glb", "expected.glb"))
            self.assertEqual(found[:4], b"glTF")
            self.assertLess(abs(len(found) - len(expected)), 1000)  # numbers of other digits
            if os.environ.get("NPT_SAME_BUILD"):
                self.assertEqual(found, expected)
            self.assertEqual((result.method, result.vertices, result.warnings), ("body", None, ()))
        self.assertEqual((max(seen), sorted(seen[: len(seen) // 2])), (1, seen[: len(seen) // 2]))
        files[2].unlink()
        with self.assertRaises(npt.Stopped):
            npt.animate(transfer, *files, stop=lambda: True)
        with self.assertRaises(KeyError):  # what a callback raises comes out
            npt.animate(transfer, *files, progress=lambda done: {}[done])
        self.assertFalse(files[2].exists())
        self.fails("clip", npt.animate, transfer, *files, clip="run")
        self.fails("names: found 'maya', expected one of vrm, mixamo, smpl", npt.animate, transfer, *files, names="maya")

    def test_clip_without_a_mesh(self):
        """On a mesh without joints: on those of its estimated body."""
        parents = [-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 0, 17, 18]
        sides = "Shoulder", "Arm", "ForeArm", "Hand"
        names = ["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head"]
        names += [side + part for side in ("Left", "Right") for part in sides]
        names += [side + part for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot")]
        places = [(0, 0.95, 0), (0, 0.1, 0), (0, 0.12, 0), (0, 0.12, 0), (0, 0.18, 0), (0, 0.1, 0)]
        for x in 1, -1:
            places += [(0.06 * x, 0.12, 0), (0.12 * x, 0, 0), (0.28 * x, 0, 0), (0.25 * x, 0, 0)]
        for x in 1, -1:
            places += [(0.1 * x, -0.05, 0), (0, -0.42, 0), (0, -0.4, 0)]
        turns = np.zeros((31, 20, 4), np.float32)
        turns[:, :, 3] = 1
        arm = names.index("LeftArm")
        half = np.linspace(0, -np.pi / 4, 31)
        turns[:, arm, 2], turns[:, arm, 3] = np.sin(half), np.cos(half)
        clip = npt.make_motion(names, parents, places, rotations=turns, name="sink")
        clip.save(FOLDER / "sink.bvh")
        transfer = npt.PoseTransfer()
        hero = transfer.character(npt.Mesh(*self.identity, "identity.obj"))
        result = npt.transfer_motion(hero, clip)
        self.assertEqual((len(result.names), result.names, result.root_joint), (40, hero.skeleton().names, None))
        self.assertEqual(result.parents.tolist(), hero.skeleton().parents.tolist())
        arm, hand = (result.roles[role].joint for role in ("leftUpperArm", "leftHand"))
        direction = result.positions[[0, -1], hand] - result.positions[[0, -1], arm]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        self.assertGreater(direction[0, 0], 0.95)  # level, and at the end down
        self.assertLess(direction[1, 1], -0.9)
        result.save(FOLDER / "sunk.glb")
        read = npt.read_motion(FOLDER / "sunk.glb")
        self.assertLess(np.abs(read.sample(result.times).positions[:, [0]] - result.positions[:, [0]]).max(), 1e-5)
        made = npt.animate(transfer, FOLDER / "identity.obj", FOLDER / "sink.bvh", FOLDER / "sunk2.glb")
        self.assertEqual((made.method, made.warnings), ("body", ()))
        again = npt.read_motion(FOLDER / "sunk2.glb")
        self.assertEqual((again.clip, len(again)), ("sink", len(read)))
        self.assertLess(np.abs(again.positions[-1] - read.positions[-1]).max(), 1e-3)

    def test_protocol(self):
        """PMD on the paper's protocol as `npt evaluate`'s: some pairs of both sets; all with NPT_ALL_PAIRS."""
        first = () if os.environ.get("NPT_ALL_PAIRS") else ("--first", 3)
        for method in "automatic", "network":
            report = json.loads(
                run(
                    "evaluate",
                    "--protocol",
                    *first,
                    "--method",
                    method.replace("automatic", "auto"),
                    "--json",
                    "--write",
                    "protocol",
                )
            )
            transfer = npt.PoseTransfer("human", method=method)
            with open(FOLDER / "protocol" / "list.txt") as file:
                sets = [part.splitlines()[1:] for part in file.read().split("# ")[1:]]
            for lines, expected in zip(sets, report["sets"]):
                errors = []
                for line in lines:
                    identity, pose, ground_truth = map(read_ply, (f"protocol/{name}" for name in line.split()))
                    errors.append(npt.pmd(transfer(identity, pose), ground_truth[0]))
                found = float(np.mean(errors))
                print(
                    f"  {method}, {expected['name']}, {len(errors)} pairs: PMD {found:.6e}, npt evaluate's {expected['pmd']:.6e}"
                )
                self.assertAlmostEqual(found / expected["pmd"], 1, delta=1e-3)
                self.assertLess(abs(found - expected["pmd"]), 1e-7)


class Prepared(Figures):
    def test_the_same_bits(self):
        for method in "automatic", "network":
            transfer = npt.PoseTransfer(method=method)
            expected = transfer(self.identity, self.paper)
            identity = transfer.character(self.identity)
            pose = transfer.pose(self.paper, len(identity))
            for pair in (
                (identity, pose),
                (identity, self.paper),
                (self.identity, pose),
                (identity, transfer.pose(self.paper)),
                transfer.prepare(self.identity, self.paper),
            ):
                self.assertTrue(np.array_equal(transfer(*pair), expected))
            out = np.empty_like(expected)
            self.assertIs(transfer(identity, pose, out=out), out)
            self.assertTrue(np.array_equal(out, expected))
            own = self.identity[0].copy()
            transfer((own, self.identity[1]), self.paper, out=own)
            self.assertTrue(np.array_equal(own, expected))

    def test_what_is_prepared_keeps_the_weights(self):
        transfer = npt.PoseTransfer(method="network")
        hero = transfer.character(self.identity)
        tracker, pose = npt.PoseTracker(transfer), transfer.pose(self.paper, len(hero))
        expected = transfer(hero, pose)
        with transfer:
            self.assertIn("bottleneck 256", repr(transfer))
        self.assertEqual(repr(transfer), "npt.PoseTransfer(closed)")
        self.fails("found one that was closed", transfer, self.identity, self.paper)
        del transfer
        gc.collect()
        self.assertEqual(len(hero), len(expected))
        self.assertFalse(tracker.next(self.paper, len(hero)).recognised)
        other = npt.PoseTransfer(method="network")
        self.fails("another transfer prepared", other, hero, self.paper)
        self.fails("another transfer prepared", other, self.identity, pose)

    def test_what_was_estimated(self):
        transfer = npt.PoseTransfer()
        hero, pose = transfer.prepare(self.identity, self.pose)
        for one in hero, pose:
            self.assertTrue(one.recognised)
            self.assertGreater(one.confidence, 0.85)
            self.assertEqual((one.domain, one.warnings), ("human", ()))
            joints = one.joints()
            self.assertEqual((joints.axis_angles.shape, joints.root.shape), ((24, 3), (3,)))
            self.assertTrue(0.5 < joints.leg < 1.2)
        self.assertTrue(np.array_equal(hero.vertices, self.identity[0]))
        by_network = npt.PoseTransfer(method="network").character(self.identity)
        self.assertEqual((by_network.recognised, by_network.confidence, by_network.joints()), (False, None, None))
        self.fails("a character that isn't recognised", by_network.save, FOLDER / "none.npt")

    def test_saved_character(self):
        transfer = npt.PoseTransfer()
        hero, pose = transfer.prepare(self.identity, self.pose)
        hero.save(FOLDER / "hero.npt")
        again = npt.PoseTransfer().load_character(FOLDER / "hero.npt")
        self.fails("another transfer prepared", transfer, again, pose)
        again = transfer.load_character(FOLDER / "hero.npt")
        self.assertTrue(np.array_equal(transfer(again, pose), transfer(hero, pose)))
        self.assertTrue(np.array_equal(again.faces, self.identity[1]))
        self.fails("identity.obj", transfer.load_character, FOLDER / "identity.obj")

    def test_skeleton(self):
        """Vertices that move by the skeleton's motions and weights are the result."""
        transfer = npt.PoseTransfer()
        hero, pose = transfer.prepare(self.identity, self.pose)
        skeleton = hero.skeleton()
        self.assertEqual((skeleton.names[0], len(skeleton.names), int(skeleton.parents[0])), ("hips", 40, -1))
        weights = skeleton.weight_matrix()
        self.assertTrue(np.allclose(weights.sum(axis=1), 1, atol=1e-5))
        motions = transfer.motions(hero, pose)
        points = np.c_[self.identity[0].astype(np.float64), np.ones(len(self.identity[0]))]
        moved = np.einsum("vj,jrc,vc->vr", weights.astype(np.float64), motions, points)
        self.assertLess(np.abs(moved - transfer(hero, pose)).max(), 1e-5)
        self.assertIsNone(npt.PoseTransfer(refine=True).character(self.identity).skeleton())
        knot = transfer.character(npt.Mesh(*self.knot, name="knot.obj"))
        self.assertIsNone(knot.skeleton())
        self.fails("knot.obj: found a mesh that is not recognised", transfer.motions, knot, pose)

    def test_animals(self):
        """Without named weights four-legged animals are posed as by the program."""
        make_animals()
        animal, pose = read_obj("animal.obj"), read_obj("animal_pose.obj")
        transfer = npt.PoseTransfer()
        result = transfer.apply(animal, pose)
        run("transfer", "--identity", "animal.obj", "--pose", "animal_pose.obj", "--out", "o.obj", "--report", "a.jsonl")
        expected = json.loads((FOLDER / "a.jsonl").read_text())
        self.assertTrue(np.array_equal(result.vertices, read_obj("o.obj")[0]))
        self.assertEqual((result.method, result.kind), ("body", "four-legged animal"))
        self.assertEqual((expected["method"], expected["kind"]), (result.method, result.kind))
        self.assertEqual(expected["confidence"], result.confidence)
        self.assertGreater(result.confidence, 0.85)
        hero, taken = transfer.prepare(animal, pose)
        self.assertEqual((hero.kind, hero.domain, taken.kind), ("four-legged animal", "quadruped", "four-legged animal"))
        self.assertEqual(taken.joints().axis_angles.shape, (35, 3))
        skeleton, motions = hero.skeleton(), transfer.motions(hero, taken)
        self.assertEqual((skeleton.names[0], len(skeleton.names), motions.shape), ("pelvis", 35, (35, 3, 4)))
        points = np.c_[animal[0].astype(np.float64), np.ones(len(animal[0]))]
        moved = np.einsum("vj,jrc,vc->vr", skeleton.weight_matrix().astype(np.float64), motions, points)
        self.assertLess(np.abs(moved - result.vertices).max(), 1e-5)
        for identity, other in ((self.identity, pose), (animal, self.pose)):
            with self.assertRaises(npt.Error) as refused:
                transfer(identity, other)
            self.assertEqual(refused.exception.code, "domains_differ")
        people = transfer.apply(self.identity, self.pose)
        self.assertEqual(people.kind, "person")
        self.assertTrue(np.array_equal(people.vertices, npt.PoseTransfer("human")(self.identity, self.pose)))
        self.assertEqual(npt.PoseTransfer(method="network").apply(self.identity, self.paper).kind, "")
        with self.assertRaises(npt.Error) as refused:
            npt.PoseTransfer("human")(animal, pose)
        self.assertEqual(refused.exception.code, "not_recognised")

    def test_progress_and_stop(self):
        transfer, seen = npt.PoseTransfer(), []
        transfer.character(self.identity, progress=seen.append)
        self.assertGreater(len(seen), 3)
        self.assertEqual(sorted(seen), seen)
        with self.assertRaises(npt.Stopped) as caught:
            transfer.pose(self.pose, stop=lambda: True)
        self.assertEqual(caught.exception.code, "stopped")


class Memory(Figures):
    def test_no_copy_of_what_fits(self):
        xyz, faces = self.identity
        self.assertTrue(xyz.flags.c_contiguous and xyz.dtype == np.float32 and faces.dtype == np.int32)
        mesh = _meshes.Borrowed((xyz, faces), "identity")
        self.assertEqual(mesh.c.xyz, xyz.ctypes.data)
        self.assertEqual(mesh.c.triangles, faces.ctypes.data)
        self.assertIs(mesh.xyz, xyz)
        unsigned = faces.astype(np.uint32)
        self.assertEqual(_meshes.Borrowed((xyz, unsigned), "identity").c.triangles, unsigned.ctypes.data)
        frozen = xyz.copy()
        frozen.flags.writeable = False
        self.assertEqual(_meshes.Borrowed(frozen, "identity").c.xyz, frozen.ctypes.data)

    def test_a_call_allocates_no_array(self):
        transfer = npt.PoseTransfer(method="network")
        out = np.empty_like(self.identity[0])
        transfer(self.identity, self.paper, out=out)
        tracemalloc.start()  # numpy reports its memory to it
        try:
            transfer(self.identity, self.paper, out=out)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.reset_peak()
            transfer((self.identity[0].astype(np.float64), self.identity[1]), self.paper, out=out)
            converted = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        print(f"  {out.nbytes} bytes of result: {peak} bytes were allocated in a call, {converted} from float64")
        self.assertLess(peak, out.nbytes / 2)  # numpy's minimum takes 32 KB, whatever the size
        self.assertGreater(converted, out.nbytes)

    def test_what_does_not_fit_is_converted(self):
        transfer = npt.PoseTransfer(method="network")
        expected = transfer(self.identity, self.paper)
        xyz, faces = self.identity
        wide = np.zeros((len(xyz), 6), np.float32)
        wide[:, ::2] = xyz
        for same in (
            (xyz.astype(np.float64), faces),
            (np.asfortranarray(xyz), faces),
            (wide[:, ::2], faces),
            (xyz.tolist(), faces.tolist()),
            (xyz.astype(">f4"), faces.astype(np.int64)),
            npt.Mesh(xyz, faces[:, ::1].astype(np.int16)),
        ):
            self.assertTrue(np.array_equal(transfer(same, self.paper), expected))
        self.assertTrue(np.array_equal(self.identity[0], xyz))

    def test_quads(self):
        quads = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])
        self.assertEqual(_meshes.triangles(quads, "x").tolist(), [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])

    def test_trimesh(self):
        class Duck:
            vertices, faces = self.identity[0].astype(np.float64), self.identity[1].astype(np.int64)

        transfer = npt.PoseTransfer(method="network")
        expected = transfer(self.identity, self.paper)
        self.assertTrue(np.array_equal(transfer(Duck(), self.paper), expected))
        try:
            import trimesh
        except ImportError:
            print("  trimesh isn't there: an object with its attributes was taken")
            return
        self.assertTrue(np.array_equal(transfer(trimesh.Trimesh(*self.identity, process=False), self.paper), expected))


class Threads(Figures):
    def test_two_at_the_same_time(self):
        """Both threads use the processor while the main thread runs Python: no call holds Python's lock, and none waits for the
        other. A call's own CPU time says that it computes."""
        transfer = npt.PoseTransfer(method="network", threads=1, pairings=8)
        expected = transfer(self.identity, self.paper)
        inside, results, barrier = [0, 0], [None, None], threading.Barrier(3)

        def work(i):
            barrier.wait()
            inside[i] = 1
            results[i] = transfer(self.identity, self.paper)
            inside[i] = 2

        threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        clocks = [time.pthread_getcpuclockid(thread.ident) for thread in threads]
        start = [time.clock_gettime(clock) for clock in clocks]
        barrier.wait()
        looks, most = 0, 0.0
        while 2 not in inside:
            if inside == [1, 1]:
                used = [time.clock_gettime(clock) - s for clock, s in zip(clocks, start)]
                if inside == [1, 1]:  # both still computing after it was seen
                    looks, most = looks + 1, max(most, min(used))
            time.sleep(0.002)
        for thread in threads:
            thread.join()
        print(f"  both had computed for {1000 * most:.0f} ms while neither was done; looked {looks} times")
        self.assertGreater(looks, 5)
        self.assertGreater(most, 0.02)
        for result in results:
            self.assertTrue(np.array_equal(result, expected))

    def test_messages_are_each_threads_own(self):
        transfer = npt.PoseTransfer(method="network", threads=1)
        seen = {}

        def work(i):
            bad = self.paper[1].copy()
            bad[7, 0] = 70000 + i
            for _ in range(20):
                try:
                    transfer(self.identity, (self.paper[0], bad))
                except npt.Error as error:
                    seen.setdefault(i, set()).add(str(error))

        threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for i in range(4):
            self.assertEqual(seen[i], {f"pose: triangle 7: found vertex {70000 + i}, expected a number below 6890"})


class BadInput(Figures):
    def test_arrays(self):
        transfer = npt.PoseTransfer()
        xyz, faces = self.identity
        self.fails(
            "identity: found vertices of shape [20670], expected an array [V, 3] of numbers",
            transfer,
            xyz.ravel(),
            self.pose,
        )
        self.fails("pose: found vertices of shape [3, 6890]", transfer, self.identity, xyz.T)
        self.fails(
            "identity: found vertices of type <U1, expected an array [V, 3]", transfer, [["a", "b", "c"]], self.pose
        )
        self.fails("identity: found vertices of type complex64", transfer, xyz.astype(np.complex64), self.pose)
        self.fails("in rows of different lengths", transfer, [[1, 2, 3], [4, 5]], self.pose)
        self.fails("identity: found faces of type float64", transfer, (xyz, faces.astype(float)), self.pose)
        self.fails(
            "identity: found faces of shape [6890, 3, 2]", transfer, (xyz, np.zeros((6890, 3, 2), int)), self.pose
        )
        self.fails("identity: found faces of shape [5, 5]", transfer, (xyz, np.zeros((5, 5), int)), self.pose)
        bad = faces.copy()
        bad[4, 1] = -1
        self.fails("identity: face 4: found", transfer, (xyz, bad), self.pose)
        bad[4, 1] = 6890
        self.fails(
            "identity: triangle 4: found vertex 6890, expected a number below 6890", transfer, (xyz, bad), self.pose
        )
        self.fails("identity: found a tuple of 3, expected (vertices, faces)", transfer, (xyz, faces, faces), self.pose)
        self.fails("identity: found 'identity.obj', expected a mesh", transfer, "identity.obj", self.pose)
        self.fails("pose: found None, expected a mesh", transfer, self.identity, None)
        for odd in (np.nan, np.inf, 1e300):
            wrong = xyz.astype(np.float64)
            wrong[5, 1] = odd
            self.fails("walk.obj: vertex 5: found", transfer, self.identity, npt.Mesh(wrong, faces, "walk.obj"))

    def test_empty(self):
        transfer = npt.PoseTransfer()
        self.fails("identity: found no vertices", transfer, np.zeros((0, 3), np.float32), self.pose)
        self.fails("pose: found no vertices", transfer, self.identity, [])
        self.fails("found no vertices", npt.pmd, [], [])
        self.fails("one point", transfer, (np.ones((50, 3), np.float32), np.array([[0, 1, 2]])), self.pose)

    def test_out(self):
        transfer = npt.PoseTransfer(method="network")
        for out in (np.empty((6890, 3)), np.empty((6889, 3), np.float32), np.empty((3, 6890), np.float32).T, [1, 2]):
            self.fails(
                "expected a contiguous, writable float32 array [6890, 3]", transfer, self.identity, self.paper, out=out
            )

    def test_options(self):
        self.fails("method: found 'magic', expected one of automatic, body, network", npt.PoseTransfer, method="magic")
        self.fails("pairings: found 0", npt.PoseTransfer, pairings=0)
        self.fails("seed: found -1", npt.PoseTransfer, seed=-1)
        self.fails("threads: found 1.5", npt.PoseTransfer, threads=1.5)
        self.fails("unit: found 'yard', expected one of metre", npt.PoseTransfer, unit="yard")
        self.fails("quality: found 'good', expected one of fast, balanced, best", npt.PoseTransfer, quality="good")
        self.fails("figure: found -1", npt.PoseTransfer, figure=-1)
        self.fails("least_confidence: found 2", npt.PoseTransfer, least_confidence=2)
        self.fails("pairing: found 'any'", npt.PoseTransfer, pairing="any")
        self.fails("refine_radius: found 0", npt.PoseTransfer, refine_radius=0)
        self.fails(
            "weights: found 'horse', expected one of human, human-pooled, quadruped",
            npt.PoseTransfer,
            "horse",
        )
        self.fails("weights: found 7", npt.PoseTransfer, 7)

    def test_figure(self):
        (first, faces), (second, others) = self.identity, self.pose
        aside = second + np.float32([3, 0, 0])
        both = (np.concatenate([first, aside]), np.concatenate([faces, others + len(first)]))
        posed = npt.PoseTransfer(figure=2)(both, self.pose)
        self.assertTrue(np.array_equal(posed[: len(first)], first))
        self.assertFalse(np.array_equal(posed[len(first) :], aside))
        with self.assertRaises(npt.Error) as refused:
            npt.PoseTransfer(figure=3)(both, self.pose)
        self.assertIn("found 2 figures, expected at least 3", str(refused.exception))

    def test_weights_of_another_network(self):
        self.fails("none.safetensors", npt.PoseTransfer, "none.safetensors")
        (FOLDER / "junk.safetensors").write_bytes(b"not weights")
        self.fails("junk.safetensors", npt.PoseTransfer, FOLDER / "junk.safetensors")
        small = Path(__file__).resolve().parents[1] / "data/golden/paper_b16_v35.weights.safetensors"
        self.fails("found bottleneck 16, conv_relu, per-vertex, expected one of the networks", npt.PoseTransfer, small)
        several = npt.PoseTransfer(["human", "quadruped"])
        self.assertTrue(several.character(self.identity).recognised)

    def test_no_person(self):
        transfer = npt.PoseTransfer()
        knot = npt.Mesh(*self.knot, name="knot.obj")
        for call in (transfer, transfer.report):
            with self.assertRaises(npt.Error) as refused:
                call(self.identity, knot)
            self.assertEqual((refused.exception.code, refused.exception.remedy), ("not_recognised", "choose_method"))
            self.assertIn("knot.obj: found a mesh that is not recognised as a person (confidence ", str(refused.exception))
            self.assertIn(", nor as a four-legged animal (", str(refused.exception))
            self.assertIn('method="network"', str(refused.exception))
        pose = transfer.pose(knot)
        self.assertLess(pose.confidence, 0.6)
        (warning,) = pose.warnings
        self.assertEqual((warning.code, warning.mesh, warning.value), ("not_recognised", "pose", pose.confidence))
        self.assertIn("knot.obj is not recognised as a person (confidence ", warning.text)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            transfer(self.identity, npt.Mesh(self.pose[0], name="points"))
        self.assertEqual([w.category for w in caught], [npt.TransferWarning])
        self.assertEqual(caught[0].filename, __file__)
        warning = caught[0].message
        self.assertEqual((warning.code, warning.mesh), ("no_surface", "pose"))
        advice = npt._library.ADVICE[warning.remedy]
        self.assertEqual(str(warning), f"{warning.text}; {advice}" if advice else warning.text)
        giant = (
            self.identity[0] * np.float32(5),
            self.identity[1],
        )  # of no person's size in metres, centimetres or millimetres
        self.assertEqual(transfer.report(giant, self.pose).method, "body")
        with self.assertRaises(npt.Error) as refused:
            npt.PoseTransfer(method="network")(giant, knot)
        self.assertEqual((refused.exception.code, refused.exception.remedy), ("unknown_unit", "give_unit"))
        self.assertIn("PoseTransfer(unit=...) sets the unit", str(refused.exception))

    def test_library(self):
        code = "import npt"
        env = dict(os.environ, NPT_LIBRARY=str(FOLDER / "identity.obj"))
        done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("npt._library.Error: ", done.stderr)
        self.assertIn("found a library that can't be opened", done.stderr)


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        print(
            f"npt {npt.__version__} from {npt.library_file()}, numpy {np.__version__}, Python {sys.version.split()[0]}"
        )
        unittest.main()
