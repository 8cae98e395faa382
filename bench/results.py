#!/usr/bin/env python3
"""Measures the numbers that the guides state, and writes them with the machine and the commit that they are of.
usage: bench/results.py [--build FOLDER] [--out FOLDER] [accuracy] [paper] [bodies] [motions] [speed] [size]
  --build FOLDER   a release build with its tests (default: build/release)
  --out FOLDER     where the JSON files go (default: docs/results)
  accuracy         accuracy.json: the sets of tests/accuracy, those of ../shared/data where it is there; two minutes
  paper            paper.json: the paper's protocol, and 200 pairs in natural poses; three minutes
  bodies           bodies.json: bodies of ../shared/data, which npt's template is not, and the template in fresh pairs; 18
                   minutes
  motions          motions.json: clips of ../shared/data on the skeletons of its characters; half a minute
  speed            speed.json: the network, whole transfers, and the program from its start; two minutes
  size             size.json: the program, the weights, and the page where it is built
Without names: all of them. Python's standard library is enough. tests/guides compares the guides' numbers with these
files: `key: accuracy.natural.mean_mm` in a comment names a value of accuracy.json. The last part of a key names the
unit: _mm, _ms, _s, _mb, _percent, or pmd for square metres.
"""

import argparse
import gzip
import itertools
import json
import os
import platform
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def run(*command, cwd=None):
    """What a command prints; with an error it ends the program."""
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"results.py: {' '.join(map(str, command))}: exit status {done.returncode}\n{done.stderr}")
    return done.stdout


def json_of(*command):
    return json.loads(run(*command, "--json"))


def machine_of(npt):
    """The processor, its cores, the compiler and the instruction set, as `npt doctor` says them."""
    doctor = dict(re.findall(r"^(\S.*?) {2,}(\S.*)$", run(npt, "doctor"), re.MULTILINE))
    return {"processor": doctor.get("processor", ""), "threads": int(doctor.get("threads allowed", 0)),
            "instructions": doctor.get("compiled for", ""), "compiler": doctor.get("compiler", ""),
            "system": f"{platform.system()} {platform.machine()}"}


def commit():
    """The commit, with a plus sign where files that git follows differ from it, other than results themselves."""
    try:
        name = run("git", "-C", ROOT, "rev-parse", "--short=12", "HEAD").strip()
        changed = run("git", "-C", ROOT, "status", "--porcelain", "-uno", "--", ".", ":!docs").strip()
        return name + ("+" if changed else "")
    except (OSError, SystemExit):
        return "unknown"


def accuracy(build):
    """Every set's mean, median and worst error of the pairs that are neither wrong nor listed as wrong."""
    # Of animals by length: median and mean PMD in squares of the longest side, and the median of the identity as it is.
    sets = {}
    row = None
    for line in run(build / "bin" / "npt_accuracy", "--table", "--pairs").split("\n"):
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) in (6, 7) and cells[1].isdigit():
            row = cells
            continue
        pair = re.match(r"\s+\S+ mm\s+(?:wrong\s+)?([\w-]+): ", line)
        if pair and pair.group(1) not in sets:
            if len(row) == 6:
                title, pairs, refused, *numbers = row
                median, mean, untouched = (float(f"{number}e-4") for number in numbers)
                sets[pair.group(1)] = {"title": title, "pairs": int(pairs), "refused": int(refused),
                                       "pmd_median": median, "pmd": mean, "pmd_untouched": untouched}
                continue
            title, pairs, wrong, mean, median, worst, pmd = row
            sets[pair.group(1)] = {"title": title, "pairs": int(pairs), "wrong": int(wrong), "mean_mm": float(mean),
                                   "median_mm": float(median), "worst_mm": float(worst),
                                   "pmd": float(f"{pmd}e-4")}
    return "npt_accuracy --table --pairs", sets


def of_set(found):
    """One set of `npt evaluate --json`: root mm of the mean PMD is the RMS over all pairs."""
    return {"pairs": found["pairs"], "rms_mm": round(found["root_mm"], 2),
            "median_mm": round(1000 * found["pmd_median"] ** 0.5, 2),
            "worst_mm": round(1000 * found["pmd_worst"] ** 0.5, 2),
            "pmd": float(f"{found['pmd']:.4g}"), "pmd_worst": float(f"{found['pmd_worst']:.4g}"),
            "pmd_per_coordinate": float(f"{found['pmd_per_coordinate']:.4g}"),
            "edge_percent": round(100 * found["edge_error"], 2)}


