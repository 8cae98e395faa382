"""torch_to_safetensors.py: both checkpoint formats, exact values, and everything that has to be refused."""

import array
import io
import math
import os
import struct
import sys
import unittest
import zipfile

from pickle_bytes import Global, Persistent, Reduce, dumps
from support import SCRIPTS, ConverterTest

sys.dont_write_bytecode = True
sys.path.insert(0, str(SCRIPTS))
from torch_to_safetensors import expected_shapes  # noqa: E402

try:
    import torch
except ImportError:
    torch = None

BOTTLENECK = 7
FORMATS = {"FloatStorage": "f", "DoubleStorage": "d", "HalfStorage": "e", "LongStorage": "q"}


def values_of(shapes):
    """Distinct numbers that half precision holds exactly."""
    values, count = {}, 0
    for name, shape in shapes.items():
        n = math.prod(shape)
        values[name] = [((count + i) % 2003 - 1000) / 64 for i in range(n)]
        count += n
    return values


def row_major(shape):
    return tuple(math.prod(shape[i + 1 :]) for i in range(len(shape)))


class Checkpoint:
    """A state dict to be written in either format; tests change its parts."""

    def __init__(self, shapes=None, storage="FloatStorage", prefix=""):
        self.shapes = dict(shapes or expected_shapes(BOTTLENECK))
        self.values = values_of(self.shapes)
        self.storage, self.prefix = storage, prefix
        self.strides = {name: row_major(shape) for name, shape in self.shapes.items()}
        self.offset = 0

    def raw(self, name):
        values = [0.0] * self.offset + list(self.values[name])
        return struct.pack(f"<{len(values)}{FORMATS[self.storage]}", *values)

    def state(self, legacy):
        entries = {}
        for key, (name, shape) in enumerate(self.shapes.items()):
            pid = ("storage", Global("torch", self.storage), str(key), "cpu", self.offset + len(self.values[name]))
            pid += (None,) if legacy else ()
            hooks = Reduce(Global("collections", "OrderedDict"), ())
            arguments = (Persistent(pid), self.offset, tuple(shape), self.strides[name], False, hooks)
            entries[self.prefix + name] = Reduce(Global("torch._utils", "_rebuild_tensor_v2"), arguments)
        metadata = {"_metadata": Reduce(Global("collections", "OrderedDict"), ())}
        return Reduce(Global("collections", "OrderedDict"), (), state=metadata, items=entries)

    def legacy(self, wrap=lambda state: state):
        system = {"protocol_version": 1001, "little_endian": True, "type_sizes": {"short": 2, "int": 4, "long": 4}}
        keys = [str(key) for key in range(len(self.shapes))]
        out = b"".join(map(dumps, (0x1950A86A20F9469CFC6C, 1001, system, wrap(self.state(True)), keys)))
        for name in self.shapes:
            out += struct.pack("<q", self.offset + len(self.values[name])) + self.raw(name)
        return out

    def zip(self, wrap=lambda state: state):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("archive/data.pkl", dumps(wrap(self.state(False))))
            for key, name in enumerate(self.shapes):
                archive.writestr(f"archive/data/{key}", self.raw(name))
            archive.writestr("archive/version", "3\n")
        return out.getvalue()


class TorchConverter(ConverterTest):
    script = "torch_to_safetensors.py"
    options = ("--order", "relu_conv", "--feature", "pooled", "--output-scale", "2")

    def assert_holds(self, tensors, checkpoint):
        self.assertEqual(list(tensors), list(checkpoint.shapes))
        for name, (dtype, shape, data) in tensors.items():
            self.assertEqual((dtype, tuple(shape)), ("F32", tuple(checkpoint.shapes[name])), name)
            self.assertEqual(list(array.array("f", data)), checkpoint.values[name], name)


class GoodCheckpoints(TorchConverter):
    def test_both_formats_keep_every_value(self):
        for data in (Checkpoint().legacy(), Checkpoint().zip()):
            tensors, metadata = self.converted(self.file("a.pth", data))
            self.assert_holds(tensors, Checkpoint())
            self.assertEqual(metadata, {"order": "relu_conv", "feature": "pooled", "output_scale": "2.0", "bottleneck": "7"})

    def test_optional_metadata_is_kept(self):
        options = ("--domain", "animal", "--unit", "metre", "--normalisation", "centre")
        _, metadata = self.converted(self.file("a.pth", Checkpoint().zip()), *options)
        self.assertEqual([metadata[key] for key in ("domain", "unit", "normalisation")], ["animal", "metre", "centre"])

    def test_prefix_of_data_parallel_is_stripped(self):
        tensors, _ = self.converted(self.file("a.pth", Checkpoint(prefix="module.").legacy()))
        self.assert_holds(tensors, Checkpoint())

    def test_state_dict_inside_of_a_training_checkpoint_is_found(self):
        wrap = lambda state: {"epoch": 3, "state_dict": state}
        for data in (Checkpoint().legacy(wrap), Checkpoint().zip(wrap)):
            tensors, _ = self.converted(self.file("a.pth", data))
            self.assert_holds(tensors, Checkpoint())
        self.refused(self.file("a.pth", Checkpoint().zip(wrap)), "no entry 'net'", options=("--key", "net"))

    def test_other_precision_is_converted_on_request_only(self):
        for storage, dtype in (("DoubleStorage", "F64"), ("HalfStorage", "F16")):
            checkpoint = Checkpoint(storage=storage)
            path = self.file("a.pth", checkpoint.zip())
            self.refused(path, "a.pth", "encoder.conv1.weight", dtype, "--to-f32")
            tensors, _ = self.converted(path, "--to-f32")
            self.assert_holds(tensors, checkpoint)
            self.output.unlink()

    def test_strided_tensors_are_put_in_row_order(self):
        name, (rows, columns) = "encoder.conv2.weight", (128, 64)
        checkpoint = Checkpoint()
        wanted = checkpoint.values[name]
        checkpoint.offset = 5
        checkpoint.strides[name] = (1, rows, 1)
        checkpoint.values[name] = [wanted[r * columns + c] for c in range(columns) for r in range(rows)]
        tensors, _ = self.converted(self.file("a.pth", checkpoint.legacy()))
        self.assertEqual(list(array.array("f", tensors[name][2])), wanted)

    def test_released_size_is_understood(self):
        shapes = expected_shapes(1024)
        self.assertEqual(shapes["decoder.conv3.weight"], (256, 513, 1))
        self.assertEqual(shapes["decoder.spadain_block2.spadain_res.conv_bias.weight"], (513, 3, 1))
        self.assertEqual(len(shapes), 68)

    @unittest.skipIf(torch is None, "torch is not installed")
    def test_files_of_torch_itself(self):
        checkpoint = Checkpoint()
        state = {name: torch.tensor(checkpoint.values[name]).reshape(shape) for name, shape in checkpoint.shapes.items()}
        for zip_format in (True, False):
            torch.save(state, self.folder / "a.pth", _use_new_zipfile_serialization=zip_format)
            tensors, _ = self.converted(self.folder / "a.pth")
            self.assert_holds(tensors, checkpoint)


