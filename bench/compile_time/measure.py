#!/usr/bin/env python3
"""What npt's headers cost a compiler: parsing the umbrella, and a unit with one network at -O2. Needs only Python 3.

usage: measure.py [--include FOLDER] [--compiler NAME]... [--repeats N] [--json]
  --include   the folder with npt/npt.hpp (default: this repository's)
  --compiler  default: those of g++ and clang++ that are installed
  --repeats   runs of each; the shortest counts (default 3)
"""
import argparse
import json
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent


def seconds(command):
    """Processor time of a command: on a busy machine the clock on the wall says more about the others."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit("measure.py: failed: " + " ".join(command) + "\n" + done.stderr)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def object_size(path):
    """Bytes of code and constants, which end up in the program, and of the whole file."""
    sections = 0
    if shutil.which("size"):
        fields = subprocess.run(["size", path], capture_output=True, text=True, check=True).stdout.splitlines()[1].split()
        sections = sum(int(f) for f in fields[:3])
    return sections, pathlib.Path(path).stat().st_size


def measure(compiler, include, repeats):
    # -isystem for what is not npt's would change nothing in time, so the default search path is used for it.
    base = [compiler, "-std=c++20", "-march=native", "-I", str(include)]
    with tempfile.TemporaryDirectory() as folder:
        target = str(pathlib.Path(folder) / "network.o")
        parse = min(seconds(base + ["-fsyntax-only", str(here / "umbrella.cpp")]) for _ in range(repeats))
        compiled = min(seconds(base + ["-O2", "-c", str(here / "network.cpp"), "-o", target]) for _ in range(repeats))
        code, whole = object_size(target)
    return {"compiler": compiler, "umbrella_parse_seconds": round(parse, 3), "network_compile_seconds": round(compiled, 3),
            "object_code_bytes": code, "object_file_bytes": whole}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--include", type=pathlib.Path, default=here.parent.parent / "include")
    parser.add_argument("--compiler", action="append")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true", help="one line of JSON")
    arguments = parser.parse_args()
    if arguments.repeats < 1:
        parser.error("--repeats must be at least 1")
    if not (arguments.include / "npt" / "npt.hpp").exists():
        parser.error(f"{arguments.include}: no npt/npt.hpp in this folder")
    compilers = arguments.compiler or [c for c in ("g++", "clang++") if shutil.which(c)]
    if not compilers:
        sys.exit("measure.py: neither g++ nor clang++ is installed")
    results = [measure(c, arguments.include, arguments.repeats) for c in compilers]
    if arguments.json:
        print(json.dumps(results))
        return
    print(f"{'compiler':12} {'parse npt.hpp':>14} {'one network -O2':>16} {'code':>10} {'object':>10}")
    for r in results:
        print(f"{r['compiler']:12} {r['umbrella_parse_seconds']:>12.2f} s {r['network_compile_seconds']:>14.2f} s "
              f"{r['object_code_bytes'] / 1024:>7.0f} KB {r['object_file_bytes'] / 1024:>7.0f} KB")


if __name__ == "__main__":
    main()
