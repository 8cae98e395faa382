"""set_metadata.py: texts added, replaced and taken out, tensors as they were."""

import unittest

from support import ConverterTest, safetensors_bytes


def file_with(metadata):
    return safetensors_bytes(metadata, {"a": ("F16", [2], b"\x01\x02\x03\x04")})


class SetMetadata(ConverterTest):
    script = "set_metadata.py"

    def test_adds_replaces_and_takes_out(self):
        source = self.file("a.safetensors", file_with({"unit": "metre", "seed": "1", "domain": "x=y"}))
        stored, metadata = self.converted(source, "unit=inch", "refine_radius=0.08", "seed=", "note=a=b")
        self.assertEqual(metadata, {"unit": "inch", "domain": "x=y", "refine_radius": "0.08", "note": "a=b"})
        self.assertEqual(stored, {"a": ("F16", [2], b"\x01\x02\x03\x04")})

    def test_refuses_what_is_no_text_and_what_isnt_there(self):
        source = self.file("a.safetensors", file_with({}))
        self.refused(source, "'unit'", "KEY=VALUE", options=("unit",))
        self.refused(source, "'=x'", options=("=x",))
        self.refused(source, "metadata seed", "nothing", options=("seed=",))


if __name__ == "__main__":
    unittest.main()
