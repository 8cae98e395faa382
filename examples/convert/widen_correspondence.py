#!/usr/bin/env python3
"""Makes weights of a correspondence network twice as wide that gives the same: a start for training a wider one.

    widen_correspondence.py narrow.safetensors wide.safetensors

Every hidden channel of the decoder and the encoder's last layer stands twice; weights that read a pair of twins are divided between
the two at random, so that training takes them apart. Source: Chen et al., "Net2Net", ICLR 2016.
"""

import argparse
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("error: this converter needs numpy (Debian: python3-numpy)")

from convert_common import ConvertError, read_floats, run, write_floats


def read(path):
    metadata, tensors = read_floats(path)
    if metadata.get("net") != "correspondence":
        raise ConvertError(f"{path}: found net {metadata.get('net')}, expected correspondence")
    return metadata, tensors


def widened(tensors, width, random):
    def inputs(weight, parts):
        """parts: (channels, whether they stand twice now)"""
        columns, at = [], 0
        for channels, twice in parts:
            part = weight[:, at : at + channels]
            at += channels
            if twice:
                share = (0.5 + 0.3 * random.standard_normal(part.shape)).astype(np.float32)
                columns += [part * share, part * (1 - share)]
            else:
                columns.append(part)
        return np.concatenate(columns, 1)

    result = {}
    for name, weight in tensors.items():
        first = name.startswith(("encoder.conv1.", "encoder.conv2.")) or name == "output_scale"
        last = name.startswith("decoder.conv4.")
        if not first and not last:
            weight = np.concatenate([weight, weight])
        if name == "decoder.conv1.weight":
            weight = inputs(weight, [(width, True), (6, False)])
        elif name.startswith("decoder.") and name.endswith(".weight") and "spadain" not in name:
            weight = inputs(weight, [(weight.shape[1], True)])
        result[name] = weight
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("narrow")
    parser.add_argument("wide")
    arguments = parser.parse_args()
    metadata, tensors = read(arguments.narrow)
    width = int(metadata["width"])
    wide = widened(tensors, width, np.random.default_rng(5))
    metadata = {"net": "correspondence", "width": 2 * width, "output_scale": metadata["output_scale"], "normalisation": "none", "unit": "metre"}
    write_floats(arguments.wide, wide, metadata)


if __name__ == "__main__":
    run(main)
