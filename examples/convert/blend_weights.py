#!/usr/bin/env python3
"""Blends two weights of one network: (1 - share) of the first, share of the other.

    blend_weights.py trained.safetensors blended.safetensors --other start.safetensors --share 0.4

Beside a correspondence network alone, the other may be a joined file that holds one (join_body_weights.py).

What a network learnt in a further training, and what it forgot of before, lie about on the line between the two. What the file says
of itself is the first's, without its error. Source: Wortsman et al., "Robust fine-tuning of zero-shot models", CVPR 2022.
"""

import argparse
import os
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("error: this converter needs numpy (Debian: python3-numpy)")

from convert_common import ConvertError, read_floats, run, write_floats

CORRESPONDENCE = "correspondence/"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trained")
    parser.add_argument("blended")
    parser.add_argument("--other", required=True)
    parser.add_argument("--share", type=float, required=True)
    arguments = parser.parse_args()
    if not 0 <= arguments.share <= 1:
        raise ConvertError(f"--share: found {arguments.share}, expected 0 to 1")
    metadata, trained = read_floats(arguments.trained)
    joined = any(name.startswith(CORRESPONDENCE) for name in trained)
    _, other = read_floats(arguments.other, "" if joined else CORRESPONDENCE)
    for name in sorted(trained.keys() | other.keys()):
        found, expected = (t[name].shape if name in t else "nothing" for t in (other, trained))
        if found != expected:
            raise ConvertError(f"{arguments.other}: {name}: found {found}, expected {expected}, as {arguments.trained} has it")
    share = np.float32(arguments.share)
    rest = np.float32(1 - arguments.share)
    blended = {name: share * other[name] + rest * weight for name, weight in trained.items()}
    # Its error was measured before.
    metadata = {key: value for key, value in metadata.items() if not key.startswith("pmd")}
    metadata["blended"] = f"with {arguments.share:g} of {os.path.basename(arguments.other)}"
    write_floats(arguments.blended, blended, metadata)


if __name__ == "__main__":
    run(main)
