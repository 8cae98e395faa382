#!/usr/bin/env python3
"""Fits the prior of natural poses, a mixture of Gaussians, and writes it as a C++ header (include/npt/body/natural_pose_data.hpp).

    fit_pose_prior.py poses.safetensors natural_pose_data.hpp

poses.safetensors holds a tensor `poses` [N, 24, 3]: axis angles in radians, SMPL's order of joints, the root's direction first, y
up; metadata `names`, a line a pose, "SOURCE/CLIP@TIME", tells which belong together. The features of a pose are the root's tilt, two
numbers, without its direction about the vertical, and 69 joint angles. Left and right are tied: every component counts with its
mirror image, so the mixture is symmetric. A component's covariance is shrunk towards the pooled one and held as a few directions plus
a diagonal. Modes that the poses lack (arms overhead, sitting, lying, crouching) are added by hand, with the pooled covariance.

--choose tries numbers of components and ranks on clips left out, five groups of them, and prints the log-likelihoods.
"""

import argparse
import math
import os
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    sys.exit("error: this converter needs numpy (Debian: python3-numpy)")

from convert_common import ConvertError, read_safetensors, run

JOINTS = ("pelvis l_hip r_hip spine1 l_knee r_knee spine2 l_ankle r_ankle spine3 l_foot r_foot neck l_collar r_collar head "
          "l_shoulder r_shoulder l_elbow r_elbow l_wrist r_wrist l_hand r_hand").split()
D = 71  # tilt about x and z, then x, y, z of joints 1 to 23
DEGREE = math.pi / 180

# Knees and elbows bend to one side; the others are limited by the poses themselves. Degrees: {joint: {axis: (low, high)}}.
HINGES = {"l_knee": {0: (-4, 145)}, "r_knee": {0: (-4, 145)}, "l_elbow": {1: (-150, 2)}, "r_elbow": {1: (-2, 150)}}

# What the sums below are written with: digits of base 64, two a number.
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz+-"


def rotation(v):
    """Rodrigues' formula. v: [3] axis angle."""
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = np.asarray(v) / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * (k @ k)


def axis_angle(r):
    """The axis angle of a rotation matrix."""
    w = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    angle = math.atan2(np.linalg.norm(w), np.trace(r) - 1)
    if math.pi - angle > 1e-6:
        return w / max(np.linalg.norm(w), 1e-300) * angle
    axis = np.sqrt(np.maximum(0, (np.diag(r) + 1) / 2))
    k = int(np.argmax(axis))
    return math.pi * np.array([axis[i] if i == k else math.copysign(axis[i], r[i, k]) for i in range(3)])


def tilt(root):
    """(x, z) of the rotation about a horizontal axis that, followed by a turn about the vertical, is the root's: the vertical as
    the body sees it decides it."""
    up = rotation(root).T @ np.array([0.0, 1.0, 0.0])
    sine, angle = math.hypot(up[0], up[2]), math.atan2(math.hypot(up[0], up[2]), up[1])
    if sine < 1e-9:
        return (0.0, 0.0) if angle < 1 else (angle, 0.0)
    # The swing S has S up = y: its axis is up x y.
    return -up[2] / sine * angle, up[0] / sine * angle


def features(poses):
    """[N, 24, 3] -> [N, 71]"""
    tilts = np.array([tilt(p[0]) for p in poses])
    return np.concatenate([tilts, poses[:, 1:].reshape(len(poses), -1)], axis=1)


def mirror_tables():
    """Mirroring in x: mirrored = sign * features[..., order]."""
    other = {n: n.replace("l_", "r_", 1) if n.startswith("l_") else n.replace("r_", "l_", 1) if n.startswith("r_") else n for n in JOINTS}
    order, sign = [0, 1], [1.0, -1.0]
    for name in JOINTS[1:]:
        j = JOINTS.index(other[name])
        order += [2 + 3 * (j - 1) + k for k in range(3)]
        sign += [1.0, -1.0, -1.0]
    return np.array(order), np.array(sign)


ORDER, SIGN = mirror_tables()


