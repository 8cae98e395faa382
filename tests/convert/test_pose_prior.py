"""fit_pose_prior.py: a mixture found again from poses drawn of it, the header's numbers, mirror images, tilts, and bad files."""

import re
import sys
import unittest

try:
    import numpy as np
except ImportError:
    print("SKIPPED: numpy is not installed")
    sys.exit(0)

from support import SCRIPTS, ConverterTest, safetensors_bytes

sys.path.insert(0, str(SCRIPTS))
sys.dont_write_bytecode = True
import fit_pose_prior as prior  # noqa: E402


def pose_file(poses, names=None, name="poses", dtype="F32"):
    data = np.ascontiguousarray(poses, dtype="<f4").tobytes()
    return safetensors_bytes({"names": "\n".join(names or [])}, {name: (dtype, np.shape(poses), data)})


def two_modes(count, random):
    """[count, 24, 3]: half of the poses bend the left knee by 1 or the right one (mirrored), half lift both arms by 1.2."""
    poses = random.normal(size=(count, 24, 3)) * 0.04
    for i, pose in enumerate(poses):
        if i % 2:
            pose[prior.JOINTS.index("l_knee" if i % 4 == 1 else "r_knee"), 0] += 1
        else:
            pose[prior.JOINTS.index("l_shoulder"), 2] += 1.2
            pose[prior.JOINTS.index("r_shoulder"), 2] -= 1.2
    return poses


class Features(unittest.TestCase):
    def test_the_tilt_is_the_root_without_its_turn_about_the_vertical(self):
        random = np.random.default_rng(1)
        for _ in range(50):
            root = random.normal(size=3) * 1.2
            x, z = prior.tilt(root)
            turn = prior.rotation(root) @ prior.rotation([x, 0, z]).T
            self.assertAlmostEqual(turn[1, 1], 1, places=9)
        self.assertEqual(prior.tilt([0, 2, 0]), (0, 0))

    def test_axis_angles_of_rotations(self):
        random = np.random.default_rng(2)
        for v in list(random.normal(size=(20, 3))) + [np.array([0, np.pi, 0]), np.array([np.pi, 0, 0]), np.zeros(3)]:
            self.assertTrue(np.allclose(prior.rotation(prior.axis_angle(prior.rotation(v))), prior.rotation(v), atol=1e-7))

    def test_mirroring_twice_is_nothing_and_swaps_sides(self):
        x = np.random.default_rng(3).normal(size=(4, prior.D))
        self.assertTrue(np.array_equal(prior.mirrored(prior.mirrored(x)), x))
        left, right = (2 + 3 * (prior.JOINTS.index(name) - 1) for name in ("l_elbow", "r_elbow"))
        self.assertTrue(np.array_equal(prior.mirrored(x)[:, right:right + 3], x[:, left:left + 3] * [1, -1, -1]))


class Fit(unittest.TestCase):
    def test_two_modes_are_found_again_and_left_out_poses_are_likely(self):
        random = np.random.default_rng(4)
        x = prior.features(two_modes(160, random))
        mixture, _ = prior.fit(x[:120], np.ones(120), 2, 3, 4.0, 0.03, random)
        self.assertTrue(np.allclose(sorted(mixture.weights), 0.5, atol=0.02))
        knees = [2 + 3 * (prior.JOINTS.index(name) - 1) for name in ("l_knee", "r_knee")]
        bent = max(mixture.means, key=lambda m: m[knees].max())
        self.assertAlmostEqual(bent[knees].max(), 1, delta=0.03)  # one knee, not half of both
        self.assertAlmostEqual(bent[knees].min(), 0, delta=0.03)
        held_out = mixture.log_density(x[120:])
        self.assertGreater(held_out.min(), mixture.log_density(x[120:] + 0.3).max())

    def test_the_density_is_that_of_the_covariances(self):
        random = np.random.default_rng(5)
        factor, deviation, mean = random.normal(size=(prior.D, 2)), random.uniform(0.5, 1, prior.D), random.normal(size=prior.D)
        mixture = prior.Mixture(np.ones(1), mean[None], factor[None], deviation[None])
        x = random.normal(size=(3, prior.D))
        covariance = factor @ factor.T + np.diag(deviation**2)
        sign, log_determinant = np.linalg.slogdet(covariance)
        d = x - mean
        expected = -0.5 * (np.sum(d @ np.linalg.inv(covariance) * d, axis=1) + log_determinant + prior.D * np.log(2 * np.pi))
        self.assertTrue(np.allclose(mixture.log_terms(x)[:, 0], expected))
        self.assertTrue(np.allclose(mixture.log_density(x), mixture.log_density(prior.mirrored(x))))


