"""Writes pickles opcode by opcode, so that the tests need neither torch, chumpy nor scipy, and can name any function."""

import struct


class Global:
    def __init__(self, module, name):
        self.module, self.name = module, name


class Reduce:
    """function(*arguments), then optionally a state (BUILD) and dictionary items (SETITEMS)."""

    def __init__(self, function, arguments, state=None, items=None):
        self.function, self.arguments, self.state, self.items = function, arguments, state, items


class Persistent:
    def __init__(self, pid):
        self.pid = pid


def _opcodes(value):
    if isinstance(value, Global):
        return b"c" + f"{value.module}\n{value.name}\n".encode()
    if isinstance(value, Persistent):
        return _opcodes(value.pid) + b"Q"
    if isinstance(value, Reduce):
        out = _opcodes(value.function) + _opcodes(tuple(value.arguments)) + b"R"
        if value.items is not None:
            out += _pairs(value.items)
        if value.state is not None:
            out += _opcodes(value.state) + b"b"
        return out
    if value is None:
        return b"N"
    if value is True or value is False:
        return b"\x88" if value else b"\x89"
    if isinstance(value, int):
        length = value.bit_length() // 8 + 1
        return b"\x8a" + bytes([length]) + value.to_bytes(length, "little", signed=True)
    if isinstance(value, str):
        return b"X" + struct.pack("<I", len(value.encode())) + value.encode()
    if isinstance(value, bytes):  # a Python 2 str
        return b"T" + struct.pack("<I", len(value)) + value
    if isinstance(value, tuple):
        return b"(" + b"".join(map(_opcodes, value)) + b"t"
    if isinstance(value, list):
        return b"](" + b"".join(map(_opcodes, value)) + b"e"
    if isinstance(value, dict):
        return b"}" + _pairs(value)
    raise TypeError(type(value))


def _pairs(items):
    return b"(" + b"".join(_opcodes(key) + _opcodes(value) for key, value in items.items()) + b"u"


def dumps(value):
    return b"\x80\x02" + _opcodes(value) + b"."