def mirrored(x):
    return SIGN * x[..., ORDER]


class Mixture:
    """sum over k of weight_k / 2 * (N(x; k) + N(mirrored x; k)), covariances F F^T + diag(d^2). The last components may share the
    last factor and deviations."""

    def __init__(self, weights, means, factors, deviations):
        self.weights, self.means, self.factors, self.deviations = weights, means, factors, deviations

    def log_terms(self, x):
        """[N, K] log N(x; k)"""
        terms = np.empty((len(x), len(self.weights)))
        for k, (mean, factor, deviation) in enumerate(zip(self.means, self.factors, self.deviations)):
            z, g = (x - mean) / deviation, factor / deviation[:, None]
            m = np.eye(factor.shape[1]) + g.T @ g
            c = np.linalg.cholesky(m)
            p = np.linalg.solve(c, (z @ g).T)
            terms[:, k] = -0.5 * ((z**2).sum(1) - (p**2).sum(0)) - np.log(np.diag(c)).sum() - np.log(deviation).sum()
        return terms - 0.5 * x.shape[1] * math.log(2 * math.pi)

    def log_both(self, x):
        """[N, K, 2] with weights; the last axis: as it is, mirrored."""
        both = np.stack([self.log_terms(x), self.log_terms(mirrored(x))], axis=2)
        return both + np.log(np.maximum(self.weights, 1e-300))[None, :, None] - math.log(2)

    def log_density(self, x):
        both = self.log_both(x).reshape(len(x), -1)
        top = both.max(1)
        return top + np.log(np.exp(both - top[:, None]).sum(1))


def low_rank(covariance, rank, floor):
    """A factor [D, rank] and deviations [D] whose F F^T + diag is near the covariance and has its diagonal."""
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    values, vectors = values[::-1][:rank], vectors[:, ::-1][:, :rank]
    rest = max(0.0, (len(scale) - values.sum()) / max(1, len(scale) - rank))
    factor = scale[:, None] * vectors * np.sqrt(np.maximum(0, values - rest))
    deviation = np.sqrt(np.maximum(np.diag(covariance) - (factor**2).sum(1), floor**2))
    return factor, deviation


def start(x, sources, count, random):
    """k-means++ and ten rounds of k-means, up to mirroring."""
    means = [x[random.integers(len(x))]]
    def distance(means):
        means = np.array(means)
        direct = ((x[:, None] - means[None]) ** 2).sum(2)
        swapped = ((mirrored(x)[:, None] - means[None]) ** 2).sum(2)
        return np.minimum(direct, swapped), swapped < direct
    while len(means) < count:
        d = distance(means)[0].min(1) * sources
        means.append(x[random.choice(len(x), p=d / d.sum())])
    for _ in range(10):
        d, swapped = distance(means)
        nearest = d.argmin(1)
        for k in range(count):
            own = nearest == k
            if own.any():
                points = np.where(swapped[own, k][:, None], mirrored(x[own]), x[own])
                means[k] = np.average(points, axis=0, weights=sources[own])
    return np.array(means)


def fit(x, importance, count, rank, shrink, floor, random, rounds=40):
    """EM. importance: [N], sums to N. shrink: as many poses as the pooled covariance counts for."""
    means = start(x, importance, count, random)
    factors = np.zeros((count, D, rank))
    deviations = np.full((count, D), 0.35)
    mixture = Mixture(np.full(count, 1 / count), means, factors, deviations)
    swapped = mirrored(x)
    pooled = None
    for _ in range(rounds):
        both = mixture.log_both(x)
        flat = both.reshape(len(x), -1)
        share = np.exp(flat - flat.max(1, keepdims=True))
        share = (share / share.sum(1, keepdims=True)).reshape(both.shape) * importance[:, None, None]
        totals = share.sum((0, 2))
        means, scatter = np.empty((count, D)), np.empty((count, D, D))
        for k in range(count):
            a, b = share[:, k, 0], share[:, k, 1]
            means[k] = (a @ x + b @ swapped) / max(totals[k], 1e-9)
            u, v = x - means[k], swapped - means[k]
            scatter[k] = (u * a[:, None]).T @ u + (v * b[:, None]).T @ v
        pooled = scatter.sum(0) / totals.sum()
        pooled = (pooled + SIGN[:, None] * SIGN * pooled[np.ix_(ORDER, ORDER)]) / 2
        # Half of the prior is a diagonal: 327 poses say little about most of 71 x 70 / 2 correlations.
        prior = 0.5 * pooled + 0.5 * np.diag(np.diag(pooled))
        prior += floor**2 * np.eye(D)
        factors, deviations = [], []
        for k in range(count):
            factor, deviation = low_rank((scatter[k] + shrink * prior) / (totals[k] + shrink), rank, floor)
            factors.append(factor)
            deviations.append(deviation)
        mixture = Mixture((totals + 0.5) / (totals + 0.5).sum(), means, np.array(factors), np.array(deviations))
    return mixture, prior


