#!/usr/bin/env python3
"""Learns from measured estimates how their features tell whether they are right, and puts it into a weights file.

    fit_confidence.py table.csv weights.safetensors result.safetensors [--joints joints.csv] [--judge-only FAMILY ...]
        [--joints-only] [--right 0.05]

table    rows of npt_measure_estimates
joints   its rows of joints: without them, confidences of joints stay as they are; --joints-only: those of estimates do
weights  with a correspondence network, which the table was measured with
result   the same with "confidence_weights" and "confidence_joint_weights" in the metadata of that network
         (npt/estimate/confidence.hpp)

An estimate is right where the mesh is of the kind and its joints lie within 5 % of its height in the mean (--right). The model is
logistic regression. All families of people count the same, and so do all kinds of things; both halves count the same,
with the meshes in which no body was found at all. A joint is right where it lies within as much; its features are the
correspondences about it, its parts' distance from the surface and the odds of the whole estimate. Printed are
predictions for each family by a model that was learned without it: how many are right of those with a high, a middling and a low confidence, with
90 % intervals of a bootstrap over families.
"""

import argparse
import csv
import os
import random
import sys

try:
    import numpy as np
except ImportError:
    sys.exit("error: this script needs numpy (Debian: python3-numpy)")

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "convert"))
from convert_common import ConvertError, read_safetensors, run, write_safetensors  # noqa: E402

FEATURES = ("correspondences", "surface", "pose", "shape")
JOINT_FEATURES = ("correspondences", "surface")
RIDGE = 0.001  # holds the weights of standardised features at 0; of 0.001 to 0.01 the best out of family
BINS = ((0.9, 1.01), (0.6, 0.9), (0.5, 0.6), (0.1, 0.5), (0, 0.1))


def read_table(paths, right):
    rows = []
    for path in paths:
        with open(path, newline="") as file:
            rows += list(csv.DictReader(file))
    counts = {}  # meshes of each family, those in which no body was found, too
    for row in rows:
        counts[row["family"]] = counts.get(row["family"], 0) + 1
    rows = [row for row in rows if row["has_body"] == "1"]  # of the others confidence is 0, whatever the model
    if not rows:
        raise ConvertError(f"{paths[0]}: found no estimate, expected rows of npt_measure_estimates")
    return {
        "count": counts,
        "x": np.array([[float(row[name]) for name in FEATURES] for row in rows]),
        "right": np.array([row["person"] == "1" and float(row["error"]) < right for row in rows], float),
        "person": np.array([row["person"] == "1" for row in rows]),
        "family": np.array([row["family"] for row in rows]),
        "name": np.array([row["name"] for row in rows]),
    }


def weights_of(table, used):
    """Of each row; 0 where it isn't used."""
    weights = np.zeros(len(used))
    for half in (table["person"], ~table["person"]):
        families = sorted(set(table["family"][half & used]))
        for family in families:
            rows = half & used & (table["family"] == family)
            weights[rows] = 0.5 / len(families) / table["count"][family]
    return weights / weights.sum()


def learn(table, used):
    """[features + 1] of the features as they are."""
    return logistic(table["x"], table["right"], weights_of(table, used))


def logistic(x, right, weights):
    """By Newton's method."""
    mean = weights @ x
    deviation = np.sqrt(weights @ (x - mean) ** 2) + 1e-9
    z = np.hstack([(x - mean) / deviation, np.ones((len(x), 1))])
    ridge = np.diag([RIDGE] * x.shape[1] + [0])
    w = np.zeros(x.shape[1] + 1)
    for _ in range(50):
        p = 1 / (1 + np.exp(-np.clip(z @ w, -30, 30)))
        gradient = z.T @ (weights * (p - right)) + ridge @ w
        hessian = (z * (weights * p * (1 - p))[:, None]).T @ z + ridge + 1e-9 * np.eye(len(w))
        w = w - np.linalg.solve(hessian, gradient)
    own = w[:-1] / deviation
    return np.append(own, w[-1] - own @ mean)


