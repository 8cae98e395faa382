"""blend_weights.py: what lies between two weights, and files that don't belong together."""

import sys
import unittest

try:
    import numpy as np
except ImportError:
    print("SKIPPED: numpy is not installed")
    sys.exit(0)

from support import ConverterTest, safetensors_bytes


def weights(seed, shape=(3, 2, 1), dtype="F32", spoil=None, prefix=""):
    tensor = np.random.default_rng(seed).standard_normal(shape).astype("<f4")
    if spoil is not None:
        tensor.flat[0] = spoil
    metadata = {"net": "correspondence", "pmd": "1", "seed": str(seed)}
    return tensor, safetensors_bytes(metadata, {prefix + "conv.weight": (dtype, shape, tensor.tobytes())})


class BlendWeights(ConverterTest):
    script = "blend_weights.py"

    def options_for(self, data, share="0.25"):
        return ("--other", self.file("other.safetensors", data), "--share", share)

    def test_lies_between_the_two_and_says_so(self):
        (first, first_data), (other, other_data) = weights(1), weights(2)
        stored, metadata = self.converted(self.file("first.safetensors", first_data), *self.options_for(other_data))
        blended = np.frombuffer(stored["conv.weight"][2], "<f4").reshape(first.shape)
        np.testing.assert_allclose(blended, 0.75 * first + 0.25 * other, rtol=1e-6, atol=1e-7)
        self.assertEqual(metadata, {"net": "correspondence", "seed": "1", "blended": "with 0.25 of other.safetensors"})

    def test_takes_the_correspondence_network_of_a_joined_file(self):
        (first, first_data), (other, other_data) = weights(1), weights(2, prefix="correspondence/")
        stored, metadata = self.converted(self.file("first.safetensors", first_data), *self.options_for(other_data))
        blended = np.frombuffer(stored["conv.weight"][2], "<f4").reshape(first.shape)
        np.testing.assert_allclose(blended, 0.75 * first + 0.25 * other, rtol=1e-6, atol=1e-7)
        self.assertEqual(metadata["net"], "correspondence")

    def test_refuses_other_shapes_types_numbers_and_shares(self):
        first = self.file("first.safetensors", weights(1)[1])
        self.refused(first, "other.safetensors", "conv.weight", "(3, 3, 1)", "(3, 2, 1)", options=self.options_for(weights(2, (3, 3, 1))[1]))
        self.refused(first, "other.safetensors", "conv.weight", "F16", "F32", options=self.options_for(weights(2, dtype="F16")[1]))
        self.refused(first, "other.safetensors", "conv.weight", "not finite", options=self.options_for(weights(2, spoil=np.nan)[1]))
        self.refused(first, "--share", "2", "0 to 1", options=self.options_for(weights(2)[1], "2"))


if __name__ == "__main__":
    unittest.main()
