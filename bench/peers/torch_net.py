#!/usr/bin/env python3
"""The paper's network in PyTorch: checks its result, then times it; one line of JSON. Needs torch and numpy (Debian:
python3-torch, python3-numpy).

usage: torch_net.py CASE [--threads N] [--repeats N] [--mode traced|eager]
  CASE    file that bench_make_case wrote
  --mode  traced: torch.jit.trace and freeze (default); eager: as it comes

compare.py gives the environment that was found to be fastest: the BLAS's AVX-512 kernels, large blocks kept by the allocator
instead of returned, idle threads that sleep.
"""
import argparse
import json
import struct
import sys
import time

try:
    import numpy
    import torch
    import torch.nn as nn
    import torch.nn.functional as F
except ImportError as missing:
    sys.exit(f"torch_net.py: {missing} (on Debian: apt-get install python3-torch python3-numpy, and run /usr/bin/python3)")


class SPAdaIN(nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.conv_weight = nn.Conv1d(3, channels, 1)
        self.conv_bias = nn.Conv1d(3, channels, 1)

    def forward(self, x, identity):
        return self.conv_weight(identity) * F.instance_norm(x) + self.conv_bias(identity)


class ResBlock(nn.Module):
    def __init__(self, channels):
        super().__init__()
        for name in ("spadain1", "spadain2", "spadain_res"):
            setattr(self, name, SPAdaIN(channels))
        for name in ("conv1", "conv2", "conv_res"):
            setattr(self, name, nn.Conv1d(channels, channels, 1))

    def forward(self, x, identity):
        y = F.relu(self.conv1(self.spadain1(x, identity)))
        y = F.relu(self.conv2(self.spadain2(y, identity)))
        return y + F.relu(self.conv_res(self.spadain_res(x, identity)))


class Encoder(nn.Module):
    def __init__(self, bottleneck):
        super().__init__()
        self.conv1 = nn.Conv1d(3, 64, 1)
        self.conv2 = nn.Conv1d(64, 128, 1)
        self.conv3 = nn.Conv1d(128, bottleneck, 1)

    def forward(self, x):
        for conv in (self.conv1, self.conv2, self.conv3):
            x = F.relu(F.instance_norm(conv(x)))
        return x


class Decoder(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.conv1 = nn.Conv1d(width, width, 1)
        self.spadain_block1 = ResBlock(width)
        self.conv2 = nn.Conv1d(width, width // 2, 1)
        self.spadain_block2 = ResBlock(width // 2)
        self.conv3 = nn.Conv1d(width // 2, width // 4, 1)
        self.spadain_block3 = ResBlock(width // 4)
        self.conv4 = nn.Conv1d(width // 4, 3, 1)

    def forward(self, x, identity):
        x = self.spadain_block1(self.conv1(x), identity)
        x = self.spadain_block2(self.conv2(x), identity)
        x = self.spadain_block3(self.conv3(x), identity)
        return torch.tanh(self.conv4(x))


class Net(nn.Module):
    def __init__(self, bottleneck):
        super().__init__()
        self.encoder = Encoder(bottleneck)
        self.decoder = Decoder(bottleneck + 3)

    def forward(self, pose, identity):
        return self.decoder(torch.cat([self.encoder(pose), identity], dim=1), identity)


def reference_blas():
    """Whether PyTorch runs on the reference BLAS, which is ten times slower than OpenBLAS (Debian's link without the latter)."""
    try:
        with open("/proc/self/maps") as maps:
            return "/blas/libblas.so" in maps.read()
    except OSError:
        return False


def read_case(path):
    with open(path, "rb") as file:
        data = file.read()
    size = struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:8 + size])
    header.pop("__metadata__", None)
    tensors = {}
    for name, entry in header.items():
        begin, end = (8 + size + offset for offset in entry["data_offsets"])
        tensors[name] = torch.from_numpy(numpy.frombuffer(data[begin:end], "<f4").reshape(entry["shape"]).copy())
    return tensors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--mode", choices=("traced", "eager"), default="traced")
    arguments = parser.parse_args()
    if arguments.threads < 1 or arguments.repeats < 1:
        parser.error("--threads and --repeats must be at least 1")
    if reference_blas():
        sys.exit("torch_net.py: this PyTorch runs on the reference BLAS, which would make it look ten times slower than it is "
                 "(on Debian: apt-get install libopenblas0-pthread)")
    torch.set_num_threads(arguments.threads)
    try:
        tensors = read_case(arguments.case)
        pose, identity, expected = (tensors.pop(name).T.unsqueeze(0).contiguous() for name in ("pose", "identity", "result"))
        net = Net(tensors["encoder.conv3.bias"].numel())
        net.load_state_dict(tensors)
    except (OSError, KeyError, ValueError, RuntimeError, struct.error) as error:
        sys.exit(f"torch_net.py: {arguments.case}: {error}")
    net.eval()
    with torch.inference_mode():
        run = net
        if arguments.mode == "traced":
            run = torch.jit.freeze(torch.jit.trace(net, (pose, identity)))
            run(pose, identity)  # the first calls profile and compile
            run(pose, identity)
        error = float((run(pose, identity) - expected).norm() / expected.norm())
        if not error < 1e-4:
            sys.exit(f"torch_net.py: another result than expected: relative error {error:.2e}")
        seconds = []
        for _ in range(arguments.repeats):
            start = time.perf_counter()
            run(pose, identity)
            seconds.append(time.perf_counter() - start)
    seconds.sort()
    print(json.dumps({"peer": f"PyTorch {torch.__version__} {arguments.mode}", "threads": arguments.threads,
                      "seconds_min": round(seconds[0], 6), "seconds_median": round(seconds[len(seconds) // 2], 6),
                      "error": float(f"{error:.3g}")}))


if __name__ == "__main__":
    main()
