"""widen_correspondence.py: twins that give the same, and bad files."""

import sys
import unittest

try:
    import numpy as np
except ImportError:
    print("SKIPPED: numpy is not installed")
    sys.exit(0)

from support import ConverterTest, safetensors_bytes

WIDTH = 4
SHAPES = {
    "encoder.conv2.weight": (5, 3, 1),
    "encoder.conv3.weight": (WIDTH, 5, 1),
    "encoder.conv3.bias": (WIDTH,),
    "decoder.conv1.weight": (WIDTH, WIDTH + 6, 1),
    "decoder.block1.spadain1.conv_weight.weight": (WIDTH, 3, 1),
    "decoder.block1.conv1.weight": (WIDTH, WIDTH, 1),
    "decoder.conv2.weight": (WIDTH, WIDTH, 1),
    "decoder.conv4.weight": (3, WIDTH, 1),
    "decoder.conv4.bias": (3,),
    "output_scale": (1,),
}


def weights(dtype="F32", net="correspondence"):
    random = np.random.default_rng(1)
    tensors = {name: random.standard_normal(shape).astype("<f4") for name, shape in SHAPES.items()}
    metadata = {"net": net, "width": str(WIDTH), "output_scale": "1"}
    return tensors, safetensors_bytes(metadata, {name: (dtype, t.shape, t.tobytes()) for name, t in tensors.items()})


class WidenCorrespondence(ConverterTest):
    script = "widen_correspondence.py"

    def test_twins_read_what_the_narrow_channels_read(self):
        narrow, data = weights()
        stored, metadata = self.converted(self.file("narrow.safetensors", data))
        self.assertEqual((metadata["net"], metadata["width"]), ("correspondence", str(2 * WIDTH)))
        wide = {name: np.frombuffer(raw, "<f4").reshape(shape) for name, (_, shape, raw) in stored.items()}
        for name in ("encoder.conv2.weight", "decoder.conv4.bias", "output_scale"):
            np.testing.assert_array_equal(wide[name], narrow[name])
        for name in ("encoder.conv3.weight", "encoder.conv3.bias", "decoder.block1.spadain1.conv_weight.weight"):
            np.testing.assert_array_equal(wide[name], np.concatenate([narrow[name]] * 2))
        for name, parts in (
            ("decoder.conv1.weight", (WIDTH, -6)),
            ("decoder.block1.conv1.weight", (WIDTH,)),
            ("decoder.conv2.weight", (WIDTH,)),
            ("decoder.conv4.weight", (WIDTH,)),
        ):
            rows = narrow[name] if name == "decoder.conv4.weight" else np.concatenate([narrow[name]] * 2)
            at, sums = 0, []
            for part in parts:  # below 0: inputs that stand once
                if part > 0:
                    first, second = wide[name][:, at : at + part], wide[name][:, at + part : at + 2 * part]
                    self.assertTrue(np.any(first != second))
                    sums.append(first + second)
                    at += 2 * part
                else:
                    sums.append(wide[name][:, at : at - part])
                    at -= part
            self.assertEqual(at, wide[name].shape[1])
            np.testing.assert_allclose(np.concatenate(sums, 1), rows, atol=1e-6)

    def test_bad_files_are_refused(self):
        _, data = weights()
        self.refused(self.folder / "none.safetensors", "none.safetensors: cannot read")
        self.refused(self.file("cut.safetensors", data[:100]), "cut.safetensors: found no safetensors file")
        self.refused(self.file("short.safetensors", data[:-8]), "short.safetensors: ", "expected shape")
        self.refused(self.file("half.safetensors", weights(dtype="F16")[1]), "found F16, expected F32")
        self.refused(self.file("other.safetensors", weights(net="full")[1]), "found net full, expected correspondence")


if __name__ == "__main__":
    unittest.main()