def paper(build):
    npt = build / "bin" / "npt"
    pooled = ROOT / "examples" / "weights" / "human-pooled.safetensors"
    values = {}
    for name, arguments in {"body": [], "network": ["--method", "network"],
                            "network_best": ["--method", "network", "--pairings", 8, "--mirror", "--refine"],
                            "pooled": ["--method", "network", "--weights", pooled],
                            "pooled_best": ["--method", "network", "--weights", pooled, "--mirror", "--refine"]}.items():
        seen, unseen = json_of(npt, "evaluate", *arguments)["sets"]
        values[name] = {"seen": of_set(seen), "unseen": of_set(unseen)}
    values["natural"] = of_set(json_of(npt, "evaluate", "--pairs", 200, "--poses", "natural")["sets"][0])
    return "npt evaluate [--method network ...]; npt evaluate --pairs 200 --poses natural", values


def bodies(build):
    """Fresh pairs of bodies: of two other models, where they are there, and of the mannequin."""
    npt = build / "bin" / "npt"
    kinds = {"natural": ["--poses", "natural"], "wide": ["--poses", "wide"],
             "clothes": ["--poses", "natural", "--clothes"], "proportions": ["--poses", "natural", "--proportions"]}
    values = {}
    for name in ("human_6890", "human_13380", "mannequin"):
        file = ROOT.parent / "shared" / "data" / f"{name}.safetensors"
        if name != "mannequin" and not file.is_file():
            print(f"results.py: left out: {name}, for {file} is not there", file=sys.stderr)
            continue
        body = [] if name == "mannequin" else ["--body", file]
        for kind, arguments in kinds.items():
            found = json_of(npt, "evaluate", *body, "--pairs", 60, *arguments)["sets"]
            values.setdefault(name, {})[kind] = of_set(found[0])
        seen, unseen = json_of(npt, "evaluate", *body)["sets"]
        values[name] |= {"seen": of_set(seen), "unseen": of_set(unseen)}
    return "npt evaluate --body BODY --pairs 60 --poses KIND; npt evaluate --body BODY", values


def motion_pairs():
    """By family: pairs of characters whose makers have clips of the same names for both; by source: clips onto others."""
    data = ROOT.parent / "shared" / "data"
    families = {}
    for line in (data / "families.tsv").read_text().splitlines()[1:]:
        file, family = line.split("\t")[:2]
        if file.startswith("characters/humanoids/"):
            families.setdefault(family, []).append(data / file)
    chosen = random.Random(1)
    own = {}
    for family in ("kaykit", "quaternius-2019", "quaternius-animated-characters",
                   "quaternius-space-and-monsters", "rocketbox"):
        # The robot has a rig of its own, and clips of which only the names are those of its family.
        sharing = sorted(file for file in families[family] if file.stem != "qspace_mech_finn")
        pairs = list(itertools.permutations(sharing, 2))
        own[family] = chosen.sample(pairs, min(12, len(pairs)))
    targets = [data / "characters" / "humanoids" / f"{name}.glb" for name in (
        "qmon_bunny", "qmon_orc", "qmon_yeti", "kk_skeleton_mage", "kk_mannequin_medium", "qmen_king", "qwomen_witch",
        "quac_witch", "quac_viking_male")]
    captured = [(clip, target) for clip in sorted((data / "clips").glob("*.bvh")) for target in targets]
    return own, captured


def motions(build):
    """Medians over pairs of the errors over all clips of a pair, and the worst pair's; slides are means."""
    npt = build / "bin" / "npt"
    own, captured = motion_pairs()
    values = {}
    for family, pairs in own.items():
        for kind, arguments in {"plain": ["--plain-motion"], "default": []}.items():
            found = [json_of(npt, "evaluate", "--motion", *pair, *arguments)["all"] for pair in pairs]
            found = [one for one in found if "joint_p95" in one]
            values.setdefault(family.replace("-", "_"), {})[kind] = {
                "pairs": len(found),
                "median_percent": round(100 * statistics.median(one["joint_median"] for one in found), 2),
                "p95_percent": round(100 * statistics.median(one["joint_p95"] for one in found), 2),
                "worst_p95_percent": round(100 * max(one["joint_p95"] for one in found), 2),
                "drawn_percent": round(100 * max(one["truth_drawn_p95"] for one in found), 2)}
    for kind, arguments in {"plain": ["--plain-motion"], "default": []}.items():
        found = [json_of(npt, "evaluate", "--motion", *pair, *arguments)["all"] for pair in captured]
        seconds = sum(one["contact_seconds"] for one in found)
        values.setdefault("captured", {})[kind] = {
            "pairs": len(found),
            **{key: round(sum(one[key] * one["contact_seconds"] for one in found) / seconds, 2)
               for key in ("slide_cm_s", "source_slide_cm_s")},
            "worst_sink_mm": round(10 * max(one["sink_cm"] for one in found), 1),
            "penetration_mm": round(10 * statistics.fmean(one["penetration_cm"] for one in found), 3)}
    return "npt evaluate --motion SOURCE CHARACTER [--plain-motion]", values