def read_poses(path):
    """[N, 24, 3] and the clip of each."""
    holding = " with a tensor poses"
    metadata, tensors = read_safetensors(path, holding)
    try:
        dtype, shape, data = tensors["poses"]
        if dtype != "F32":
            raise ConvertError(f"{path}: poses: found {dtype}, expected F32")
        poses = np.frombuffer(data, "<f4").astype(float).reshape(shape)
    except (ValueError, KeyError, TypeError):
        raise ConvertError(f"{path}: found no safetensors file{holding}") from None
    if poses.ndim != 3 or poses.shape[1:] != (24, 3) or len(poses) < 8:
        raise ConvertError(f"{path}: poses: found shape {list(poses.shape)}, expected [at least 8, 24, 3]")
    if not np.all(np.isfinite(poses)):
        raise ConvertError(f"{path}: poses: found a number that is not finite")
    names = metadata.get("names", "").split("\n")
    if len(names) != len(poses):
        names = [str(i) for i in range(len(poses))]
    return poses, [name.split("@")[0] for name in names]


def importances(clips):
    """A clip of n poses counts as sqrt(n): frames of a movement resemble each other. They sum to the number of poses."""
    number = {c: clips.count(c) for c in clips}
    weights = np.array([number[c] ** -0.5 for c in clips])
    return weights * len(weights) / weights.sum()


def choose(x, clips, arguments, random):
    names = sorted(set(clips))
    groups = np.array([names.index(c) for c in clips])
    part = random.permutation(len(names)) % 5
    for count in (4, 8, 12, 16, 20, 24):
        for rank in (4, 8, 12):
            for shrink in (12, 24, 48, 96):
                total = 0.0
                for p in range(5):
                    held = part[groups] == p
                    inside = importances([c for c, h in zip(clips, held) if not h])
                    mixture, _ = fit(x[~held], inside, count, rank, shrink, arguments.floor, np.random.default_rng(p), rounds=15)
                    total += mixture.log_density(x[held]).sum()
                print(f"components {count:2d} rank {rank:2d} shrink {shrink:4.1f}: {total / len(x):8.2f} a pose left out", flush=True)


def turned(*rotations):
    """The axis angle of rotations applied right to left: (axis, degrees) each."""
    r = np.eye(3)
    for axis, degrees in rotations:
        r = r @ rotation(np.eye(3)["xyz".index(axis)] * degrees * DEGREE)
    return axis_angle(r) / DEGREE


