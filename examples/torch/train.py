#!/usr/bin/env python3
"""Trains the network with PyTorch, for those who have a GPU: the samples, the losses and the optimiser of `npt train`, weights that
npt loads.

    python3 examples/torch/train.py --body human_6890.safetensors=2 --body human_13380.safetensors --bottleneck 512 \\
        --device cuda --minutes 25 --out human.safetensors
    npt evaluate --weights human.safetensors --body human_6890.safetensors --protocol

Every step draws fresh shapes (standard normal) and poses (Table 6 of the paper; --wide-poses: wider ranges), poses the whole bodies on the
device, centres them by their bounding boxes and takes random vertices of each, pose and identity independently shuffled. Matrices between
layers learn by Muon, the rest by Adam; rates rise over 2 % of the course and fall along a cosine to 2 %.

Beside OUT it leaves OUT.checkpoint.pt, from which --resume goes on. Needs numpy and PyTorch 1.13 or newer; bodies are safetensors
files in SMPL's layout (docs/formats.md; `npt generate --pose rest` has the mannequin as a mesh, not as a body).
"""

import argparse
import json
import math
import os
import struct
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

EPSILON = 1e-5  # of the instance norm

# Ranges in degrees of the three axis-angle components of SMPL's 24 joints; joints are numbered from 1 as in the paper.
PAPER = {(1,): ((-2, 2),) * 3, (2,): ((-90, 0), (0, 0), (0, 40)), (3,): ((-90, 0), (0, 0), (-40, 0)),
         (4, 7, 10, 11, 12): ((-1, 1),) * 3, (5, 6): ((0, 100), (0, 0), (0, 0)), (8, 9): ((-10, 10), (-10, 10), (-1, 1)),
         (13, 16): ((-3, 3),) * 3, (14, 15, 17, 18): ((0, 0), (-30, 30), (-30, 30)), (19,): ((0, 0), (-60, 0), (0, 0)),
         (20,): ((0, 0), (0, 60), (0, 0)), (21, 22): ((-10, 10), (-10, 10), (-1, 1)),
         (23,): ((-5, 5), (0, 10), (-10, 0)), (24,): ((-5, 5), (-10, 0), (0, 10))}
# npt::wide_pose_ranges. Left joints; the right one, with the next number, is the mirror image.
WIDE = {(1,): ((-20, 35), (-20, 20), (-15, 15)), (4, 7, 10): ((-8, 20), (-12, 12), (-10, 10)),
        (13, 16): ((-20, 20), (-25, 25), (-12, 12))}
WIDE_BOTH = {2: ((-110, 35), (-25, 25), (-15, 45)), 5: ((0, 130), (-5, 5), (-5, 5)), 8: ((-35, 30), (-20, 20), (-10, 10)),
             11: ((-30, 10), (-2, 2), (-2, 2)), 14: ((-5, 5), (-20, 20), (-25, 20)), 17: ((-45, 45), (-75, 40), (-80, 50)),
             19: ((-20, 20), (-135, 0), (-10, 10)), 21: ((-30, 30), (-20, 20), (-30, 30)), 23: ((-5, 5), (-10, 10), (-20, 5))}


def pose_ranges(wide):
    """[24, 3, 2] in radians."""
    table = np.zeros((24, 3, 2))
    for joints, ranges in (WIDE if wide else PAPER).items():
        for joint in joints:
            table[joint - 1] = ranges
    if wide:
        for left, (x, y, z) in WIDE_BOTH.items():
            table[left - 1] = (x, y, z)
            table[left] = (x, (-y[1], -y[0]), (-z[1], -z[0]))
    return np.radians(table)


def fail(message):
    sys.exit(f"train.py: error: {message}")


# --- files ---------------------------------------------------------------------------------------------------------------------

