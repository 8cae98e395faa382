#!/usr/bin/env python3
"""What npt costs a compiler, from headers only and with npt::compiled: the umbrella header, a unit with one network,
and the program of the README's "In your application", at -O2. Needs only Python 3.

usage: measure.py [--include FOLDER] [--compiler NAME]... [--repeats N] [--json]
  --include   the folder with npt/npt.hpp (default: this repository's)
  --compiler  default: those of g++ and clang++ that are installed
  --repeats   runs of each; the shortest counts (default 3)
"""
import argparse
import json
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent
modes = {"headers": [], "compiled": ["-DNPT_COMPILED"]}


def seconds(command):
    """Processor time of a command: on a busy machine the clock on the wall says more about the others."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit("measure.py: failed: " + " ".join(command) + "\n" + done.stderr)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def object_size(path):
    """Bytes of code and constants, which end up in the program."""
    if not shutil.which("size"):
        return 0
    fields = subprocess.run(["size", path], capture_output=True, text=True, check=True).stdout.splitlines()[1].split()
    return sum(int(f) for f in fields[:3])


def units(folder):
    """The units by name. The README's program is the first block of C++ below its heading."""
    readme = (here.parent.parent / "README.md").read_text()
    program = re.search(r"^## In your application$.*?^```cpp\n(.*?)^```$", readme, re.M | re.S)
    if not program:
        sys.exit("measure.py: README.md: no program below 'In your application'")
    application = folder / "application.cpp"
    application.write_text(program[1])
    return {"umbrella": here / "umbrella.cpp", "network": here / "network.cpp", "application": application}


def measure(compiler, include, repeats):
    # -isystem for what is not npt's would change nothing in time, so the default search path is used for it.
    base = [compiler, "-std=c++20", "-march=native", "-O2", "-I", str(include), "-c"]
    results = []
    with tempfile.TemporaryDirectory() as folder:
        target = str(pathlib.Path(folder) / "unit.o")
        for unit, source in units(pathlib.Path(folder)).items():
            for mode, flags in modes.items():
                times = [seconds([*base, *flags, str(source), "-o", target]) for _ in range(repeats)]
                results.append({"compiler": compiler, "unit": unit, "mode": mode, "seconds": round(min(times), 3),
                                "code_bytes": object_size(target)})
    return results


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
    results = [r for c in compilers for r in measure(c, arguments.include, arguments.repeats)]
    if arguments.json:
        print(json.dumps(results))
        return
    print(f"{'compiler':12} {'unit':12} {'mode':9} {'time':>8} {'code':>9}")
    for r in results:
        print(f"{r['compiler']:12} {r['unit']:12} {r['mode']:9} {r['seconds']:>6.2f} s "
              f"{r['code_bytes'] / 1024:>6.0f} KB")


if __name__ == "__main__":
    main()