class Header(ConverterTest):
    script = "fit_pose_prior.py"

    def setUp(self):
        super().setUp()
        self.output = self.folder / "data.hpp"

    def numbers(self, text, name):
        largest = float(re.search(rf"{name}_largest = ([0-9.e+-]+);", text).group(1))
        rows = re.search(rf"{name}\[\] =((?:\s*\"[^\"]*\")+);", text).group(1)
        joined = "".join(re.findall(r'"([^"]*)"', rows))
        values = [prior.DIGITS.index(a) * 64 + prior.DIGITS.index(b) for a, b in zip(joined[::2], joined[1::2])]
        return (np.array(values) / 4095 * 2 - 1) * largest

    def test_a_header_of_whole_tables(self):
        poses = two_modes(40, np.random.default_rng(6))
        options = ("--components", "2", "--rank", "3", "--starts", "1", "--shrink", "4")
        path = self.file("a.safetensors", pose_file(poses))
        result = self.convert(path, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        text = self.output.read_text()
        self.assertLess(max(len(line) for line in text.split("\n")), 121)
        modes = len(prior.hand_made())
        weights = self.numbers(text, "natural_pose_weights")
        self.assertEqual(len(weights), 2 + modes)
        self.assertAlmostEqual(weights.sum(), 1, delta=0.01)
        self.assertAlmostEqual(weights[2:].sum(), 0.25, delta=0.01)
        self.assertEqual(len(self.numbers(text, "natural_pose_means")), (2 + modes) * prior.D)
        self.assertEqual(len(self.numbers(text, "natural_pose_deviations")), 3 * prior.D)
        self.assertEqual(len(self.numbers(text, "natural_pose_factors")), 3 * 3 * prior.D)
        low, high = self.numbers(text, "natural_pose_limits").reshape(2, prior.D)
        self.assertTrue(np.all(low < high))
        self.assertTrue(np.all(self.numbers(text, "natural_pose_deviations") > 0))
        again = self.output.read_bytes()
        self.convert(path, *options)
        self.assertEqual(self.output.read_bytes(), again)

    def test_bad_files_are_refused(self):
        poses = two_modes(12, np.random.default_rng(7))
        self.refused(self.folder / "none.safetensors", "none.safetensors")
        self.refused(self.file("a.safetensors", b"no"), "a.safetensors", "no safetensors file with a tensor poses")
        self.refused(self.file("a.safetensors", pose_file(poses, name="others")), "tensor poses")
        self.refused(self.file("a.safetensors", pose_file(poses, dtype="F16")), "found F16")
        self.refused(self.file("a.safetensors", pose_file(poses[:, :9])), "found shape [12, 9, 3]")
        poses[3, 2, 1] = np.nan
        self.refused(self.file("a.safetensors", pose_file(poses)), "not finite")
        good = self.file("a.safetensors", pose_file(two_modes(12, np.random.default_rng(8))))
        self.refused(good, "--components", options=("--components", "0"))
        self.refused(good, "--by-hand", options=("--by-hand", "1"))


if __name__ == "__main__":
    unittest.main()