def load_safetensors(path):
    try:
        with open(path, "rb") as file:
            data = file.read()
        size = struct.unpack("<Q", data[:8])[0]
        head = json.loads(data[8:8 + size])
    except (OSError, struct.error, ValueError) as error:
        fail(f"{path}: {error}")
    kinds = {"F32": np.float32, "F64": np.float64, "I32": np.int32, "I64": np.int64}
    tensors = {}
    for name, entry in head.items():
        if name == "__metadata__":
            continue
        begin, end = entry["data_offsets"]
        if entry["dtype"] not in kinds:
            fail(f"{path}: {name}: found {entry['dtype']}, expected one of {', '.join(kinds)}")
        if 8 + size + end > len(data):
            fail(f"{path}: {name}: found the end of the file, expected {end - begin} bytes")
        values = np.frombuffer(data, kinds[entry["dtype"]], offset=8 + size + begin, count=-1 if end == begin else
                               (end - begin) // np.dtype(kinds[entry["dtype"]]).itemsize)
        tensors[name] = values.reshape(entry["shape"])
    return tensors, head.get("__metadata__", {})


def save_safetensors(path, tensors, metadata):
    """The file appears under its name only when it is complete."""
    head, blobs, offset = {"__metadata__": {k: str(v) for k, v in metadata.items()}}, [], 0
    for name, tensor in tensors.items():
        blob = np.ascontiguousarray(tensor.detach().float().cpu().numpy()).tobytes()
        head[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [offset, offset + len(blob)]}
        offset += len(blob)
        blobs.append(blob)
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    with open(path + ".part", "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + b"".join(blobs))
    os.replace(path + ".part", path)


# --- samples -------------------------------------------------------------------------------------------------------------------

class Body:
    """A body in SMPL's layout on a device."""

    def __init__(self, path, device):
        tensors, _ = load_safetensors(path)
        for name in ("v_template", "shapedirs", "J_regressor", "weights", "parents"):
            if name not in tensors:
                fail(f"{path}: found no tensor {name}, expected a body in SMPL's layout")
        if len(tensors["parents"]) != 24:
            fail(f"{path}: found {len(tensors['parents'])} joints, expected SMPL's 24")
        if "posedirs" in tensors:
            fail(f"{path}: found posedirs, which this script leaves out: expected a body without them")
        self.name = os.path.splitext(os.path.basename(path))[0]
        get = {k: torch.from_numpy(np.array(v)).to(device) for k, v in tensors.items()}
        self.rest, self.shapes, self.weights = get["v_template"], get["shapedirs"], get["weights"]
        self.parents = [int(p) for p in tensors["parents"]]
        self.joints = get["J_regressor"] @ self.rest
        self.joint_shapes = torch.einsum("jv,vck->jck", get["J_regressor"], self.shapes)
        self.vertex_count, self.shape_count = self.shapes.shape[0], self.shapes.shape[2]

    def posed(self, betas, angles):
        """betas [n, K], angles [n, 24, 3] -> [n, V, 3]"""
        rest = self.rest + torch.einsum("vck,nk->nvc", self.shapes, betas)
        joints = self.joints + torch.einsum("jck,nk->njc", self.joint_shapes, betas)
        turns, rotations, places = rotation_matrices(angles), [], []
        for j, parent in enumerate(self.parents):
            if parent < 0 or parent == j:
                rotations.append(turns[:, j])
                places.append(joints[:, j])
            else:
                rotations.append(rotations[parent] @ turns[:, j])
                offset = (joints[:, j] - joints[:, parent])[..., None]
                places.append((rotations[parent] @ offset)[..., 0] + places[parent])
        rotation, place = torch.stack(rotations, 1), torch.stack(places, 1)
        moved = place - (rotation @ joints[..., None])[..., 0]
        matrix = torch.cat([rotation, moved[..., None]], 3).flatten(2)                 # [n, 24, 12]
        blended = torch.einsum("vj,njm->nvm", self.weights, matrix).unflatten(2, (3, 4))
        return torch.einsum("nvab,nvb->nva", blended[..., :3], rest) + blended[..., 3]


def rotation_matrices(angles):
    length = angles.norm(dim=-1, keepdim=True).clamp_min(1e-9)
    x, y, z = (angles / length).unbind(-1)
    zero = torch.zeros_like(x)
    cross = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).unflatten(-1, (3, 3))
    sine, cosine = torch.sin(length)[..., None], torch.cos(length)[..., None]
    return torch.eye(3, device=angles.device) + sine * cross + (1 - cosine) * (cross @ cross)


class Sampler:
    def __init__(self, bodies, shares, options, seed, device):
        self.bodies, self.options, self.device = bodies, options, device
        self.shares = np.cumsum(shares) / np.sum(shares)
        self.choose = np.random.default_rng(seed)
        self.random = torch.Generator(device=device).manual_seed(seed)
        self.ranges = [torch.from_numpy(pose_ranges(wide)).float().to(device) for wide in (False, True)]

    def uniform(self, *shape):
        return torch.rand(*shape, generator=self.random, device=self.device)

    def poses(self, n):
        draw = self.uniform(n, 24, 3)
        pose = [r[..., 0] + (r[..., 1] - r[..., 0]) * draw for r in self.ranges]
        wide = self.uniform(n, 1, 1) < self.options.wide_poses
        return torch.where(wide, pose[1], pose[0])

    def shapes(self, n, body):
        return torch.randn(n, body.shape_count, generator=self.random, device=self.device)

    def rows(self, n, total, count):
        """[n, count] indices without repeats, in random order."""
        return self.uniform(n, total).argsort(1)[:, :count]

    def draw(self, batch, vertices):
        """pose, identity, truth: [batch, vertices, 3] each. vertices 0: all, of the first body's count."""
        parts = []
        picks = np.minimum(np.searchsorted(self.shares, self.choose.random(batch)), len(self.bodies) - 1)
        if vertices == 0:
            picks[:] = picks[0]  # one vertex count in a batch
        for index, body in enumerate(self.bodies):
            n = int((picks == index).sum())
            if n:
                parts.append(self.of_body(n, body, vertices or body.vertex_count))
        return [torch.cat(part) for part in zip(*parts)]

    def of_body(self, n, body, vertices):
        shape, pose = self.shapes(n, body), self.poses(n)
        meshes = [body.posed(self.shapes(n, body), pose), body.posed(shape, self.poses(n)), body.posed(shape, pose)]
        if self.options.yaw > 0:
            turns = [(2 * self.uniform(n) - 1) * math.radians(self.options.yaw) for _ in range(2)]
            turns.append(turns[0])  # the truth faces where the pose mesh does
            meshes = [turned(mesh, turn) for mesh, turn in zip(meshes, turns)]
        if self.options.noise > 0:
            sigma = self.options.noise * self.uniform(n, 1, 1)
            meshes[0] = meshes[0] + sigma * torch.randn(meshes[0].shape, generator=self.random, device=self.device)
        pose_rows, rows = self.rows(n, body.vertex_count, vertices), self.rows(n, body.vertex_count, vertices)
        return [torch.gather(mesh - centre(mesh), 1, r[..., None].expand(-1, -1, 3))
                for mesh, r in zip(meshes, (pose_rows, rows, rows))]


def turned(mesh, angle):
    c, s = torch.cos(angle)[:, None], torch.sin(angle)[:, None]
    x, y, z = mesh.unbind(-1)
    return torch.stack([c * x + s * z, y, c * z - s * x], -1)


def centre(mesh):
    return (mesh.amax(1, keepdim=True) + mesh.amin(1, keepdim=True)) / 2


# --- network -------------------------------------------------------------------------------------------------------------------

def parameter_shapes(bottleneck):
    c1 = bottleneck + 3
    widths = (c1, c1 // 2, c1 // 4)
    shapes = {"encoder.conv1": (64, 3), "encoder.conv2": (128, 64), "encoder.conv3": (bottleneck, 128)}
    before = c1
    for k, c in enumerate(widths, 1):
        shapes[f"decoder.conv{k}"] = (c, before)
        block = f"decoder.spadain_block{k}"
        for unit in ("1", "2", "_res"):
            shapes[f"{block}.spadain{unit}.conv_weight"] = shapes[f"{block}.spadain{unit}.conv_bias"] = (c, 3)
            shapes[f"{block}.conv{unit}"] = (c, c)
        before = c
    shapes["decoder.conv4"] = (3, widths[2])
    return shapes


def initial_parameters(bottleneck, seed, device):
    """Weights N(0, 0.02^2), biases N(0, 0.1^2)."""
    random, parameters = torch.Generator().manual_seed(seed), {}
    for name, (rows, columns) in parameter_shapes(bottleneck).items():
        parameters[name + ".weight"] = 0.02 * torch.randn(rows, columns, 1, generator=random)
        parameters[name + ".bias"] = 0.1 * torch.randn(rows, generator=random)
    return {name: value.to(device) for name, value in parameters.items()}


def instance_norm(x):
    """Over vertices, in single precision."""
    x = x.float()
    variance, mean = torch.var_mean(x, 1, unbiased=False, keepdim=True)
    return (x - mean) * torch.rsqrt(variance + EPSILON)


class Network:
    """Maps are [n, vertices, channels]."""

    def __init__(self, parameters, pooled, precision):
        self.p, self.pooled, self.type = parameters, pooled, precision

    def convolution(self, name, x):
        weight, bias = self.p[name + ".weight"][..., 0], self.p[name + ".bias"]
        return F.linear(x.to(self.type), weight.to(self.type), bias.to(self.type))

    def modulated(self, name, x, identity, normalise):
        # Three columns: cheaper and more exact in single precision.
        def of_place(part):
            return F.linear(identity, self.p[f"{name}.{part}.weight"][..., 0], self.p[f"{name}.{part}.bias"])

        return of_place("conv_weight") * (instance_norm(x) if normalise else x.float()) + of_place("conv_bias")

    def block(self, k, x, identity, normalise):
        name = f"decoder.spadain_block{k}"

        def unit(part, y):
            return F.relu(self.convolution(f"{name}.conv{part}", self.modulated(f"{name}.spadain{part}", y, identity, normalise)))

        return unit("2", unit("1", x)).float() + unit("_res", x).float()

    def __call__(self, pose, identity):
        x = pose
        for k in (1, 2, 3):
            x = F.relu(instance_norm(self.convolution(f"encoder.conv{k}", x)))
        if self.pooled:
            x = x.amax(1, keepdim=True).expand(-1, identity.shape[1], -1)
        x = torch.cat([x, identity], 2)
        for k in (1, 2, 3):
            x = self.block(k, self.convolution(f"decoder.conv{k}", x), identity, k > 1 or not self.pooled)
        weight, bias = self.p["decoder.conv4.weight"][..., 0], self.p["decoder.conv4.bias"]
        return torch.tanh(F.linear(x, weight, bias))


# --- optimiser -----------------------------------------------------------------------------------------------------------------

def is_hidden_matrix(parameter):
    return parameter.dim() == 3 and parameter.shape[0] > 3 and parameter.shape[1] > 3


def orthogonalised(matrices, steps=5):
    """[n, rows, columns]: the same singular vectors, singular values of about 1 (Jordan et al. 2024)."""
    x = matrices.bfloat16() if matrices.is_cuda else matrices
    tall = x.shape[1] > x.shape[2]
    x = x.transpose(1, 2) if tall else x
    x = x / (x.flatten(1).norm(dim=1)[:, None, None] + 1e-30)
    for _ in range(steps):
        gram = x @ x.transpose(1, 2)
        x = 3.4445 * x + (-4.7750 * gram + 2.0315 * (gram @ gram)) @ x
    return (x.transpose(1, 2) if tall else x).float()


class Muon:
    """Matrices of one shape are orthogonalised together."""

    def __init__(self, parameters, momentum=0.95):
        self.momentum, self.groups = momentum, {}
        for parameter in parameters:
            self.groups.setdefault(tuple(parameter.shape[:2]), []).append(parameter)
        self.means = {shape: torch.zeros(len(group), *shape, device=group[0].device) for shape, group in self.groups.items()}

    @torch.no_grad()
    def step(self, rate):
        for shape, group in self.groups.items():
            gradient, mean = torch.stack([p.grad[..., 0] for p in group]), self.means[shape]
            mean.mul_(self.momentum).add_(gradient)
            update = orthogonalised(gradient + self.momentum * mean)
            length = rate * math.sqrt(max(1.0, shape[0] / shape[1]))
            torch._foreach_add_([p.data for p in group], [u[..., None] for u in update], alpha=-length)


def rate_factor(progress, warm_up=0.02, last=0.02):
    rise = min(1.0, progress / warm_up)
    return rise * (last + (1 - last) * 0.5 * (1 + math.cos(math.pi * progress)))


# --- course --------------------------------------------------------------------------------------------------------------------

def parse_stage(text):
    try:
        begin, size = text.split(":")
        batch, vertices = size.split("x")
        return float(begin), int(batch), 0 if vertices == "all" else int(vertices)
    except ValueError:
        fail(f"--stage: found '{text}', expected BEGIN:BATCHxVERTICES, such as 0.5:12x600")


def validate(network, bodies, options, device, pairs=24):
    """Mean squared distance a vertex (eq. 7) at full resolution, bounding boxes centred, the same pairs every time."""
    sampler, total = Sampler(bodies[:1], [1], options, 20260101, device), 0.0
    with torch.no_grad():
        for _ in range(pairs):
            pose, identity, truth = sampler.draw(1, 0)
            result = network(pose, identity)
            difference = (result - centre(result)) - (truth - centre(truth))
            total += difference.square().sum(-1).mean().item()
    return total / pairs


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--body", action="append", required=True, metavar="FILE[=WEIGHT]", help="may be repeated")
    parser.add_argument("--bottleneck", type=int, default=256)
    parser.add_argument("--feature", choices=("per-vertex", "pooled"), default="per-vertex")
    parser.add_argument("--start", help="weights to begin with (.safetensors)")
    parser.add_argument("--minutes", type=float, help="length, over all runs; the rate follows the clock")
    parser.add_argument("--steps", type=int, help="length in steps instead")
    parser.add_argument("--stage", action="append", metavar="BEGIN:BATCHxVERTICES", help="may be repeated")
    parser.add_argument("--rate", type=float, default=3e-3, help="Adam's")
    parser.add_argument("--matrix-rate", type=float, default=0.02, help="Muon's")
    parser.add_argument("--wide-poses", type=float, default=0.0, help="part of the meshes in poses of wider ranges than the paper's")
    parser.add_argument("--yaw", type=float, default=0.0, help="turn meshes about the vertical axis by up to so many degrees")
    parser.add_argument("--noise", type=float, default=0.0, help="largest standard deviation of noise on the pose mesh, in metres")
    parser.add_argument("--precision", choices=("bf16", "fp32"), default="bf16", help="of products between layers")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--compile", action="store_true", help="fuse the network with torch.compile (PyTorch 2)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--validate-every", type=float, default=60, help="seconds")
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--domain", default="human")
    parser.add_argument("--out", required=True)
    options = parser.parse_args()
    if (options.minutes is None) == (options.steps is None):
        parser.error("one of --minutes and --steps is needed")
    if not options.out.endswith(".safetensors"):
        parser.error("--out: expected a name that ends in .safetensors")
    return options


def main():
    options = arguments()
    device = torch.device(options.device)
    torch.backends.cuda.matmul.allow_tf32 = False
    named = [text.rsplit("=", 1) if "=" in os.path.basename(text) else (text, "1") for text in options.body]
    bodies, shares = [Body(path, device) for path, _ in named], [float(share) for _, share in named]
    stages = sorted(parse_stage(s) for s in options.stage or ["0:24x240", "0.5:12x600", "0.8:6x1200"])
    parameters = initial_parameters(options.bottleneck, options.seed, device)
    checkpoint_file = options.out[:-len(".safetensors")] + ".checkpoint.pt"

    if options.start:
        given, _ = load_safetensors(options.start)
        for name, parameter in parameters.items():
            if name not in given or tuple(given[name].shape) != tuple(parameter.shape):
                fail(f"{options.start}: {name}: found {list(given[name].shape) if name in given else 'nothing'}, "
                     f"expected {list(parameter.shape)}")
            parameter.copy_(torch.from_numpy(np.array(given[name])))
    for parameter in parameters.values():
        parameter.requires_grad_(True)
    muon = Muon([p for p in parameters.values() if is_hidden_matrix(p)])
    adam = torch.optim.Adam([p for p in parameters.values() if not is_hidden_matrix(p)], lr=options.rate)
    step, spent = 0, 0.0
    if options.resume:
        state = torch.load(checkpoint_file, map_location=device)
        step, spent = state["step"], state["seconds"]
        for name, parameter in parameters.items():
            parameter.data.copy_(state["parameters"][name])
        adam.load_state_dict(state["adam"])
        for shape, mean in state["muon"].items():
            muon.means[shape].copy_(mean)

    sampler = Sampler(bodies, shares, options, options.seed + 7919 * step, device)
    network = Network(parameters, options.feature == "pooled", torch.bfloat16 if options.precision == "bf16" else torch.float32)
    exact = Network(parameters, options.feature == "pooled", torch.float32)
    forward = torch.compile(network.__call__) if options.compile else network
    unit = {"domain": options.domain, "unit": "metre", "normalisation": "centre", "order": "conv_relu", "feature": options.feature,
            "output_scale": 1, "bottleneck": options.bottleneck, "seed": options.seed,
            "trained_on": ", ".join(body.name for body in bodies),
            "command": "python3 examples/torch/train.py " + " ".join(
                os.path.basename(a) if a.endswith(".safetensors") or "/" in a else a for a in sys.argv[1:])}

    def save(pmd):
        save_safetensors(options.out, parameters, unit | {"steps": step, "training_seconds": round(spent), "pmd": pmd,
                                                          "pmd_on": f"24 fresh pairs of {bodies[0].name}; eq. 7, boxes centred"})
        torch.save({"step": step, "seconds": spent, "parameters": {k: v.detach() for k, v in parameters.items()},
                    "adam": adam.state_dict(), "muon": muon.means}, checkpoint_file + ".part")
        os.replace(checkpoint_file + ".part", checkpoint_file)

    losses, begin, earlier, next_report = [], time.time(), spent, options.validate_every
    try:
        while True:
            spent = earlier + time.time() - begin
            progress = step / options.steps if options.steps else spent / (60 * options.minutes)
            if progress >= 1:
                break
            _, batch, vertices = [s for s in stages if s[0] <= progress or s is stages[0]][-1]
            factor = rate_factor(progress)
            for group in adam.param_groups:
                group["lr"] = options.rate * factor
            pose, identity, truth = sampler.draw(batch, vertices)
            loss = (forward(pose, identity) - truth).square().mean()
            adam.zero_grad(set_to_none=True)
            for parameter in parameters.values():
                parameter.grad = None
            loss.backward()
            muon.step(options.matrix_rate * factor)
            adam.step()
            step += 1
            losses.append(loss.detach())
            if step == 1 or spent - earlier > next_report:
                mean = 3e4 * torch.stack(losses).mean().item()
                if not math.isfinite(mean):
                    fail(f"step {step}: found a loss that is not finite")
                pmd = validate(exact, bodies, options, device)
                print(f"step {step}, {spent / 60:.1f} min, {100 * progress:.0f} %, {batch} x {vertices or 'all'}: "
                      f"PMD {1e4 * pmd:.2f}e-4 unseen, {mean:.2f}e-4 in training", flush=True)
                save(pmd)
                losses, next_report = [], time.time() - begin + options.validate_every
    except KeyboardInterrupt:
        print("interrupted: saved; --resume goes on from here")
    pmd = validate(exact, bodies, options, device)
    save(pmd)
    print(f"{options.out}: {step} steps in {spent / 60:.1f} min, PMD {1e4 * pmd:.2f}e-4 on 24 unseen pairs")


if __name__ == "__main__":
    main()
