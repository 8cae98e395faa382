#!/usr/bin/env python3
"""npt's forward pass beside oneDNN and PyTorch, or its training step beside PyTorch's: processes in turn, npt and a peer as a pair,
medians and ratios.

usage: compare.py [--bench forward|train] [--batch N] [--build FOLDER] [--pairs N] [--repeats N] [--threads N] [--vertices V] [--bottleneck B]
                  [--peer onednn|torch|torch-eager]... [--precision fp32|bf16] [--json]

Machines drift: a process that runs now and one that runs a minute later see other clocks and other neighbours. So npt and a
peer run right after each other, in alternating order, and the ratio of a pair is what counts. All read or make the same random
network; each peer's result is compared with npt's double result before it is timed (a wrong one ends the comparison), and
`npt bench` verifies its own.

Needs a build with -DNPT_BUILD_BENCHMARKS=ON and Python 3; for oneDNN libdnnl-dev, for PyTorch Debian's python3-torch.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent

# What was found to be fastest for Debian's PyTorch 1.13 (OpenBLAS picks its Haswell kernels on processors that it doesn't know, and
# glibc returns each large block to the system when it is freed).
tuned = {
    "OPENBLAS_CORETYPE": "SkylakeX",
    "MALLOC_MMAP_THRESHOLD_": "4294967296",
    "MALLOC_TRIM_THRESHOLD_": "4294967296",
    "MALLOC_TOP_PAD_": "67108864",
    "OMP_WAIT_POLICY": "passive",
}


def has_avx512():
    try:
        return "avx512f" in pathlib.Path("/proc/cpuinfo").read_text()
    except OSError:
        return False


def run(command, environment=None):
    """The JSON that a process prints last."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        sys.exit(f"compare.py: failed: {' '.join(str(c) for c in command)}\n{done.stderr or done.stdout}")
    return json.loads(done.stdout.strip().splitlines()[-1])


class Comparison:
    def __init__(self, arguments, case):
        self.arguments = arguments
        self.case = case
        self.bin = arguments.build / "bin"

    def npt(self):
        a = self.arguments
        if a.bench == "train":
            return run([self.bin / "npt", "bench", "train", "--vertices", a.vertices, "--bottleneck", a.bottleneck, "--batch",
                        a.batch, "--threads", a.threads, "--precision", a.precision, "--repeats", a.repeats, "--seed", a.seed,
                        "--json"])
        return run([self.bin / "npt", "bench", "forward", "--vertices", a.vertices, "--bottleneck", a.bottleneck, "--threads",
                    a.threads, "--precision", a.precision, "--repeats", a.repeats, "--seed", a.seed, "--json"])

    def peer(self, name):
        a = self.arguments
        tail = [self.case, "--threads", a.threads, "--repeats", a.repeats]
        environment = dict(os.environ, OMP_NUM_THREADS=str(a.threads))
        if name == "onednn":
            return run([self.bin / "bench_peer_onednn"] + tail, environment)
        environment["OPENBLAS_NUM_THREADS"] = str(a.threads)  # torch.set_num_threads doesn't reach it
        environment.update({k: v for k, v in tuned.items() if k != "OPENBLAS_CORETYPE" or has_avx512()})
        if a.bench == "train":
            return run([a.python, here / "torch_step.py", "--vertices", a.vertices, "--bottleneck", a.bottleneck, "--batch", a.batch,
                        "--threads", a.threads, "--repeats", a.repeats, "--seed", a.seed], environment)
        mode = "eager" if name == "torch-eager" else "traced"
        return run([a.python, here / "torch_net.py"] + tail + ["--mode", mode], environment)

    def pairs(self, name):
        """The results of interleaved pairs, npt first and the peer first in turn."""
        results = []
        for i in range(self.arguments.pairs):
            if i % 2 == 0:
                ours = self.npt()
                theirs = self.peer(name)
            else:
                theirs = self.peer(name)
                ours = self.npt()
            results.append((ours, theirs))
        return results