def learn_joints(path, table, w, judge_only, most):
    """[4] of a joint's features, of the odds of the whole, and the constant; families count the same."""
    odds = dict(zip(table["name"], table["x"] @ w[:-1] + w[-1]))
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["name"] in odds and row["family"] not in judge_only]
    if not rows:
        raise ConvertError(f"{path}: found no joint of the table's meshes, expected rows of npt_measure_estimates")
    x = np.array([[float(row[name]) for name in JOINT_FEATURES] + [odds[row["name"]]] for row in rows])
    right = np.array([float(row["error"]) < most for row in rows], float)
    families = np.array([row["family"] for row in rows])
    weights = np.zeros(len(rows))
    for family in set(families):
        weights[families == family] = 1 / (families == family).sum()
    result = logistic(x, right, weights / weights.sum())
    p = 1 / (1 + np.exp(-(x @ result[:-1] + result[-1])))
    print("confidence of a joint  joints  right")
    for low, high in BINS:
        inside = (p >= low) & (p < high)
        if inside.any():
            print(f"{low:.2f} to {min(high, 1):.2f} {inside.sum():16d} {right[inside].mean():6.2f}")
    return result


def predict(table, w):
    return 1 / (1 + np.exp(-np.clip(table["x"] @ w[:-1] + w[-1], -30, 30)))


def out_of_family(table, judge_only):
    """Of each row, by a model that knows neither its family nor what is kept to judge by."""
    result = np.zeros(len(table["right"]))
    kept = np.isin(table["family"], judge_only)
    for family in sorted(set(table["family"])):
        rows = table["family"] == family
        result[rows] = predict(table, learn(table, ~rows & ~kept))[rows]
    return result


def interval(table, inside):
    """Of the share that is right of these rows: 5th and 95th percentile over families drawn anew."""
    families = sorted(set(table["family"][inside]))
    draw = random.Random(1)
    shares = []
    for _ in range(400):
        chosen = [draw.choice(families) for _ in families]
        values = np.concatenate([table["right"][inside & (table["family"] == f)] for f in chosen])
        shares.append(values.mean())
    return np.percentile(shares, [5, 95])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="+", metavar="table.csv")
    parser.add_argument("weights")
    parser.add_argument("result")
    parser.add_argument("--joints", metavar="joints.csv")
    parser.add_argument("--joints-only", action="store_true", help="keep what the weights say of whole estimates")
    parser.add_argument("--judge-only", nargs="*", default=[], metavar="FAMILY")
    parser.add_argument("--right", type=float, default=0.05, metavar="SHARE", help="of the height")
    arguments = parser.parse_args()
    table = read_table(arguments.tables, arguments.right)
    predicted = out_of_family(table, arguments.judge_only)
    print("confidence      estimates  predicted  right  (90 % interval)")
    for low, high in BINS:
        inside = (predicted >= low) & (predicted < high)
        if not inside.any():
            continue
        least, most = interval(table, inside)
        print(
            f"{low:.2f} to {min(high, 1):.2f} {inside.sum():10d} {predicted[inside].mean():10.2f} "
            f"{table['right'][inside].mean():6.2f}  ({least:.2f} to {most:.2f})"
        )
    print(f"{'family':32s} meshes  right  from 0.6  from 0.85")
    for family in sorted(set(table["family"])):
        rows = table["family"] == family
        p = predicted[rows]
        print(
            f"{family:32s} {rows.sum():6d} {table['right'][rows].mean():6.2f} {(p >= 0.6).mean():9.2f} "
            f"{(p >= 0.85).mean():10.2f}"
        )
    metadata, tensors = read_safetensors(arguments.weights)
    inside = any(name.startswith("correspondence/") for name in tensors)
    part = "correspondence/" if inside else ""
    if arguments.joints_only:
        if part + "confidence_weights" not in metadata:
            raise ConvertError(
                f"{arguments.weights}: found no confidence_weights, expected those that --joints-only keeps"
            )
        w = np.array([float(number) for number in metadata[part + "confidence_weights"].split()])
    else:
        w = learn(table, ~np.isin(table["family"], arguments.judge_only))
    for name, value in zip(FEATURES + ("constant",), w):
        print(f"{name:12s} {value:8.3f}")
    metadata[part + "confidence_weights"] = " ".join(f"{value:.4f}" for value in w)
    if arguments.joints:
        joints = learn_joints(arguments.joints, table, w, arguments.judge_only, arguments.right)
        metadata[part + "confidence_joint_weights"] = " ".join(f"{value:.4f}" for value in joints)
    for old in ("confidence", "joint_confidence_weights"):  # of earlier versions
        metadata.pop(part + old, None)
    write_safetensors(arguments.result, tensors, metadata)


if __name__ == "__main__":
    run(main)