def seconds_of(command, cwd, repeats=5):
    """The median time of a process from its start to its end."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        run(*command, cwd=cwd)
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def speed(build):
    npt = build / "bin" / "npt"
    values = {}
    for name, threads in {"one_thread": 1, "all_threads": 0}.items():
        found = json_of(npt, "bench", "forward", "--seed", 1, "--threads", threads)
        values.setdefault("forward", {})[name] = {
            "median_ms": round(1000 * found["seconds_median"], 1), "gflops": found["gflops"],
            "peak_percent": round(100 * found["share"], 1), "peak_memory_mb": found["peak_memory_mb"]}
        transfer = json_of(npt, "bench", "transfer", "--seed", 1, "--threads", threads, "--repeats", 9,
                           "--frames", 20)
        for row in transfer["rows"]:
            kind = "large_" if row["vertices"] > 6890 else ""
            place = values.setdefault(kind + re.sub(r"\W+", "_", row["name"]).removeprefix("a_"), {})
            place = place.setdefault(name, {})
            place["vertices"] = row["vertices"]
            place["median_ms"] = round(1000 * row["seconds_median"], 2)
            for key in row:
                if "memory" in key and isinstance(row[key], (int, float)):
                    place["peak_memory_mb"] = round(row[key], 1)
    with tempfile.TemporaryDirectory() as folder:
        run(ROOT / "examples" / "animate.sh", folder, npt)
        run(npt, "generate", "--out", "identity.obj", "--seed", 3, "--pose", "rest", cwd=folder)
        run(npt, "generate", "--out", "pose.obj", "--seed", 8, "--pose", "natural", cwd=folder)
        jobs = {"transfer_s": "transfer --identity identity.obj --pose pose.obj --out out.obj",
                "clip_s": "transfer --identity character.glb --pose walker.glb --clip walk --fps 24 --out out.glb",
                "rig_s": "rig --mesh identity.obj --out rig.glb"}
        values["program"] = {key: round(seconds_of([npt, *job.split()], folder), 3) for key, job in jobs.items()}
    return "npt bench forward; npt bench transfer; npt transfer, timed from outside", values


def megabytes(path):
    return round(path.stat().st_size / 1e6, 2)


def size(build):
    values = {"program_mb": megabytes(build / "bin" / "npt"), "weights": {}}
    for path in sorted((ROOT / "examples" / "weights").glob("*.safetensors")):
        values["weights"][path.stem.replace("-", "_") + "_mb"] = megabytes(path)
    page = ROOT / "build" / "web" / "page"
    files = [path for path in page.rglob("*") if path.suffix in (".wasm", ".js", ".mjs", ".html", ".css")]
    if files:  # a browser loads the library for one thread or that for several
        for key, other in {"page_gzipped_mb": "-threads", "page_threads_gzipped_mb": "-single"}.items():
            loaded = [path for path in files if other not in path.name]
            values[key] = round(sum(len(gzip.compress(path.read_bytes(), 9)) for path in loaded) / 1e6, 2)
    return "sizes of files", values


def main():
    parts = {"accuracy": accuracy, "paper": paper, "bodies": bodies, "motions": motions, "speed": speed, "size": size}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "release")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "results")
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    names = options.names or list(parts)
    for name in names:
        if name not in parts:
            parser.error(f"{name}: {', '.join(parts)} are known")
    build = options.build.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in names:
        begin = time.monotonic()
        command, values = parts[name](build)
        result = {"command": command, "machine": machine_of(build / "bin" / "npt"), "commit": commit(),
                  "values": values}
        path = options.out / f"{name}.json"
        path.write_text(json.dumps(result, indent=2) + "\n")
        print(f"{path} ({time.monotonic() - begin:.0f} s)", flush=True)


if __name__ == "__main__":
    os.environ.setdefault("LC_ALL", "C")
    main()
