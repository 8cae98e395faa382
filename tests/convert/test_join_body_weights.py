"""join_body_weights.py: body estimation beside a network in one file, replaced, and what is no such network."""

import unittest

from support import ConverterTest, safetensors_bytes


def file_with(metadata, names):
    return safetensors_bytes(metadata, {name: ("U8", [1], bytes([i])) for i, name in enumerate(names, 1)})


class JoinBodyWeights(ConverterTest):
    script = "join_body_weights.py"

    def test_joins_and_replaces(self):
        network = self.file("network.safetensors", file_with({"domain": "human", "correspondence/seed": "1"}, ["w", "correspondence/old"]))
        correspondence = self.file("c.safetensors", file_with({"net": "correspondence", "seed": "7"}, ["w", "v"]))
        bias = self.file("bias.safetensors", file_with({}, ["a", "b", "fit_bias/joints"]))
        stored, metadata = self.converted(network, "--correspondence", correspondence, "--fit-bias", bias)
        self.assertEqual(
            stored,
            {
                "w": ("U8", [1], b"\x01"),
                "correspondence/w": ("U8", [1], b"\x01"),
                "correspondence/v": ("U8", [1], b"\x02"),
                "fit_bias/joints": ("U8", [1], b"\x03"),
            },
        )
        self.assertEqual(list(stored)[0], "w")
        self.assertEqual(
            metadata,
            {
                "domain": "human",
                "correspondence/net": "correspondence",
                "correspondence/seed": "7",
            },
        )

    def test_joins_another_kind_of_body(self):
        network = self.file("network.safetensors", file_with({"domain": "quadruped", "body/plan": "old"}, ["w", "body/old"]))
        template = self.file("body.safetensors", file_with({"plan": "plan quadruped", "unit": "metre"}, ["v_template", "f"]))
        poses = self.file("poses.safetensors", file_with({"plan": "quadruped"}, ["pose_prior/mean", "pose_prior/poses"]))
        stored, metadata = self.converted(network, "--body", template, "--pose-prior", poses)
        self.assertEqual(
            stored,
            {
                "w": ("U8", [1], b"\x01"),
                "body/v_template": ("U8", [1], b"\x01"),
                "body/f": ("U8", [1], b"\x02"),
                "pose_prior/mean": ("U8", [1], b"\x01"),
                "pose_prior/poses": ("U8", [1], b"\x02"),
            },
        )
        self.assertEqual(metadata, {"domain": "quadruped", "body/plan": "plan quadruped", "body/unit": "metre"})

    def test_takes_both_from_a_joined_file(self):
        network = self.file("network.safetensors", file_with({"domain": "quadruped"}, ["w"]))
        names = ["other", "body/f", "pose_prior/mean"]
        joined = self.file("joined.safetensors", file_with({"domain": "old", "body/plan": "plan quadruped"}, names))
        stored, metadata = self.converted(network, "--body", joined, "--pose-prior", joined)
        self.assertEqual(sorted(stored), ["body/f", "pose_prior/mean", "w"])
        self.assertEqual(stored["body/f"], ("U8", [1], b"\x02"))
        self.assertEqual(metadata, {"domain": "quadruped", "body/plan": "plan quadruped"})

    def test_refuses_a_template_without_a_plan_and_a_file_without_poses(self):
        network = self.file("network.safetensors", file_with({}, ["w"]))
        other = self.file("other.safetensors", file_with({"unit": "metre"}, ["v_template"]))
        self.refused(network, "other.safetensors", "found no plan", options=("--body", other))
        self.refused(network, "other.safetensors", "found none below pose_prior/", options=("--pose-prior", other))

    def test_refuses_other_networks(self):
        network = self.file("network.safetensors", file_with({}, ["w"]))
        other = self.file("other.safetensors", file_with({"net": "pose"}, ["w"]))
        self.refused(network, "metadata net", "'pose'", "'correspondence'", options=("--correspondence", other))
        self.refused(network, "found none below fit_bias/", options=("--fit-bias", other))


if __name__ == "__main__":
    unittest.main()
