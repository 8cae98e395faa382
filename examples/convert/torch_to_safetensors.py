#!/usr/bin/env python3
"""Turns a PyTorch checkpoint of a pose transfer network into an npt weights file (safetensors).

Reads both formats of torch.save: the one before PyTorch 1.6 (pickles, then raw storages) and the zip archive since. Needs neither
PyTorch nor anything else beyond Python 3, and runs no code of the checkpoint.

A checkpoint does not say which variant of the network it was trained for, and all variants have the same tensors, so say it here:
the authors' released networks are --order relu_conv --output-scale 2, with --feature per-vertex (the human network) or pooled (the
compact one, for animals).

  torch_to_safetensors.py model.pth weights.safetensors --order relu_conv --feature per-vertex --output-scale 2
"""

import argparse
import array
import collections
import io
import math
import os
import pickle
import struct
import sys
import zipfile
import zlib

from convert_common import ConvertError, run, unpickle, write_safetensors

LEGACY_MAGIC = 0x1950A86A20F9469CFC6C
LEGACY_PROTOCOL = 1001

# Storage class of torch -> (size of an element, safetensors dtype). Only floating point makes a weight.
STORAGES = {
    "FloatStorage": (4, "F32"),
    "DoubleStorage": (8, "F64"),
    "HalfStorage": (2, "F16"),
    "BFloat16Storage": (2, "BF16"),
    "LongStorage": (8, "I64"),
    "IntStorage": (4, "I32"),
    "ShortStorage": (2, "I16"),
    "CharStorage": (1, "I8"),
    "ByteStorage": (1, "U8"),
    "BoolStorage": (1, "BOOL"),
}


class Inert:
    """Base of the stand-ins: a pickle can't change one after it is made."""

    def __setstate__(self, state):
        raise pickle.UnpicklingError(f"found a state for a {type(self).__name__}")


class StateDict(collections.OrderedDict):
    """torch hangs version numbers (`_metadata`) on the OrderedDict of a state dict. They are dropped."""

    def __setstate__(self, state):
        pass


class StorageType(Inert):
    """Stands for torch.FloatStorage and its kin. Not callable: a pickle can only hand it back."""

    def __init__(self, name):
        self.name = name
        self.element_size, self.dtype = STORAGES[name]


class Storage(Inert):
    """A block of `count` elements; `data` are its bytes, which legacy files deliver after the pickle."""

    def __init__(self, kind, count, data=None):
        self.kind, self.count, self.data = kind, count, data


class Tensor(Inert):
    """A view of a storage, as torch._utils._rebuild_tensor_v2 describes it."""

    def __init__(self, storage, offset, shape, stride, requires_grad=None, hooks=None, metadata=None):
        numbers = (offset, *shape, *stride)
        if not isinstance(storage, Storage) or len(shape) != len(stride) or len(shape) > 8:
            raise pickle.UnpicklingError("found a damaged description of a tensor")
        if not all(type(number) is int and 0 <= number < 2**48 for number in numbers):
            raise pickle.UnpicklingError(f"found a tensor with offset {offset}, shape {shape}, stride {stride}")
        self.storage, self.offset, self.shape, self.stride = storage, offset, tuple(shape), tuple(stride)

    def contiguous_bytes(self):
        """The elements in row-major order. Checks that they lie within the storage."""
        size, data = self.storage.kind.element_size, self.storage.data
        count = math.prod(self.shape)
        if count == 0:
            return b""
        last = self.offset + sum((n - 1) * s for n, s in zip(self.shape, self.stride))
        if last >= self.storage.count:
            raise ConvertError(f"found element {last} of a storage of {self.storage.count}")
        row_major, step = [], 1
        for n in reversed(self.shape):
            row_major.insert(0, step)
            step *= n
        if all(n == 1 or s == r for n, s, r in zip(self.shape, self.stride, row_major)):
            return data[self.offset * size : (self.offset + count) * size]
        if count > self.storage.count:
            raise ConvertError("found a tensor that repeats the elements of its storage")
        indices = [self.offset]
        for n, s in zip(self.shape, self.stride):
            indices = [base + i * s for base in indices for i in range(n)]
        return b"".join(data[i * size : (i + 1) * size] for i in indices)


