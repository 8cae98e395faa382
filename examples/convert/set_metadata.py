#!/usr/bin/env python3
"""Changes what a safetensors file has as metadata; its tensors stay as they are.

    set_metadata.py trained.safetensors quadruped.safetensors refine_radius=0.08 domain=quadruped seed=

KEY=VALUE adds or replaces a text, KEY= takes it out. What npt reads of weights: docs/training.md.
"""

import argparse

from convert_common import ConvertError, read_safetensors, run, write_safetensors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source")
    parser.add_argument("result")
    parser.add_argument("texts", nargs="+", metavar="KEY=VALUE")
    arguments = parser.parse_args()
    metadata, tensors = read_safetensors(arguments.source)
    for text in arguments.texts:
        key, equals, value = text.partition("=")
        if not key or not equals:
            raise ConvertError(f"found '{text}', expected KEY=VALUE, or KEY= to take it out")
        if value:
            metadata[key] = value
        elif metadata.pop(key, None) is None:
            raise ConvertError(f"{arguments.source}: metadata {key}: found nothing to take out")
    write_safetensors(arguments.result, tensors, metadata)


if __name__ == "__main__":
    run(main)
