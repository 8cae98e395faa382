#!/usr/bin/env python3
"""Puts body estimation into a weights file, so that one file holds all that a kind of body needs.

    join_body_weights.py network.safetensors human.safetensors --correspondence FILE [--fit-bias FILE]
    join_body_weights.py network.safetensors quadruped.safetensors --correspondence FILE --body FILE [--pose-prior FILE]

network            the pose transfer network, whose tensors come first
--correspondence   the correspondence network: weights of `npt train --net correspondence`, or a joined file
--fit-bias         a file with fit_bias/joints, as npt_fit_bias writes it; or a joined file
--body             the template of another kind than people: a body file with a plan (npt_sculpt), or a joined file
--pose-prior       mean and covariance of its natural poses: pose_prior/mean, pose_prior/covariance; or a joined file

Parts that the network's file has already are replaced. Every tensor keeps its bits, every part its metadata.
"""

import argparse
import os

from convert_common import ConvertError, part, read_safetensors, run, write_safetensors

MOST_BYTES = 12_000_000  # a page loads it


def expect(path, metadata, wanted):
    for key, expected in wanted:
        if metadata.get(key) != expected:
            raise ConvertError(f"{path}: metadata {key}: found {metadata.get(key)!r}, expected {expected!r}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("network")
    parser.add_argument("result")
    parser.add_argument("--correspondence")
    parser.add_argument("--fit-bias")
    parser.add_argument("--body")
    parser.add_argument("--pose-prior")
    parser.add_argument("--any-size", action="store_true", help="allow a result of more than 12 MB")
    arguments = parser.parse_args()
    metadata, tensors = read_safetensors(arguments.network)
    for prefix, path, wanted in (
        ("correspondence/", arguments.correspondence, (("net", "correspondence"),)),
        ("fit_bias/", arguments.fit_bias, ()),
        ("body/", arguments.body, ()),
        ("pose_prior/", arguments.pose_prior, ()),
    ):
        if path is None:
            continue
        own, inside = part(path, prefix, bare=prefix not in ("fit_bias/", "pose_prior/"))
        expect(path, own, wanted)
        if prefix == "body/" and "plan" not in own:
            raise ConvertError(f"{path}: metadata: found no plan, expected a body file of npt_sculpt")
        metadata = {key: text for key, text in metadata.items() if not key.startswith(prefix)}
        tensors = {name: tensor for name, tensor in tensors.items() if not name.startswith(prefix)}
        metadata.update({prefix + key: text for key, text in own.items()})
        tensors.update({prefix + name: tensor for name, tensor in inside.items()})
    size = sum(len(data) for _, _, data in tensors.values())
    if size > MOST_BYTES and not arguments.any_size:
        raise ConvertError(f"{os.fspath(arguments.result)}: found {size} bytes, expected at most {MOST_BYTES}, or --any-size")
    write_safetensors(arguments.result, tensors, metadata)


if __name__ == "__main__":
    run(main)