def hand_made():
    """[(weight, features)]: modes that animation libraries lack. Angles in degrees; left-right pairs are given for the left."""
    arms = {  # shoulder, elbow, collar
        "down": ((0, -6, -62), (0, -22, 0), (0, 0, -6)),
        "lap": (turned(("y", -12), ("z", -66), ("y", -14)), (0, -46, 0), (0, -4, -4)),
        "behind": (turned(("z", -58), ("y", 30)), (0, -8, 0), (0, 8, -2)),
        "overhead": (turned(("z", 62), ("x", -10)), (0, -14, 0), (0, 0, 20)),
        "wide overhead": (turned(("z", 38), ("x", -5)), (0, -20, 0), (0, 0, 16)),
        "head": (turned(("z", 52), ("x", -35), ("y", -15)), (0, -112, 0), (0, 0, 18)),
        "sides": ((0, -8, -48), (0, -20, 0), (0, 0, -4)),
        "front": (turned(("y", -68), ("z", -8)), (0, -18, 0), (0, -14, 0)),
        "knees": (turned(("y", -52), ("z", -38)), (0, -45, 0), (0, -10, -2)),
    }
    legs = {  # hip, knee, ankle
        "standing": ((-4, 2, 4), (8, 0, 0), (-2, 0, 0)),
        "apart": ((-4, 6, 14), (8, 0, 0), (-2, 0, 0)),
        "stride": ((-30, 2, 4), (18, 0, 0), (4, 0, 0)),
        "chair": (turned(("y", 8), ("x", -84)), (84, 0, 0), (2, 0, 0)),
        "long": (turned(("y", 8), ("x", -78)), (8, 0, 0), (18, 0, 0)),
        "knees up": (turned(("y", 6), ("x", -112)), (98, 0, 0), (6, 0, 0)),
        "crossed": (turned(("y", 40), ("x", -82), ("y", 66)), (128, 0, 0), (22, 0, 0)),
        "kneeling": ((-58, 4, 4), (128, 0, 0), (38, 0, 0)),
        "squat": (turned(("y", 18), ("x", -112)), (124, 0, 0), (-26, 0, 0)),
        "half squat": (turned(("y", 12), ("x", -68)), (82, 0, 0), (-22, 0, 0)),
        "bent": (turned(("y", 4), ("x", -48)), (72, 0, 0), (10, 0, 0)),
        "lunge": (turned(("y", 2), ("x", -82)), (80, 0, 0), (-4, 0, 0)),
        "back": ((18, 0, 2), (62, 0, 0), (18, 0, 0)),
    }
    modes = []

    def add(weight, left_arm, right_arm, left_leg, right_leg, spine=(0, 0, 0), head=(0, 0, 0), root=(0, 0)):
        pose = np.zeros((24, 3))
        flip = np.array([1, -1, -1])
        for arm, side, sign in ((left_arm, "l_", 1), (right_arm, "r_", flip)):
            for name, angles in zip(("shoulder", "elbow", "collar"), arms[arm]):
                pose[JOINTS.index(side + name)] = np.array(angles) * sign
            pose[JOINTS.index(side + "hand")] = np.array((0, 0, -12)) * sign
        for leg, side, sign in ((left_leg, "l_", 1), (right_leg, "r_", flip)):
            for name, angles in zip(("hip", "knee", "ankle"), legs[leg]):
                pose[JOINTS.index(side + name)] = np.array(angles) * sign
        for name in ("spine1", "spine2", "spine3"):
            pose[JOINTS.index(name)] = np.array(spine) / 3
        for name in ("neck", "head"):
            pose[JOINTS.index(name)] = np.array(head) / 2
        modes.append((weight, np.concatenate([np.array(root), pose[1:].ravel()]) * DEGREE))

    add(2, "overhead", "overhead", "standing", "standing")
    add(2, "wide overhead", "wide overhead", "apart", "apart")
    add(2, "overhead", "sides", "standing", "stride", head=(-10, 0, 0))
    add(1, "head", "head", "apart", "standing")
    add(3, "lap", "lap", "chair", "chair", spine=(12, 0, 0))
    add(2, "lap", "down", "chair", "chair", spine=(25, 0, 0), root=(8, 0))
    add(1, "front", "front", "chair", "chair", spine=(8, 0, 0))
    add(1, "overhead", "lap", "chair", "chair")
    add(2, "behind", "behind", "long", "long", spine=(8, 0, 0), root=(-14, 0))
    add(2, "knees", "knees", "knees up", "knees up", spine=(28, 0, 0), root=(-6, 0))
    add(2, "knees", "knees", "crossed", "crossed", spine=(18, 0, 0))
    add(2, "lap", "lap", "kneeling", "kneeling", spine=(6, 0, 0), root=(4, 0))
    add(2, "sides", "sides", "standing", "standing", root=(-90, 0))
    add(1, "overhead", "sides", "bent", "standing", root=(-88, 0))
    add(1, "down", "lap", "bent", "bent", spine=(15, 0, 0), root=(-90, 0))
    add(1, "sides", "sides", "standing", "standing", root=(88, 0), head=(-10, 30, 0))
    add(1, "head", "head", "standing", "bent", root=(88, 0), head=(-5, 40, 0))
    add(2, "front", "lap", "bent", "knees up", spine=(20, 0, 0), root=(0, 86))
    add(2, "front", "front", "squat", "squat", spine=(22, 0, 0), root=(22, 0))
    add(2, "knees", "knees", "half squat", "half squat", spine=(20, 0, 0), root=(18, 0))
    add(2, "sides", "lap", "lunge", "back", spine=(8, 0, 0))
    return modes


