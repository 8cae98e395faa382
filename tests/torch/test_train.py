"""examples/torch/train.py: its network is npt's (golden cases), its Muon orthogonalises, a training learns, is saved and resumed."""

import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "examples" / "torch" / "train.py"
GOLDEN = ROOT / "tests" / "data" / "golden"

try:
    import numpy as np
    import torch
except ImportError:
    print("SKIPPED: python3 has no PyTorch")
    sys.exit(0)

specification = importlib.util.spec_from_file_location("train", SCRIPT)
train = importlib.util.module_from_spec(specification)
specification.loader.exec_module(train)


def small_body(path, vertices=150):
    """A body of 24 joints, the first of which carries all others; every vertex follows two of them."""
    random = np.random.default_rng(1)
    place = np.linspace(0, 1, vertices)
    rest = np.stack([0.2 * np.cos(40 * place), 1.7 * place, 0.2 * np.sin(40 * place)], 1)
    joint = np.minimum((24 * place).astype(int), 23)
    weights = np.zeros((vertices, 24))
    weights[np.arange(vertices), joint] += 0.7
    weights[np.arange(vertices), np.maximum(joint - 1, 0)] += 0.3
    regressor = np.stack([(joint == j) / max(1, (joint == j).sum()) for j in range(24)])
    tensors = {"v_template": rest, "shapedirs": 0.02 * random.standard_normal((vertices, 3, 4)), "J_regressor": regressor,
               "weights": weights}
    parents = torch.tensor([-1] + 23 * [0])
    tensors = {k: torch.from_numpy(v).float() for k, v in tensors.items()} | {"parents": parents}
    train.save_safetensors(str(path), tensors, {})
    # The parents' tensor is the only one of whole numbers: say so in the header.
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    head = train.json.loads(data[8:8 + size])
    head["parents"]["dtype"] = "I32"
    begin, end = head["parents"]["data_offsets"]
    text = train.json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    body = data[8 + size:]
    whole = parents.int().numpy().tobytes()
    path.write_bytes(len(text).to_bytes(8, "little") + text + body[:begin] + whole + body[end:])


class TrainTest(unittest.TestCase):
    def run_script(self, *arguments):
        environment = dict(os.environ, OMP_NUM_THREADS="1")
        return subprocess.run([sys.executable, "-B", str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                              env=environment, timeout=300)

    def test_network_is_the_reference(self):
        for name, pooled in (("paper_b16_v35", False), ("paper_b61_v99", False), ("pooled_b16_v35", True)):
            weights, _ = train.load_safetensors(GOLDEN / f"{name}.weights.safetensors")
            case, _ = train.load_safetensors(GOLDEN / f"{name}.case.safetensors")
            get = {k: torch.from_numpy(np.array(v)).double() for k, v in case.items() if v.dtype != np.int32}
            parameters = {k: torch.from_numpy(np.array(v)).float() for k, v in weights.items()}
            network = train.Network(parameters, pooled, torch.float32)
            result = network(get["pose"].float().transpose(1, 2), get["identity"].float().transpose(1, 2))
            error = (result.transpose(1, 2).double() - get["output"]).abs().max().item()
            self.assertLess(error, 1e-5, name)

    def test_parameters_are_the_networks(self):
        weights, _ = train.load_safetensors(GOLDEN / "paper_b61_v99.weights.safetensors")
        made = train.initial_parameters(61, 0, "cpu")
        self.assertEqual({k: tuple(v.shape) for k, v in weights.items()}, {k: tuple(v.shape) for k, v in made.items()})

    def test_orthogonalised(self):
        matrices = torch.randn(3, 20, 12, generator=torch.Generator().manual_seed(2))
        values = torch.linalg.svdvals(train.orthogonalised(matrices))
        self.assertGreater(values.min().item(), 0.5)
        self.assertLess(values.max().item(), 1.3)

    def test_pose_ranges(self):
        paper, wide = train.pose_ranges(False), train.pose_ranges(True)
        self.assertAlmostEqual(np.degrees(paper[1, 0, 0]), -90)
        self.assertAlmostEqual(np.degrees(paper[19, 1, 1]), 60)
        self.assertAlmostEqual(np.degrees(wide[2, 2, 0]), -45)
        for table in (paper, wide):
            self.assertTrue((table[..., 0] <= table[..., 1]).all())

    def test_training(self):
        with tempfile.TemporaryDirectory() as folder:
            body, out = pathlib.Path(folder) / "body.safetensors", pathlib.Path(folder) / "w.safetensors"
            small_body(body)
            common = ["--body", body, "--bottleneck", "64", "--device", "cpu", "--precision", "fp32", "--stage", "0:8x40",
                      "--rate", "6e-3", "--out", out]
            first = self.run_script(*common, "--steps", "20")
            self.assertEqual(first.returncode, 0, first.stderr)
            tensors, metadata = train.load_safetensors(out)
            self.assertEqual(metadata["steps"], "20")
            self.assertEqual(tensors["decoder.conv4.weight"].shape, (3, 16, 1))
            second = self.run_script(*common, "--steps", "150", "--resume")
            self.assertEqual(second.returncode, 0, second.stderr)
            _, later = train.load_safetensors(out)
            self.assertEqual(later["steps"], "150")
            self.assertLess(float(later["pmd"]), 0.7 * float(metadata["pmd"]))

    def test_bad_input(self):
        with tempfile.TemporaryDirectory() as folder:
            bad = pathlib.Path(folder) / "bad.safetensors"
            bad.write_bytes(b"nothing")
            out = pathlib.Path(folder) / "w.safetensors"
            result = self.run_script("--body", bad, "--steps", "1", "--out", out)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn("bad.safetensors", result.stderr)
            self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
