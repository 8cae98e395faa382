#!/usr/bin/env python3
"""A training step of the paper's network in PyTorch: forward, reconstruction loss, backward, Adam on random meshes that are made once;
one line of JSON. Needs torch and numpy (Debian: python3-torch, python3-numpy).

usage: torch_step.py [--bottleneck B] [--vertices V] [--batch N] [--threads N] [--repeats N] [--seed S]

Before it times, the slope of the loss along the gradient is compared with a central difference. compare.py --bench train gives the
environment that was found to be fastest. `npt bench train` makes new samples in every step and counts them; here there are none to make.
"""
import argparse
import json
import resource
import sys
import time

from torch_net import Net, reference_blas, torch


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bottleneck", type=int, default=1024)
    parser.add_argument("--vertices", type=int, default=6890)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if min(arguments.bottleneck, arguments.vertices, arguments.batch, arguments.threads, arguments.repeats) < 1:
        parser.error("all numbers must be at least 1")
    if reference_blas():
        sys.exit("torch_step.py: this PyTorch runs on the reference BLAS, which would make it look ten times slower than it is "
                 "(on Debian: apt-get install libopenblas0-pthread)")
    torch.set_num_threads(arguments.threads)
    torch.manual_seed(arguments.seed)
    net = Net(arguments.bottleneck)
    with torch.no_grad():
        for name, p in net.named_parameters():
            p.normal_(0, 0.02 if name.endswith("weight") else 0.1)
    shape = (arguments.batch, 3, arguments.vertices)
    pose, identity, truth = (torch.rand(shape) * 2 - 1 for _ in range(3))

    def loss_of(count):
        return ((net(pose[:count], identity[:count]) - truth[:count]) ** 2).mean()

    error = check_slope(net, loss_of)
    optimiser = torch.optim.Adam(net.parameters(), lr=5e-5)

    def step():
        optimiser.zero_grad(set_to_none=True)
        loss = loss_of(arguments.batch)
        loss.backward()
        optimiser.step()
        return loss.item()

    losses = [step()]  # warm
    seconds = []
    for _ in range(arguments.repeats):
        start = time.perf_counter()
        losses.append(step())
        seconds.append(time.perf_counter() - start)
    if not losses[-1] < losses[0]:
        sys.exit(f"torch_step.py: the loss didn't fall: {losses[0]} to {losses[-1]}")
    seconds.sort()
    print(json.dumps({"peer": f"PyTorch {torch.__version__} training step", "threads": arguments.threads,
                      "vertices": arguments.vertices, "batch": arguments.batch,
                      "seconds_min": round(seconds[0], 6), "seconds_median": round(seconds[len(seconds) // 2], 6),
                      "error": float(f"{error:.3g}"),
                      "peak_memory_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)}))


def check_slope(net, loss_of):
    """Relative difference between the gradient's squared length and the slope measured along it. In fp32, hence coarse."""
    parameters = list(net.parameters())
    gradient = torch.autograd.grad(loss_of(1), parameters)
    square = sum(float((g.double() ** 2).sum()) for g in gradient)
    step = 1e-2 / square**0.5
    values = []
    with torch.no_grad():
        start = [p.clone() for p in parameters]
        for sign in (1, -1):
            for p, s, g in zip(parameters, start, gradient):
                p.copy_(s + sign * step * g)
            values.append(float(loss_of(1).double()))
        for p, s in zip(parameters, start):
            p.copy_(s)
    error = abs((values[0] - values[1]) / (2 * step) / square - 1)
    if not error < 0.05:
        sys.exit(f"torch_step.py: the gradient disagrees with a central difference by {error:.2e}")
    return error


if __name__ == "__main__":
    main()