def rebuild_tensor(*arguments):
    try:
        return Tensor(*arguments)
    except (TypeError, ValueError):
        raise pickle.UnpicklingError("found a damaged description of a tensor") from None


ALLOWED = {("collections", "OrderedDict"): StateDict,
           ("torch._utils", "_rebuild_tensor_v2"): rebuild_tensor}
ALLOWED.update({("torch", name): StorageType(name) for name in STORAGES})


def storage_of(pid, storages, read_data=None):
    """Resolves ('storage', type, key, device, element count, ...), the only persistent id of a checkpoint of tensors."""
    if not (isinstance(pid, tuple) and len(pid) >= 5 and pid[0] == "storage"):
        kind = pid[0] if isinstance(pid, tuple) and pid else pid
        raise pickle.UnpicklingError(f"found a persistent id of kind '{kind}', expected 'storage'")
    _, kind, key, _, count = pid[:5]
    if not isinstance(kind, StorageType) or not isinstance(key, str) or type(count) is not int or count < 0:
        raise pickle.UnpicklingError("found a damaged description of a storage")
    if len(pid) > 5 and pid[5] is not None:
        raise pickle.UnpicklingError("found a storage that is a view of another one (PyTorch before 0.4)")
    if key not in storages:
        storages[key] = Storage(kind, count, read_data(key, kind, count) if read_data else None)
    return storages[key]


def read_zip(path):
    """Format since 1.6: FOLDER/data.pkl and a file FOLDER/data/KEY for each storage."""
    try:
        archive = zipfile.ZipFile(path)
        names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise ConvertError(f"{path}: found a damaged zip archive ({error}), expected a PyTorch checkpoint") from None
    with archive:
        pickles = [name for name in names if name.endswith("data.pkl") and name.count("/") == 1]
        if len(pickles) != 1:
            raise ConvertError(f"{path}: found {len(pickles)} entries FOLDER/data.pkl, expected one: not a PyTorch checkpoint")
        folder = pickles[0].split("/")[0]

        def read_entry(name, limit=None):
            try:
                size = archive.getinfo(name).file_size
                if limit is not None and size != limit:
                    raise ConvertError(f"{path}: {name}: found {size} bytes, expected {limit}")
                if size > os.path.getsize(path) * 1100:  # deflate reaches a factor of 1032
                    raise ConvertError(f"{path}: {name}: found a length of {size} bytes, more than the file can hold")
                return archive.read(name)
            except KeyError:
                raise ConvertError(f"{path}: found no entry {name}") from None
            except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError, RuntimeError, ValueError,
                    zlib.error) as error:
                raise ConvertError(f"{path}: {name}: {error}") from None

        if f"{folder}/byteorder" in names and read_entry(f"{folder}/byteorder") != b"little":
            raise ConvertError(f"{path}: found big-endian data, expected little-endian")
        storages = {}

        def read_storage(key, kind, count):
            return read_entry(f"{folder}/data/{key}", count * kind.element_size)

        return unpickle(io.BytesIO(read_entry(pickles[0])), path, pickles[0], ALLOWED,
                        lambda pid: storage_of(pid, storages, read_storage), encoding="utf-8")


def read_legacy(path):
    """Format before 1.6: pickles (magic, protocol, system, object, storage keys), then element count and data of each."""
    with open(path, "rb") as stream:
        size = os.path.getsize(path)
        storages = {}
        magic = unpickle(stream, path, "magic number", {})
        if magic != LEGACY_MAGIC:
            raise ConvertError(f"{path}: found a pickle without PyTorch's magic number, expected a file of torch.save")
        protocol = unpickle(stream, path, "protocol version", {})
        if protocol != LEGACY_PROTOCOL:
            raise ConvertError(f"{path}: found protocol {protocol!r}, expected {LEGACY_PROTOCOL}")
        system = unpickle(stream, path, "system information", {})
        if not isinstance(system, dict) or system.get("little_endian") is not True:
            raise ConvertError(f"{path}: found big-endian data, expected little-endian")
        content = unpickle(stream, path, "object", ALLOWED, lambda pid: storage_of(pid, storages), encoding="utf-8")
        keys = unpickle(stream, path, "storage keys", {})
        if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys) or set(keys) != set(storages):
            raise ConvertError(f"{path}: storage keys: the list does not match the tensors")
        for key in keys:
            storage = storages[key]
            place = f"storage '{key}' at byte {stream.tell()}"
            prefix = stream.read(8)
            count = struct.unpack("<q", prefix)[0] if len(prefix) == 8 else None
            if count is None:
                raise ConvertError(f"{path}: {place}: found the end of the file")
            if count != storage.count:
                raise ConvertError(f"{path}: {place}: found {count} elements, expected {storage.count}")
            length = count * storage.kind.element_size
            if length > size - stream.tell():
                raise ConvertError(f"{path}: {place}: found {size - stream.tell()} bytes, expected {length}")
            storage.data = stream.read(length)
        return content


