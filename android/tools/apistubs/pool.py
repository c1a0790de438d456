"""The constant pool of a class file (JVMS 4.4), and the values of constants in the text."""

from __future__ import annotations

import re
import struct

_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", '"': '"', "'": "'", "\\": "\\", "0": "\0"}
_ESCAPED = re.compile(r"\\(u([0-9a-fA-F]{4})|.)")
_NOT_FINITE = re.compile(r"\((-?[\d.]+)f?/(-?[\d.]+)f?\)$")
_LARGEST_FLOAT = 3.4028234663852886e38
STRINGS = ("String", "java.lang.String")


class Pool:
    """Constants, each once, in the order of their first use."""

    def __init__(self) -> None:
        self._entries: list[bytes] = []
        self._places: dict[tuple[object, ...], int] = {}
        self._next = 1
        self.nested: set[str] = set()
        """Binary names of nested classes that were named."""

    def packed(self) -> bytes:
        """As it stands in the class file, its count before it."""
        return struct.pack(">H", self._next) + b"".join(self._entries)

    def _add(self, key: tuple[object, ...], entry: bytes, width: int = 1) -> int:
        if key not in self._places:
            self._places[key] = self._next
            self._entries.append(entry)
            self._next += width
        return self._places[key]

    def utf8(self, text: str) -> int:
        """Text in the class file's own UTF-8: of surrogates and without a zero byte."""
        units = text.encode("utf-16-be", "surrogatepass")
        encoded = b"".join(_unit(unit) for (unit,) in struct.iter_unpack(">H", units))
        return self._add(("utf8", text), b"\x01" + struct.pack(">H", len(encoded)) + encoded)

    def class_(self, binary: str) -> int:
        """A class."""
        if "$" in binary:
            self.nested.add(binary)
        return self._add(("class", binary), b"\x07" + struct.pack(">H", self.utf8(binary)))

    def method(self, binary: str, name: str, descriptor: str) -> int:
        """A method of a class."""
        owner = self.class_(binary)
        signature = struct.pack(">HH", self.utf8(name), self.utf8(descriptor))
        named = self._add(("name", name, descriptor), b"\x0c" + signature)
        return self._add(("method", binary, name, descriptor), b"\x0a" + struct.pack(">HH", owner, named))

    def string(self, text: str) -> int:
        """A constant string."""
        return self._add(("string", text), b"\x08" + struct.pack(">H", self.utf8(text)))

    def number(self, type_: str, value: float) -> int:
        """A constant number of a primitive type."""
        if type_ == "long":
            return self._add((type_, value), b"\x05" + struct.pack(">q", value), width=2)
        if type_ == "double":
            return self._add((type_, repr(value)), b"\x06" + struct.pack(">d", value), width=2)
        if type_ == "float":
            return self._add((type_, repr(value)), b"\x04" + struct.pack(">f", value))
        return self._add(("int", value), b"\x03" + struct.pack(">i", value))

    def constant(self, type_: str, literal: str) -> int:
        """The constant that a literal of the text writes."""
        if type_ in STRINGS:
            return self.string(_ESCAPED.sub(_escaped, literal.strip()[1:-1]))
        return self.number(type_, _number(type_, literal.strip()))


def _unit(unit: int) -> bytes:
    if 1 <= unit < 0x80:
        return bytes([unit])
    if unit < 0x800:
        return bytes([0xC0 | unit >> 6, 0x80 | unit & 63])
    return bytes([0xE0 | unit >> 12, 0x80 | unit >> 6 & 63, 0x80 | unit & 63])


def _escaped(match: re.Match[str]) -> str:
    return chr(int(match[2], 16)) if match[2] else _ESCAPES[match[1]]


def _number(type_: str, literal: str) -> float:
    if type_ == "boolean":
        return int(literal == "true")
    if type_ in ("float", "double"):
        return _real(type_, literal)
    return ord(literal[1:-1]) if literal.startswith("'") else int(literal.rstrip("L"), 0)


def _real(type_: str, literal: str) -> float:
    if quotient := _NOT_FINITE.match(literal):  # (0.0f/0.0f), (1.0/0.0)
        dividend = float(quotient[1])
        return float("nan") if dividend == 0 else float("inf") if dividend > 0 else float("-inf")
    value = float(literal.rstrip("fFdD"))
    if type_ == "float":  # the nearest float, and never past the largest
        return float(struct.unpack(">f", struct.pack(">f", max(-_LARGEST_FLOAT, min(_LARGEST_FLOAT, value))))[0])
    return value
