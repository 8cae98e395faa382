"""drop_pooling.py: what is left reads what it read before but for pooled channels, and bad files."""

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
    "encoder.conv3.weight": (WIDTH, 5, 1),
    "decoder.conv1.weight": (WIDTH, 2 * WIDTH + 6, 1),
    "decoder.pool2.weight": (WIDTH, WIDTH, 1),
    "decoder.pool2.bias": (WIDTH,),
    "decoder.conv2.weight": (WIDTH, 2 * WIDTH, 1),
    "decoder.pool3.weight": (WIDTH, WIDTH, 1),
    "decoder.conv3.weight": (WIDTH // 2, 2 * WIDTH, 1),
    "output_scale": (1,),
}


def weights(prefix="", net="correspondence", shapes=SHAPES):
    random = np.random.default_rng(1)
    tensors = {prefix + name: random.standard_normal(shape).astype("<f4") for name, shape in shapes.items()}
    metadata = {prefix + "net": net, prefix + "width": str(WIDTH)}
    return tensors, safetensors_bytes(metadata, {name: ("F32", t.shape, t.tobytes()) for name, t in tensors.items()})


class DropPooling(ConverterTest):
    script = "drop_pooling.py"

    def test_other_weights_keep_their_bits(self):
        for prefix in ("", "correspondence/"):
            old, data = weights(prefix)
            stored, metadata = self.converted(self.file("old.safetensors", data))
            self.assertEqual(metadata, {prefix + "net": "correspondence", prefix + "width": str(WIDTH)})
            new = {name: np.frombuffer(raw, "<f4").reshape(shape) for name, (_, shape, raw) in stored.items()}
            self.assertEqual(set(old) - set(new), {prefix + name for name in SHAPES if "pool" in name})
            np.testing.assert_array_equal(new[prefix + "encoder.conv3.weight"], old[prefix + "encoder.conv3.weight"])
            first = old[prefix + "decoder.conv1.weight"]
            np.testing.assert_array_equal(
                new[prefix + "decoder.conv1.weight"], np.concatenate([first[:, :WIDTH], first[:, -6:]], 1)
            )
            for name in ("decoder.conv2.weight", "decoder.conv3.weight"):
                np.testing.assert_array_equal(new[prefix + name], old[prefix + name][:, :WIDTH])

    def test_bad_files_are_refused(self):
        _, data = weights()
        self.refused(self.folder / "none.safetensors", "none.safetensors: cannot read")
        self.refused(self.file("other.safetensors", weights(net="full")[1]), "found net full, expected correspondence")
        new = {name: shape for name, shape in SHAPES.items() if "pool" not in name}
        self.refused(self.file("new.safetensors", weights(shapes=new)[1]), "expected correspondence with decoder.pool2.weight")
        odd = {**SHAPES, "decoder.conv2.weight": (WIDTH, 2 * WIDTH + 1, 1)}
        self.refused(self.file("odd.safetensors", weights(shapes=odd)[1]), "odd.safetensors: decoder.conv2.weight: found F32")
        flat = {**SHAPES, "decoder.conv2.weight": (2 * WIDTH * WIDTH,)}
        self.refused(self.file("flat.safetensors", weights(shapes=flat)[1]), "flat.safetensors: decoder.conv2.weight: found F32 [32]")
        less = {name: shape for name, shape in SHAPES.items() if name != "decoder.conv3.weight"}
        self.refused(self.file("less.safetensors", weights(shapes=less)[1]), "found no decoder.conv3.weight")


if __name__ == "__main__":
    unittest.main()