def read_checkpoint(path):
    try:
        with open(path, "rb") as stream:
            start = stream.read(4)
    except OSError as error:
        raise ConvertError(f"{path}: cannot read: {error.strerror}") from None
    if not start:
        raise ConvertError(f"{path}: found an empty file, expected a PyTorch checkpoint")
    if start[:2] == b"PK":
        return read_zip(path)
    if start[:1] == b"\x80":
        return read_legacy(path)
    raise ConvertError(f"{path}: byte 0: found {start!r}, expected a PyTorch checkpoint (a zip archive or a pickle)")


def tensors_of(content, path, key):
    """The state dict: the content itself, its entry `key`, or its only entry that holds tensors."""
    def is_state(value):
        return isinstance(value, dict) and any(isinstance(entry, Tensor) for entry in value.values())

    if key is not None:
        if not isinstance(content, dict) or key not in content:
            raise ConvertError(f"{path}: found no entry '{key}'")
        content = content[key]
    elif isinstance(content, dict) and not is_state(content):
        states = [name for name, value in content.items() if is_state(value)]
        if len(states) > 1:
            raise ConvertError(f"{path}: found tensors in {', '.join(map(repr, states))}: choose one with --key")
        content = content[states[0]] if states else content
    if not is_state(content):
        raise ConvertError(f"{path}: found no tensors, expected a state dict (torch.save(model.state_dict(), ...))")
    strip = all(isinstance(name, str) and name.startswith("module.") for name in content)
    tensors = {}
    for name, value in content.items():
        name = name[len("module."):] if strip else name
        if not isinstance(name, str) or not isinstance(value, Tensor):
            raise ConvertError(f"{path}: entry {name!r}: found {type(value).__name__}, expected a tensor")
        tensors[name] = value
    return tensors