def limits(x, modes):
    """[D] lowest and highest angle of a draw: those of 99 % of the poses and of all modes, and their mirror images, 8 degrees wider."""
    low, high = np.quantile(x, 0.005, axis=0), np.quantile(x, 0.995, axis=0)
    for m in modes:
        low, high = np.minimum(low, m), np.maximum(high, m)
    a, b = mirrored(low), mirrored(high)
    low, high = np.minimum(low, np.minimum(a, b)) - 8 * DEGREE, np.maximum(high, np.maximum(a, b)) + 8 * DEGREE
    low[:2], high[:2] = -math.pi, math.pi
    for joint, axes in HINGES.items():
        for axis, (least, most) in axes.items():
            i = 2 + 3 * (JOINTS.index(joint) - 1) + axis
            low[i], high[i] = max(low[i], least * DEGREE), min(high[i], most * DEGREE)
    return low, high


def digits(values, largest):
    """Two digits a number: (value / largest + 1) / 2 * 4095, rounded."""
    steps = np.rint((np.clip(np.asarray(values).ravel() / largest, -1, 1) + 1) / 2 * 4095).astype(int)
    return "".join(DIGITS[n >> 6] + DIGITS[n & 63] for n in steps)


def header_text(mixture, low, high):
    count, (spreads, _, rank) = len(mixture.weights), mixture.factors.shape
    largest = {"natural_pose_means": math.pi, "natural_pose_factors": float(np.abs(mixture.factors).max()),
               "natural_pose_deviations": float(mixture.deviations.max()), "natural_pose_limits": math.pi,
               "natural_pose_weights": float(mixture.weights.max())}
    parts = [("natural_pose_weights", f"[{count}] share of each component, with its mirror image", mixture.weights),
             ("natural_pose_means", f"[{count}, {D}]", mixture.means),
             ("natural_pose_deviations", f"[{spreads}, {D}] of component k: those of min(k, {spreads - 1})", mixture.deviations),
             ("natural_pose_factors", f"[{spreads}, {rank}, {D}] likewise", np.transpose(mixture.factors, (0, 2, 1))),
             ("natural_pose_limits", f"[2, {D}] lowest and highest", np.stack([low, high]))]
    lines = ["/// The numbers of the prior of natural poses (natural_poses.hpp). Written by examples/convert/fit_pose_prior.py: change",
             "/// that, not this. Two digits a number (base/digits.hpp), n of 0 to 4095 for (2 n / 4095 - 1) * largest. Fitted to",
             "/// poses under CC0.",
             "#pragma once", "", "#include <npt/config.hpp>", "", "#include <cstddef>", "", "namespace npt::inline NPT_ABI::body::internal {", "",
             f"inline constexpr std::size_t natural_pose_components = {count};",
             f"inline constexpr std::size_t natural_pose_spreads = {spreads};", f"inline constexpr std::size_t natural_pose_rank = {rank};", ""]
    for name, shape, values in parts:
        lines.append(f"/// {shape}")
        lines.append(f"inline constexpr double {name}_largest = {largest[name]:.9g};")
        lines.append(f"inline constexpr char {name}[] =")
        text = digits(values, largest[name])
        rows = [text[i:i + 110] for i in range(0, len(text), 110)]
        if len(rows) == 1 and len(lines[-1]) + len(rows[0]) < 117:
            lines[-1:] = [f'{lines[-1]} "{rows[0]}";', ""]
            continue
        lines += [f'    "{row}"' for row in rows[:-1]] + [f'    "{rows[-1]}";', ""]
    return "\n".join(lines + ["}  // namespace npt::inline NPT_ABI::body::internal", ""])


