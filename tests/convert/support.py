"""Runs a converter as a user would, and reads back what it wrote."""

import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "examples" / "convert"


def safetensors_bytes(metadata, tensors):
    """A file of {name: (dtype, shape, bytes)}; a dtype may be another than that of the bytes."""
    header, data = {"__metadata__": metadata}, b""
    for name, (dtype, shape, raw) in tensors.items():
        header[name] = {"dtype": dtype, "shape": list(shape), "data_offsets": [len(data), len(data) + len(raw)]}
        data += raw
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def read_safetensors(path):
    """{name: (dtype, shape, bytes)} and the metadata. Checks the layout on the way."""
    data = pathlib.Path(path).read_bytes()
    length = struct.unpack("<Q", data[:8])[0]
    assert data[8:9] == b"{" and length % 8 == 0
    header = json.loads(data[8 : 8 + length])
    metadata, offset, tensors = header.pop("__metadata__"), 0, {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        assert begin == offset, name
        offset = end
        tensors[name] = (entry["dtype"], entry["shape"], data[8 + length + begin : 8 + length + end])
    assert 8 + length + offset == len(data)
    assert all(isinstance(value, str) for value in metadata.values())
    return tensors, metadata


class ConverterTest(unittest.TestCase):
    script = None
    options = ()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.output = self.folder / "out.safetensors"

    def file(self, name, data):
        (self.folder / name).write_bytes(data)
        return self.folder / name

    def convert(self, path, *options):
        command = [sys.executable, SCRIPTS / self.script, path, self.output, *self.options, *options]
        environment = dict(os.environ, PYTHONDONTWRITEBYTECODE="1")
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, env=environment)

    def converted(self, path, *options):
        result = self.convert(path, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return read_safetensors(self.output)

    def refused(self, path, *expected, options=()):
        """The converter names the file and every expected text, in one message without a traceback, and writes nothing."""
        before = sorted(entry.name for entry in self.folder.iterdir())
        result = self.convert(path, *options)
        self.assertNotEqual(result.returncode, 0)
        self.assertNotIn("Traceback", result.stderr)
        self.assertTrue(result.stderr.startswith("error: ") or "usage:" in result.stderr, result.stderr)
        for text in expected:
            self.assertIn(text, result.stderr)
        self.assertEqual(sorted(entry.name for entry in self.folder.iterdir()), before)