def expected_shapes(bottleneck):
    """Names and shapes of the network's tensors, in the order of its state dict."""
    shapes = collections.OrderedDict()

    def conv(name, channels_in, channels_out):
        shapes[name + ".weight"] = (channels_out, channels_in, 1)
        shapes[name + ".bias"] = (channels_out,)

    wide = bottleneck + 3
    widths = [wide, wide // 2, wide // 4]
    conv("encoder.conv1", 3, 64)
    conv("encoder.conv2", 64, 128)
    conv("encoder.conv3", 128, bottleneck)
    for number, (channels_in, channels_out) in enumerate(zip([wide] + widths, widths + [3]), 1):
        conv(f"decoder.conv{number}", channels_in, channels_out)
    for number, width in enumerate(widths, 1):
        for unit in ("1", "2", "_res"):
            conv(f"decoder.spadain_block{number}.spadain{unit}.conv_weight", 3, width)
            conv(f"decoder.spadain_block{number}.spadain{unit}.conv_bias", 3, width)
            conv(f"decoder.spadain_block{number}.conv{unit}", width, width)
    return shapes


def check_tensors(tensors, path):
    """Every name and shape at once, so that one look tells which network a foreign checkpoint holds."""
    probe = "encoder.conv3.weight"
    if probe not in tensors or len(tensors[probe].shape) != 3 or tensors[probe].shape[0] < 1:
        found = f"shape {list(tensors[probe].shape)}" if probe in tensors else "no such tensor"
        raise ConvertError(f"{path}: {probe}: found {found}, expected shape [bottleneck, 128, 1]: not a pose transfer network"
                           f" (it holds {', '.join(sorted(tensors)[:6])}, ...)")
    bottleneck = tensors[probe].shape[0]
    shapes = expected_shapes(bottleneck)
    problems = [f"{name}: missing, expected shape {list(shape)}" for name, shape in shapes.items() if name not in tensors]
    problems += [f"{name}: found shape {list(tensors[name].shape)}, expected {list(shape)}"
                 for name, shape in shapes.items() if name in tensors and tensors[name].shape != shape]
    problems += [f"{name}: found a tensor that the network does not have" for name in tensors if name not in shapes]
    if problems:
        raise ConvertError(f"{path}: {len(problems)} tensors do not fit a network of bottleneck {bottleneck}:\n  "
                           + "\n  ".join(problems))
    return bottleneck, shapes


def as_float32(tensor, name, path, to_f32):
    """The tensor's bytes as little-endian fp32; other types only on request, since digits are lost or made up."""
    dtype = tensor.storage.kind.dtype
    try:
        data = tensor.contiguous_bytes()
    except ConvertError as error:
        raise ConvertError(f"{path}: {name}: {error}") from None
    if dtype not in ("F32", "F64", "F16", "BF16"):
        raise ConvertError(f"{path}: {name}: found {dtype}, expected F32")
    if dtype != "F32" and not to_f32:
        raise ConvertError(f"{path}: {name}: found {dtype}, expected F32 (--to-f32 converts it)")
    if dtype == "F32":
        values = array.array("f", data)
    elif dtype == "BF16":
        values = array.array("f", b"".join(b"\0\0" + data[i : i + 2] for i in range(0, len(data), 2)))
    else:
        values = array.array("f", struct.unpack(f"<{math.prod(tensor.shape)}{'d' if dtype == 'F64' else 'e'}", data))
    wrong = next((i for i, value in enumerate(values) if not math.isfinite(value)), None)
    if wrong is not None:
        raise ConvertError(f"{path}: {name}: element {wrong}: found {values[wrong]}, expected a finite number")
    return values.tobytes()


def positive(text):
    value = float(text)
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"found {text}, expected a positive number")
    return value


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", help="file of torch.save: a state dict, or a dict that holds one")
    parser.add_argument("weights", help="safetensors file to write")
    parser.add_argument("--order", required=True, choices=["conv_relu", "relu_conv"],
                        help="order within a unit after SPAdaIN: the paper's text (conv_relu) or the released code (relu_conv)")
    parser.add_argument("--feature", required=True, choices=["per-vertex", "pooled"],
                        help="pose feature of the decoder: one a vertex, or the maximum over vertices")
    parser.add_argument("--output-scale", required=True, type=positive, metavar="S",
                        help="the output is S tanh(x): the paper 1, the released code 2")
    parser.add_argument("--key", help="entry of the checkpoint that holds the state dict, if there are several")
    parser.add_argument("--to-f32", action="store_true", help="convert half, bfloat16 and double tensors")
    parser.add_argument("--domain", help="what the network was trained on, for people (human, animal)")
    parser.add_argument("--unit", help="unit of the training meshes (metre)")
    parser.add_argument("--normalisation", choices=["sphere", "centre", "none"],
                        help="how inputs were normalised in training: the paper's unit sphere, or centred only (released code)")
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    if sys.byteorder != "little":
        raise ConvertError("this script needs a little-endian machine")
    tensors = tensors_of(read_checkpoint(arguments.checkpoint), arguments.checkpoint, arguments.key)
    bottleneck, shapes = check_tensors(tensors, arguments.checkpoint)
    output = {name: ("F32", shape, as_float32(tensors[name], name, arguments.checkpoint, arguments.to_f32))
              for name, shape in shapes.items()}
    metadata = {"order": arguments.order, "feature": arguments.feature, "output_scale": arguments.output_scale,
                "bottleneck": bottleneck}
    metadata.update({key: value for key in ("domain", "unit", "normalisation")
                     if (value := getattr(arguments, key)) is not None})
    write_safetensors(arguments.weights, output, metadata)
    count = sum(math.prod(shape) for shape in shapes.values())
    print(f"{arguments.weights}: {len(output)} tensors, {count} parameters, bottleneck {bottleneck}, "
          f"{arguments.order}, {arguments.feature}, output scale {arguments.output_scale:g}")


if __name__ == "__main__":
    run(main)
