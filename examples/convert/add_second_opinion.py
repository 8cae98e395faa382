#!/usr/bin/env python3
"""Puts a pose transfer network into a reader's file: the way through bodies asks it for a second opinion.

    add_second_opinion.py reader.safetensors human.safetensors --network human-pooled.safetensors

The network: bottleneck 256, pooled feature. One that is there is replaced; without --network it is taken out.
"""

import argparse

from convert_common import ConvertError, read_safetensors, run, write_safetensors

PREFIX = "second_opinion/"
KEPT = ("bottleneck", "feature", "order", "output_scale", "normalisation", "command", "trained_on", "pmd", "pmd_on")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reader")
    parser.add_argument("result")
    parser.add_argument("--network")
    arguments = parser.parse_args()
    metadata, tensors = read_safetensors(arguments.reader)
    if metadata.get("net") != "reader":
        raise ConvertError(f"{arguments.reader}: metadata net: found {metadata.get('net')!r}, expected 'reader'")
    metadata = {key: text for key, text in metadata.items() if not key.startswith(PREFIX)}
    tensors = {name: tensor for name, tensor in tensors.items() if not name.startswith(PREFIX)}
    if arguments.network:
        own, network = read_safetensors(arguments.network)
        for key, expected in (("bottleneck", "256"), ("feature", "pooled"), ("order", "conv_relu")):
            if own.get(key) != expected:
                raise ConvertError(f"{arguments.network}: metadata {key}: found {own.get(key)!r}, expected {expected!r}")
        metadata.update({PREFIX + key: own[key] for key in KEPT if key in own})
        tensors.update({PREFIX + name: tensor for name, tensor in network.items()})
    write_safetensors(arguments.result, tensors, metadata)


if __name__ == "__main__":
    run(main)