def summary(name, results):
    ours = [o["seconds_median"] for o, _ in results]
    theirs = [t["seconds_median"] for _, t in results]
    ratios = sorted(t / o for o, t in zip(ours, theirs))
    return {"peer": results[0][1]["peer"], "name": name, "pairs": len(results),
            "npt_seconds": round(statistics.median(ours), 5), "peer_seconds": round(statistics.median(theirs), 5),
            "npt_share_of_peak": round(statistics.median(o["share"] for o, _ in results), 3),
            "ratio_median": round(statistics.median(ratios), 3), "ratio_low": round(ratios[0], 3),
            "ratio_high": round(ratios[-1], 3), "npt_error": results[0][0].get("error", results[0][0].get("gradient_error")),
            "peer_error": results[0][1]["error"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=here.parent.parent / "build" / "release",
                        help="build folder (default: build/release)")
    parser.add_argument("--bench", choices=("forward", "train"), default="forward")
    parser.add_argument("--batch", type=int, default=8, help="pairs in a training step")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=7, help="timed runs of each process")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--vertices", type=int, default=6890)
    parser.add_argument("--bottleneck", type=int, choices=(1024, 256, 128), default=1024)
    parser.add_argument("--precision", choices=("auto", "fp32", "bf16"), default="auto",
                        help="npt's (auto: fp32's error by the fastest unit); the peers are fp32")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--peer", action="append", choices=("onednn", "torch", "torch-eager"),
                        help="default: onednn and torch")
    parser.add_argument("--python", default="/usr/bin/python3", help="a Python that has torch and numpy")
    parser.add_argument("--json", action="store_true", help="one line of JSON, last")
    arguments = parser.parse_args()
    for name in ("pairs", "repeats", "threads", "vertices", "batch"):
        if getattr(arguments, name) < 1:
            parser.error(f"--{name} must be at least 1")
    training = arguments.bench == "train"
    peers = arguments.peer or (["torch"] if training else ["onednn", "torch"])
    if training and (peers != ["torch"] or arguments.precision == "bf16"):
        parser.error("--bench train has one peer, torch, and no precision bf16")
    needed = ["npt"] + ([] if training else ["bench_make_case"]) + (["bench_peer_onednn"] if "onednn" in peers else [])
    missing = [n for n in needed if not (arguments.build / "bin" / n).exists()]
    if missing:
        sys.exit(f"compare.py: {arguments.build / 'bin'}: no {', '.join(missing)}: build with -DNPT_BUILD_BENCHMARKS=ON "
                 "(and libdnnl-dev for bench_peer_onednn), or name the folder with --build")

    with tempfile.TemporaryDirectory() as folder:
        case = pathlib.Path(folder) / "case.safetensors"
        if not training:
            made = subprocess.run([str(arguments.build / "bin" / "bench_make_case"), str(case), "--bottleneck",
                                   str(arguments.bottleneck), "--vertices", str(arguments.vertices), "--seed",
                                   str(arguments.seed)])
            if made.returncode != 0:
                sys.exit("compare.py: bench_make_case failed")
        comparison = Comparison(arguments, case)
        what = f"training step, batch {arguments.batch}" if training else "forward"
        print(f"{what}, bottleneck {arguments.bottleneck}, {arguments.vertices} vertices, {arguments.threads} threads, npt "
              f"{arguments.precision}, {arguments.pairs} pairs of processes, median of {arguments.repeats} runs each")
        print(f"{'peer':28} {'npt s':>9} {'peer s':>9} {'peer/npt':>9} {'low':>7} {'high':>7} {'npt of peak':>12} {'peer error':>11}",
              flush=True)
        results = []
        for name in peers:
            r = summary(name, comparison.pairs(name))
            results.append(r)
            print(f"{r['peer']:28} {r['npt_seconds']:9.4f} {r['peer_seconds']:9.4f} {r['ratio_median']:9.2f} {r['ratio_low']:7.2f} "
                  f"{r['ratio_high']:7.2f} {100 * r['npt_share_of_peak']:10.1f} % {r['peer_error']:11.1e}", flush=True)
    if arguments.json:
        print(json.dumps({"bench": arguments.bench, "bottleneck": arguments.bottleneck, "vertices": arguments.vertices, "threads": arguments.threads,
                          "precision": arguments.precision, "peers": results}))


if __name__ == "__main__":
    main()
