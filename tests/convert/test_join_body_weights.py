"""join_body_weights.py: body estimation beside a network in one file, replaced, and what is no such network."""

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


class JoinBodyWeights(ConverterTest):
    script = "join_body_weights.py"

    def test_joins_and_replaces(self):
        network = self.file("network.safetensors", file_with({"domain": "human", "correspondence/seed": "1"}, ["w", "correspondence/old"]))
        correspondence = self.file("c.safetensors", file_with({"net": "correspondence", "seed": "7"}, ["w", "v"]))
        correction = self.file("joined.safetensors", file_with({"network_correction/" + k: t for k, t in POOLED.items()}, ["a", "network_correction/w"]))
        bias = self.file("bias.safetensors", file_with({}, ["a", "b", "fit_bias/joints"]))
        stored, metadata = self.converted(
            network, "--correspondence", correspondence, "--correction", correction, "--fit-bias", bias
        )
        self.assertEqual(
            stored,
            {
                "w": ("U8", [1], b"\x01"),
                "correspondence/w": ("U8", [1], b"\x01"),
                "correspondence/v": ("U8", [1], b"\x02"),
                "fit_bias/joints": ("U8", [1], b"\x03"),
                "network_correction/w": ("U8", [1], b"\x02"),
            },
        )
        self.assertEqual(list(stored)[0], "w")
        self.assertEqual(
            metadata,
            {
                "domain": "human",
                "correspondence/net": "correspondence",
                "correspondence/seed": "7",
                **{"network_correction/" + k: t for k, t in POOLED.items()},
            },
        )

    def test_refuses_other_networks(self):
        network = self.file("network.safetensors", file_with({}, ["w"]))
        other = self.file("other.safetensors", file_with({**POOLED, "feature": "per-vertex"}, ["w"]))
        self.refused(network, "metadata net", "None", "'correspondence'", options=("--correspondence", other))
        self.refused(network, "metadata feature", "'per-vertex'", "'pooled'", options=("--correction", other))
        self.refused(network, "found none below fit_bias/", options=("--fit-bias", other))


if __name__ == "__main__":
    unittest.main()