def write_text(path, text):
    """The file appears under its name only when it is complete."""
    partial = None
    try:
        with tempfile.NamedTemporaryFile("w", dir=os.path.dirname(os.path.abspath(path)), delete=False) as out:
            partial = out.name
            out.write(text)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(partial, 0o666 & ~umask)
        os.replace(partial, path)
    except OSError as error:
        if partial is not None and os.path.exists(partial):
            os.unlink(partial)
        raise ConvertError(f"{path}: cannot write: {error.strerror}") from None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("poses", help="safetensors file with a tensor poses [N, 24, 3]")
    parser.add_argument("header", help="C++ header to write")
    parser.add_argument("--components", type=int, default=12, help="fitted ones (default 12)")
    parser.add_argument("--rank", type=int, default=12, help="directions of a component's covariance (default 12)")
    parser.add_argument("--shrink", type=float, default=48, help="poses that the pooled covariance counts for (default 48)")
    parser.add_argument("--floor", type=float, default=0.03, help="least standard deviation, radians (default 0.03)")
    parser.add_argument("--by-hand", type=float, default=0.25, help="share of the modes made by hand (default 0.25)")
    parser.add_argument("--seed", type=int, default=1, help="of EM's starts (default 1)")
    parser.add_argument("--starts", type=int, default=4, help="EM runs, of which the best is kept (default 4)")
    parser.add_argument("--choose", action="store_true", help="print log-likelihoods of poses left out, and write nothing")
    arguments = parser.parse_args()
    poses, clips = read_poses(arguments.poses)
    x = features(poses)
    for name, found, least in (("--components", arguments.components, 1), ("--rank", arguments.rank, 1), ("--starts", arguments.starts, 1)):
        if found < least:
            raise ConvertError(f"{name}: found {found}, expected at least {least}")
    if not 0 <= arguments.by_hand < 1:
        raise ConvertError(f"--by-hand: found {arguments.by_hand}, expected a share, 0 to 1")
    random = np.random.default_rng(arguments.seed)
    if arguments.choose:
        choose(x, clips, arguments, random)
        return
    importance = importances(clips)
    best = None
    for _ in range(arguments.starts):
        mixture, prior = fit(x, importance, arguments.components, arguments.rank, arguments.shrink, arguments.floor, random)
        value = importance @ mixture.log_density(x) / len(x)
        if best is None or value > best[0]:
            best = value, mixture, prior
    value, mixture, prior = best
    modes = hand_made() if arguments.by_hand > 0 else []
    if modes:
        # Half the pooled deviation: the pooled one makes sitting people kick and lying ones stand.
        factor, deviation = low_rank(prior / 4, arguments.rank, arguments.floor)
        weights = np.array([w for w, _ in modes], dtype=float)
        mixture = Mixture(np.concatenate([(1 - arguments.by_hand) * mixture.weights, arguments.by_hand * weights / weights.sum()]),
                          np.concatenate([mixture.means, [m for _, m in modes]]),
                          np.concatenate([mixture.factors, [factor]]), np.concatenate([mixture.deviations, [deviation]]))
    low, high = limits(x, [m for _, m in modes])
    text = header_text(mixture, low, high)
    write_text(arguments.header, text)
    print(f"{arguments.header}: {len(mixture.weights)} components, {len(modes)} of them by hand, rank {arguments.rank}, "
          f"{len(text) // 1024} KB; log density {value:.2f} a pose of {len(x)}")


if __name__ == "__main__":
    run(main)
