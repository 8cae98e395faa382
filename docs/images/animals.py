#!/usr/bin/env python3
"""Makes the pictures of four-legged animals in docs/gallery.md: animals-real.webp, animals-template.webp and the film
animals-gallop.webp. Needs the built program and Debian's package webp (cmake/install-dependencies.sh --docs).
usage: docs/images/animals.py DATA [OUT] [PROGRAM]
  DATA      folder with the files that are named below; CREDITS.md says whose they are; they are no part of npt
  OUT       folder for the pictures (default: this one)
  PROGRAM   npt (default build/release/bin/npt)
It prints the confidence of every result. WRONG names what the eye finds wrong: look at the pictures, and bring it up to
date, when the estimation has changed."""

import json
import struct
import subprocess
import sys
import tempfile
from array import array
from pathlib import Path

HERE = Path(__file__).resolve().parent
CREATURES = "characters/creatures/"
# Every four-legged mesh. *: its species was in no training as an animal.
ANIMALS = {
    "alpaca": "glb/Alpaca.glb", "cow": "glb/Cow.glb", "deer *": "glb/Deer.glb", "donkey": "glb/Donkey.glb",
    "fox": "glb/Fox.glb", "horse": "glb/Horse.glb", "husky": "glb/Husky.glb",
    "cat": CREATURES + "q2017_cat.fbx", "dog": CREATURES + "q2017_dog.fbx", "llama": CREATURES + "qfarm_llama.fbx",
    "pig": CREATURES + "qfarm_pig.fbx", "pug *": CREATURES + "qfarm_pug.fbx", "sheep": CREATURES + "qfarm_sheep.fbx",
    "zebra *": CREATURES + "qfarm_zebra.fbx", "apatosaurus": CREATURES + "qdino_apatosaurus.glb",
    "stegosaurus *": CREATURES + "qdino_stegosaurus.glb", "triceratops *": CREATURES + "qdino_triceratops.glb",
    "cube elephant *": CREATURES + "kenney_cubepet_elephant.glb",
    "cube giraffe *": CREATURES + "kenney_cubepet_giraffe.glb",
}
# Moments of clips, of files with labelled poses.
POSES = {"gallop": ("Horse", "Gallop_03"), "crouch": ("Fox", "Attack_04"), "head down": ("Horse", "Attack_Headbutt_02")}
WRONG = {("alpaca", "head down"), ("deer *", "head down"), ("llama", "head down"), ("husky", "head down"),
         ("apatosaurus", "crouch"), ("apatosaurus", "head down"), ("template 4", "crouch")}
TONE = "#cbccca"  # behind captions, which are dark: bearable on light pages and on dark ones
WIDTH, HEIGHT, CAPTION = 84, 78, 22
BODIES = 20
# The template's own eight shapes, and deviations of the plan's proportions: short neck, large head and ears, thick legs.
ELEPHANT = "0,0,0,0,0,0,0,0,0,-0.5,2.5,2.5,-1.3,2.5,2.4,-1,4,-1,-1,-0.4,3.6,0,0,2"


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"animals.py: {' '.join(map(str, command))}: {done.stderr.strip()}")
    return done.stdout


def write_labelled(file, label, out):
    """A mesh of a file with labelled poses as OBJ (docs/formats.md#families)."""
    data = file.read_bytes()
    start = 8 + struct.unpack_from("<Q", data)[0]
    header = json.loads(data[8:start])
    vertices = header["poses"]["shape"][1]
    at = start + header["poses"]["data_offsets"][0]
    at += 12 * vertices * header["__metadata__"]["labels"].split().index(label)
    places, corners = array("f"), array("i")
    places.frombytes(data[at:at + 12 * vertices])
    corners.frombytes(data[start + header["f"]["data_offsets"][0]:start + header["f"]["data_offsets"][1]])
    with out.open("w") as text:
        for i in range(0, len(places), 3):
            text.write("v {:.6g} {:.6g} {:.6g}\n".format(*places[i:i + 3]))
        for i in range(0, len(corners), 3):
            text.write("f {} {} {}\n".format(*(corner + 1 for corner in corners[i:i + 3])))


