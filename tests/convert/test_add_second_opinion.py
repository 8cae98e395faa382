"""add_second_opinion.py: a network beside a reader in one file, replaced and taken out again."""

import json
import struct
import unittest

from support import ConverterTest


def file_with(metadata, names):
    header = {"__metadata__": metadata}
    for i, name in enumerate(names):
        header[name] = {"dtype": "U8", "shape": [1], "data_offsets": [i, i + 1]}
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + bytes(range(1, len(names) + 1))


POOLED = {"bottleneck": "256", "feature": "pooled", "order": "conv_relu", "seed": "4"}


class AddSecondOpinion(ConverterTest):
    script = "add_second_opinion.py"

    def test_adds_replaces_and_takes_out(self):
        reader = file_with({"net": "reader", "second_opinion/seed": "1"}, ["w", "second_opinion/old"])
        network = self.file("network.safetensors", file_with(POOLED, ["w"]))
        stored, metadata = self.converted(self.file("reader.safetensors", reader), "--network", network)
        self.assertEqual(stored, {"w": ("U8", [1], b"\x01"), "second_opinion/w": ("U8", [1], b"\x01")})
        self.assertEqual(metadata, {"net": "reader", "second_opinion/bottleneck": "256", "second_opinion/feature": "pooled",
                                    "second_opinion/order": "conv_relu"})
        stored, metadata = self.converted(self.file("reader.safetensors", reader))
        self.assertEqual((stored, metadata), ({"w": ("U8", [1], b"\x01")}, {"net": "reader"}))

    def test_refuses_what_is_no_reader_and_other_networks(self):
        self.refused(self.file("a.safetensors", file_with(POOLED, ["w"])), "metadata net", "None", "'reader'")
        reader = self.file("reader.safetensors", file_with({"net": "reader"}, ["w"]))
        other = self.file("other.safetensors", file_with({**POOLED, "feature": "per-vertex"}, ["w"]))
        self.refused(reader, "metadata feature", "'per-vertex'", "'pooled'", options=("--network", other))


if __name__ == "__main__":
    unittest.main()
