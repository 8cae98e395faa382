#!/usr/bin/env python3
"""Takes the pooled channels out of weights of a correspondence network that were trained before it lost them.

    drop_pooling.py old.safetensors new.safetensors

old   weights of `npt train --net correspondence`, or a joined file (join_body_weights.py)

A pooled channel is the same at every point, and the norm behind the convolution that read it takes such a constant away. So the
network gives the same without them, two hundred times nearer to its value in double precision: 1.4e-7 instead of 3e-5 metres.
"""

import argparse
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("error: this converter needs numpy (Debian: python3-numpy)")

from convert_common import ConvertError, read_safetensors, run, write_safetensors

POOLING = ("decoder.pool2.", "decoder.pool3.")
COORDINATES = 6  # point and normal, behind the channels and the pooled ones of the first convolution
READERS = {"decoder.conv1.weight": COORDINATES, "decoder.conv2.weight": 0, "decoder.conv3.weight": 0}


def without_pooled_columns(path, name, tensor, behind):
    dtype, shape, data = tensor
    channels, odd = divmod(shape[1] - behind, 2) if len(shape) > 1 else (0, 0)
    if dtype != "F32" or odd or channels < 1:
        raise ConvertError(f"{path}: {name}: found {dtype} {list(shape)}, expected F32 with as many pooled columns as others")
    weight = np.frombuffer(data, "<f4").reshape(shape)
    weight = np.delete(weight, np.s_[channels : 2 * channels], 1)
    return dtype, weight.shape, weight.tobytes()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    arguments = parser.parse_args()
    metadata, tensors = read_safetensors(arguments.old)
    prefix = "correspondence/" if metadata.get("correspondence/net") == "correspondence" else ""
    net = metadata.get(prefix + "net")
    if net != "correspondence" or not any(name.startswith(prefix + POOLING[0]) for name in tensors):
        raise ConvertError(f"{arguments.old}: found net {net}, expected correspondence with {POOLING[0]}weight")
    kept = {name: tensor for name, tensor in tensors.items() if not name.removeprefix(prefix).startswith(POOLING)}
    for name, behind in READERS.items():
        if prefix + name not in kept:
            raise ConvertError(f"{arguments.old}: found no {prefix + name}, expected one")
        kept[prefix + name] = without_pooled_columns(arguments.old, name, kept[prefix + name], behind)
    write_safetensors(arguments.new, kept, metadata)


if __name__ == "__main__":
    run(main)