class Gallery:
    def __init__(self, data, out, npt, work):
        self.data, self.out, self.npt, self.work = data, out, npt, work
        self.weights = HERE.parents[1] / "examples" / "weights" / "quadruped.safetensors"
        self.poses = {}
        for name, (animal, label) in POSES.items():
            self.poses[name] = work / f"pose-{name.replace(' ', '-')}.obj"
            write_labelled(data / "animals" / f"{animal}.safetensors", label, self.poses[name])

    def drawn(self, meshes, colours, captions, name):
        """A row of meshes at one scale; its picture."""
        picture = self.work / f"row-{name}.png"
        run(self.npt, "render", *meshes, "--colours", ",".join(colours), "--captions", ",".join(captions), "--view", "side",
            "--samples", 3, "--width", WIDTH, "--height", HEIGHT, "--background", TONE, "--out", picture)
        return picture

    def transferred(self, animals, folder):
        """Every animal in every pose: {(animal, pose): (file or None, confidence)}"""
        (self.work / folder).mkdir()
        pairs = [(name, pose, self.work / folder / f"{i:02}-{pose.replace(' ', '-')}.ply")
                 for i, name in enumerate(animals) for pose in self.poses]
        listing, report = self.work / f"{folder}.txt", self.work / f"{folder}.jsonl"
        listing.write_text("".join(f'"{animals[name]}" "{self.poses[pose]}" "{out}"\n' for name, pose, out in pairs))
        subprocess.run([self.npt, "transfer", "--pairs", listing, "--keep-going", "--report", report],
                       capture_output=True, check=False)
        made = {json.loads(line)["out"]: json.loads(line) for line in report.read_text().splitlines()}
        results = {}
        for name, pose, out in pairs:
            line = made[str(out)]
            done = line["status"] == "done" and line.get("kind") == "four-legged animal"
            results[name, pose] = (out if done else None, line.get("confidence"))
            print(f"{name}, {pose}: " + (f"{line['confidence']:.0%}" if done else line.get("error", "refused")))
        return results

    def gallery(self, animals, picture):
        results, rows = self.transferred(animals, picture), []
        for name, file in animals.items():
            meshes, colours, captions = [file], ["blue"], [name]
            for pose in self.poses:
                made, confidence = results[name, pose]
                meshes.append(made or "-")
                colours.append("blue" if made else "-")
                wrong = " wrong" if (name, pose) in WRONG else ""
                captions.append(f"{confidence:.0%}{wrong}".replace("%", " %") if made else "refused")
            rows.append(self.drawn(meshes, colours, captions, f"{picture}-{len(rows)}"))
        # The pose meshes stand above the columns.
        head = self.drawn(["-", *self.poses.values()], ["-"] + 3 * ["sand"], ["", *self.poses], f"{picture}-head")
        columns = 3
        rows = columns * [head] + rows
        png = self.work / f"{picture}.png"
        run(self.npt, "render", *rows, "--columns", columns, "--width", 4 * WIDTH, "--height", HEIGHT + CAPTION, "--gap", 4,
            "--background", TONE, "--out", png)
        self.webp(png, picture)

    def webp(self, png, picture):
        out = self.out / f"{picture}.webp"
        run("cwebp", "-quiet", "-q", 80, "-m", 6, png, "-o", out)
        print(f"{out}: {out.stat().st_size} bytes")

    def bodies(self):
        """Bodies of the template: random proportions, at rest."""
        run(self.npt, "generate", "--body", self.weights, "--proportions", "--pose", "rest", "--count", BODIES, "--seed", 1,
            "--out", self.work / "bodies")
        return {f"template {i + 1}": self.work / "bodies" / f"body_{i:04}.ply" for i in range(BODIES)}

    def film(self):
        """A horse's gallop on three other animals."""
        elephant = self.work / "elephant.ply"
        run(self.npt, "generate", "--body", self.weights, "--shape", ELEPHANT, "--pose", "rest", "--out", elephant)
        horse = self.data / "glb/Horse.glb"
        width, height, strips = 190, 150, []
        takers = [horse, self.data / CREATURES / "qfarm_llama.fbx", self.data / CREATURES / "q2017_cat.fbx", elephant]
        for i, taker in enumerate(takers):
            frames = self.work / f"film-{i}"
            print(run(self.npt, "transfer", "--identity", taker, "--pose", horse, "--clip", "AnimalArmature|Gallop", "--fps", 24,
                      "--format", "ply", "--out", frames).strip())
            meshes = sorted(frames.glob("*.ply"))[:-1]  # the last one is the first again
            strips.append(self.work / f"strip-{i}.png")
            run(self.npt, "render", *meshes, "--columns", 1, "--width", width, "--height", height, "--view", "side", "--samples", 3,
                "--colours", ",".join(len(meshes) * ["sand" if i == 0 else "blue"]), "--background", TONE, "--out", strips[-1])
        count = len(meshes)
        sheet = self.work / "sheet.png"
        run(self.npt, "render", *strips, "--columns", len(strips), "--width", width, "--height", count * height,
            "--background", TONE, "--out", sheet)
        frames = []
        for i in range(count):
            frames.append(self.work / f"film-{i:03}.webp")
            run("cwebp", "-quiet", "-lossless", "-z", 1, "-crop", 0, i * height, len(strips) * width, height, sheet, "-o", frames[-1])
        out = self.out / "animals-gallop.webp"
        run("img2webp", "-loop", 0, "-lossy", "-q", 70, "-m", 6, "-d", 42, *frames, "-o", out)
        print(f"{out}: {count} frames, {out.stat().st_size} bytes")


def main(arguments):
    if not 1 <= len(arguments) <= 3 or arguments[0].startswith("-"):
        print(__doc__)
        return 0 if arguments[:1] in (["-h"], ["--help"]) else 2
    data = Path(arguments[0]).resolve()
    out = Path(arguments[1]).resolve() if len(arguments) > 1 else HERE
    npt = Path(arguments[2] if len(arguments) > 2 else HERE.parents[1] / "build/release/bin/npt").resolve()
    animals = {name: data / file for name, file in ANIMALS.items()}
    for file in [*animals.values(), *(data / "animals" / f"{animal}.safetensors" for animal, _ in POSES.values())]:
        if not file.is_file():
            sys.exit(f"animals.py: {file}: found no such file, expected one that CREDITS.md names")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        gallery = Gallery(data, out, npt, Path(work))
        gallery.gallery(animals, "animals-real")
        gallery.gallery(gallery.bodies(), "animals-template")
        gallery.film()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
