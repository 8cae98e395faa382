"""What both converters share: errors that name file and place, pickles that can't run code, and safetensors output.

Python's pickle is a program: a file can name any function and have it called. RestrictedUnpickler knows a fixed list of names,
each mapped to a harmless stand-in, and refuses everything else before anything is called.
"""

import json
import os
import pickle
import struct
import sys
import tempfile


class ConvertError(Exception):
    """Bad input. The message reads "file: place: found X, expected Y"."""


class RestrictedUnpickler(pickle._Unpickler):
    """An unpickler that resolves only the names of `allowed`: (module, name) -> stand-in.

    The standard library's own one in Python: the one in C reserves gigabytes for a damaged index into its memo.
    """

    def __init__(self, stream, allowed, load_persistent=None, **options):
        super().__init__(stream, **options)
        self._allowed = allowed
        self._load_persistent = load_persistent

    def find_class(self, module, name):
        try:
            return self._allowed[module, name]
        except KeyError:
            raise pickle.UnpicklingError(f"found a reference to '{module}.{name}', which is not data: refused") from None

    def persistent_load(self, pid):
        if self._load_persistent is None:
            raise pickle.UnpicklingError("found a reference to something outside of the pickle")
        return self._load_persistent(pid)


def unpickle(stream, file, place, allowed, load_persistent=None, **options):
    """The next pickle of `stream`, or a ConvertError."""
    try:
        return RestrictedUnpickler(stream, allowed, load_persistent, **options).load()
    except ConvertError:
        raise
    except EOFError:
        raise ConvertError(f"{file}: {place}: found the end of the file inside of a pickle") from None
    except Exception as error:  # a damaged pickle can raise nearly anything; nothing it names has been called
        raise ConvertError(f"{file}: {place}: {error or type(error).__name__}") from None


def read_safetensors(path, holding=""):
    """Metadata, and {name: (dtype, shape, bytes)}. holding: what the file should hold, for the message."""
    try:
        with open(path, "rb") as stream:
            data = stream.read()
    except OSError as error:
        raise ConvertError(f"{path}: cannot read: {error.strerror}") from None
    try:
        length = struct.unpack("<Q", data[:8])[0]
        header = json.loads(data[8 : 8 + length])
        metadata = header.pop("__metadata__", {})
        tensors = {}
        for name, entry in header.items():
            begin, end = entry["data_offsets"]
            tensors[name] = (entry["dtype"], entry["shape"], data[8 + length + begin : 8 + length + end])
    except (struct.error, ValueError, KeyError, TypeError, AttributeError):
        raise ConvertError(f"{path}: found no safetensors file{holding}") from None
    return metadata, tensors


def part(path, prefix, bare):
    """Metadata and tensors below the prefix; where there are none and `bare` says so, those of the file itself."""
    metadata, tensors = read_safetensors(path)
    inside = {name[len(prefix) :]: tensor for name, tensor in tensors.items() if name.startswith(prefix)}
    if inside:
        return {key[len(prefix) :]: text for key, text in metadata.items() if key.startswith(prefix)}, inside
    if not bare:
        raise ConvertError(f"{path}: tensors: found none below {prefix}, expected some")
    return (
        {key: text for key, text in metadata.items() if "/" not in key},
        {name: tensor for name, tensor in tensors.items() if "/" not in name},
    )


def read_floats(path, prefix=""):
    """(metadata, {name: array}) of F32 tensors alone, all of whose numbers are finite. Needs numpy.
    prefix: of a file that has tensors below it only those, as part() names them."""
    import numpy as np  # not every converter that includes this file has it

    metadata, stored = part(path, prefix, bare=True) if prefix else read_safetensors(path)
    tensors = {}
    for name, (dtype, shape, data) in stored.items():
        if dtype != "F32":
            raise ConvertError(f"{path}: {name}: found {dtype}, expected F32")
        try:
            tensors[name] = np.frombuffer(data, "<f4").reshape(shape)
        except ValueError:
            raise ConvertError(f"{path}: {name}: found {len(data)} bytes, expected shape {shape}") from None
        if not np.isfinite(tensors[name]).all():
            raise ConvertError(f"{path}: {name}: found a number that is not finite")
    return metadata, tensors


def write_safetensors(path, tensors, metadata):
    """Writes {name: (dtype, shape, bytes)} in the given order. The file appears under its name only when it is complete."""
    header, offset = {"__metadata__": {key: str(value) for key, value in metadata.items()}}, 0
    for name, (dtype, shape, data) in tensors.items():
        header[name] = {"dtype": dtype, "shape": list(shape), "data_offsets": [offset, offset + len(data)]}
        offset += len(data)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    folder = os.path.dirname(os.path.abspath(path))
    partial = None
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix=os.path.basename(path) + ".", delete=False) as out:
            partial = out.name
            out.write(struct.pack("<Q", len(text)))
            out.write(text)
            for _, _, data in tensors.values():
                out.write(data)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(partial, 0o666 & ~umask)  # temporary files are private, results are not
        os.replace(partial, path)
    except OSError as error:
        if partial is not None and os.path.exists(partial):
            os.unlink(partial)
        raise ConvertError(f"{path}: cannot write: {error.strerror}") from None


def write_floats(path, tensors, metadata):
    """Writes {name: array} as F32. Needs numpy."""
    import numpy as np

    write_safetensors(path, {name: ("F32", array.shape, np.asarray(array, "<f4").tobytes()) for name, array in tensors.items()}, metadata)


def run(main):
    """Runs a converter's main(): a ConvertError becomes one line on stderr and exit code 1."""
    try:
        main()
    except ConvertError as error:
        sys.exit(f"error: {error}")
    except BrokenPipeError:
        sys.exit(1)