class BadCheckpoints(TorchConverter):
    def test_the_variant_has_no_default(self):
        path = self.file("a.pth", Checkpoint().zip())
        for missing in range(0, len(self.options), 2):
            options = self.options[:missing] + self.options[missing + 2 :]
            self.options, kept = options, self.options
            self.refused(path, "required")
            self.options = kept

    def test_code_is_never_run(self):
        marker = self.folder / "run"
        for module, name in (("os", "system"), ("posix", "system"), ("builtins", "eval"), ("__builtin__", "exec")):
            attack = lambda state: {"state_dict": state, "x": Reduce(Global(module, name), (f"echo > '{marker}'",))}
            for data in (Checkpoint().legacy(attack), Checkpoint().zip(attack)):
                self.refused(self.file("a.pth", data), "a.pth", f".{name}", "refused")
        attack = dumps(Reduce(Global("os", "system"), (f"echo > '{marker}'",)))
        self.refused(self.file("a.pth", attack), "os.system", "magic number")
        self.assertFalse(marker.exists())

    def test_stand_ins_cannot_be_tampered_with(self):
        tamper = lambda state: {"a": state, "b": Reduce(Global("torch._utils", "_rebuild_tensor_v2"), (1, 2, 3))}
        self.refused(self.file("a.pth", Checkpoint().zip(tamper)), "damaged description of a tensor")

        def with_state(state):
            next(iter(state.items.values())).state = {"shape": "oops"}
            return state

        self.refused(self.file("a.pth", Checkpoint().zip(with_state)), "found a state for a Tensor")

    def test_every_truncation_is_refused(self):
        for data in (Checkpoint().legacy(), Checkpoint().zip()):
            for length in [0, 1, 2, 3, 10, 40] + [len(data) * k // 12 for k in range(1, 12)] + [len(data) - 1]:
                self.refused(self.file("a.pth", data[:length]), "a.pth")

    def test_all_misfits_are_listed_at_once(self):
        shapes = expected_shapes(BOTTLENECK)
        del shapes["decoder.conv4.bias"], shapes["encoder.conv1.weight"]
        shapes["decoder.conv2.weight"] = (5, 10)
        shapes["decoder.norm.weight"] = (5,)
        self.refused(self.file("a.pth", Checkpoint(shapes).zip()), "a.pth", "4 tensors", "bottleneck 7",
                     "decoder.conv4.bias: missing, expected shape [3]", "encoder.conv1.weight: missing",
                     "decoder.conv2.weight: found shape [5, 10], expected [5, 10, 1]", "decoder.norm.weight: found a tensor")

    def test_another_network_is_named_as_such(self):
        self.refused(self.file("a.pth", Checkpoint({"fc.weight": (3, 3)}).legacy()), "encoder.conv3.weight", "fc.weight")

    def test_numbers_that_are_not_finite_are_refused(self):
        for wrong in (math.nan, math.inf):
            checkpoint = Checkpoint()
            checkpoint.values["decoder.conv1.bias"][3] = wrong
            self.refused(self.file("a.pth", checkpoint.zip()), "decoder.conv1.bias", "element 3", str(wrong))

    def test_tensors_outside_of_their_storage_are_refused(self):
        checkpoint = Checkpoint()
        checkpoint.strides["encoder.conv2.weight"] = (65, 1, 1)
        self.refused(self.file("a.pth", checkpoint.zip()), "encoder.conv2.weight", "of a storage of 8192")

    def test_files_of_other_kinds_are_refused(self):
        self.refused(self.folder / "none.pth", "none.pth", "No such file")
        self.refused(self.file("a.pth", b""), "empty file")
        self.refused(self.file("a.pth", b"v 0 0 0\n"), "byte 0")
        self.refused(self.file("a.pth", dumps([1, 2])), "magic number")
        self.refused(self.file("a.pth", Checkpoint().zip(lambda state: [1, 2])), "found no tensors")
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w") as out:
            out.writestr("readme.txt", "hello")
        self.refused(self.file("a.pth", archive.getvalue()), "not a PyTorch checkpoint")

    def test_an_output_that_cannot_be_written_is_an_error(self):
        path = self.file("a.pth", Checkpoint().zip())
        self.output = self.folder / "no" / "out.safetensors"
        self.refused(path, os.path.join("no", "out.safetensors"), "cannot write")


if __name__ == "__main__":
    unittest.main()
