"""Ways in which a text file gets damaged, drawn by a seeded generator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

some_or_many = pytest.mark.parametrize("files", [500, pytest.param(20_000, marks=pytest.mark.campaign)])
"""How many damaged files a test reads."""

NASTY = [
    b"\x00",
    b"\xff\xfe",
    b"\xc3",
    b"\xed\xa0\x80",
    b"\xef\xbb\xbf",
    b"\r",
    b"\r\n",
    b"\n\n",
    b";",
    b"; ; ",
    b",",
    b".",
    b"\t",
    b'"',
    b"'",
    b"#",
    b"%s",
    b"NaN",
    b"-Infinity",
    b"1e400",
    b"-1e-400",
    b"9" * 25,
    b"9223372036854775807",
    b"-9223372036854775808",
    b"18446744073709551616",
    b"1_000",
    b"0x7f",
    b"\xe2\x80\xa8",
    b"\x1a",
    b"\\n",
    b" " * 50,
    b"A" * 300,
]

EXTREME = [
    *(b"1e308", b"-1e308", b"1e200", b"1e30", b"1e-320", b"0", b"-1", b"NaN", b"Infinity", b"-Infinity", b"99999999"),
    *(b"9223372036854775807", b"9223372036854775", b"4611686018427387904", b"2147483648"),
]


def exaggerate(data: bytes, rng: np.random.Generator) -> bytes:
    """Put extreme numbers into one column, or anywhere, in a few lines, a stretch of them or all."""
    lines = data.splitlines()
    first, last = sorted(rng.integers(len(lines) + 1, size=2).tolist())
    rows = (rng.integers(len(lines), size=3).tolist(), range(first, last), range(len(lines)))[rng.integers(3)]
    column = None if rng.random() < 0.5 else int(rng.integers(8))
    value = EXTREME[rng.integers(len(EXTREME))]
    for row in rows:
        fields = lines[row].split(b"; ")
        place = int(rng.integers(len(fields))) if column is None else min(column, len(fields) - 1)
        fields[place] = value
        lines[row] = b"; ".join(fields)
    return b"\n".join((*lines, b""))


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Damage a file in one to three ways."""
    for _ in range(rng.integers(1, 4)):
        data = WAYS[rng.integers(len(WAYS))](data, rng)
    return data


def _place(data: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(data) + 1))


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data or b"x")
    for _ in range(rng.integers(1, 6)):
        changed[rng.integers(len(changed))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _truncate(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _place(data, rng)]


def _behead(data: bytes, rng: np.random.Generator) -> bytes:
    return data[_place(data, rng) :]


def _insert(data: bytes, rng: np.random.Generator) -> bytes:
    at = _place(data, rng)
    return data[:at] + NASTY[rng.integers(len(NASTY))] + data[at:]


def _replace_field(data: bytes, rng: np.random.Generator) -> bytes:
    fields = data.split(b"; ")
    fields[rng.integers(len(fields))] = NASTY[rng.integers(len(NASTY))]
    return b"; ".join(fields)


def _shuffle_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = rng.integers(len(lines), size=2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _repeat_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = sorted(rng.integers(len(lines), size=2))
    return b"\n".join(lines[:j] + lines[i:])


def _drop_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = sorted(rng.integers(len(lines), size=2))
    return b"\n".join(lines[:i] + lines[j:])


def _other_separator(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b"; ", (b",", b"\t", b";", b" ", b";;")[rng.integers(5)], int(rng.integers(1, 200)))


def _other_mark(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b".", (b",", b"..", b"\xd9\xab")[rng.integers(3)], int(rng.integers(1, 200)))


def _noise(data: bytes, rng: np.random.Generator) -> bytes:
    at = _place(data, rng)
    return data[:at] + rng.bytes(int(rng.integers(1, 40))) + data[at:]


WAYS: tuple[Callable[[bytes, np.random.Generator], bytes], ...] = (
    _flip,
    _truncate,
    _behead,
    _insert,
    _replace_field,
    _shuffle_lines,
    _repeat_lines,
    _drop_lines,
    _other_separator,
    _other_mark,
    _noise,
)
