"""Traps that are made in the text of a session's files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import cycle

from vislam2tag.simulation.writing.writer import SessionText

PHONE_FILES = ("poses", "landmarks", "sensors", "wifi", "presses")
NUMBER_FILES = ("poses", "landmarks", "sensors")
ODD_SSIDS = (b"", b"a;b", b"; ; ", b'"quoted", name', b"o'clock, free", "Büro ☕ 東京".encode(), b" spaced ")
BROKEN_SSIDS = (b"caf\xe9", b"\xff\xfe\xfa", b"half \xe6\x9d")
GARBAGE = (b"#### restarted ####", b"1; 2; 3", b"1; ACC; x; y; z; 0; 0; 0; 0")
SPACING = 97
"""Lines between the faults of a file."""


def _decimal_comma(text: SessionText) -> SessionText:
    return _changed(text, NUMBER_FILES, lambda content: content.replace(b".", b","))


def _mixed_decimal_marks(text: SessionText) -> SessionText:
    """The second half of each file has the other mark."""
    return _changed(text, NUMBER_FILES, _swap_marks_in_second_half)


def _swap_marks_in_second_half(content: bytes) -> bytes:
    middle = content.find(b"\n", len(content) // 2) + 1
    return content[:middle] + content[middle:].translate(bytes.maketrans(b".,", b",."))


def _no_space_separator(text: SessionText) -> SessionText:
    return _changed(text, PHONE_FILES, lambda content: content.replace(b"; ", b";"))


def _odd_ssids(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda content: _with_ssids(content, ODD_SSIDS))


def _broken_ssid_bytes(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda content: _with_ssids(content, BROKEN_SSIDS))


def _with_ssids(content: bytes, ssids: Sequence[bytes]) -> bytes:
    rows = (line.split(b"; ") for line in content.splitlines())
    return _joined(b"; ".join((*row[:3], ssid, *row[4:])) for row, ssid in zip(rows, cycle(ssids), strict=False))


def _partial_last_line(text: SessionText) -> SessionText:
    """The landmark, sensor and Wi-Fi files end in the middle of a line."""
    return _changed(text, ("landmarks", "sensors", "wifi"), _cut_last_line)


def _cut_last_line(content: bytes) -> bytes:
    start = content.rfind(b"\n", 0, max(len(content) - 1, 0)) + 1
    return content[: (start + len(content)) // 2]


def _garbage_lines(text: SessionText) -> SessionText:
    return _changed(text, ("poses", "landmarks", "sensors", "wifi"), _with_garbage)


def _with_garbage(content: bytes) -> bytes:
    lines = content.splitlines()
    middle = len(lines) // 2
    return _joined((*lines[:middle], *GARBAGE, *lines[middle:]))


def _empty_file(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda _: b"")


def _missing_file(text: SessionText) -> SessionText:
    return {role: content for role, content in text.items() if role != "wifi"}


def _duplicate_times(text: SessionText) -> SessionText:
    """Now and then a pose is logged twice."""
    return _changed(text, ("poses",), _with_repeated_lines)


def _duplicate_landmark_rows(text: SessionText) -> SessionText:
    return _changed(text, ("landmarks",), _with_repeated_lines)


def _with_repeated_lines(content: bytes) -> bytes:
    lines = content.splitlines()
    return _joined(copy for row, line in enumerate(lines) for copy in [line] * (2 if row % SPACING == 50 else 1))


def _backward_times(text: SessionText) -> SessionText:
    """Now and then two neighbouring poses are swapped."""
    return _changed(text, ("poses",), _with_swapped_lines)


def _with_swapped_lines(content: bytes) -> bytes:
    lines = content.splitlines()
    for row in range(50, len(lines) - 1, SPACING):
        lines[row], lines[row + 1] = lines[row + 1], lines[row]
    return _joined(lines)


def _landmark_rows_without_frame(text: SessionText) -> SessionText:
    """Now and then a pose is missing whose landmark rows are there."""
    return _changed(text, ("poses",), _without_some_lines)


def _without_some_lines(content: bytes) -> bytes:
    return _joined(line for row, line in enumerate(content.splitlines()) if row % SPACING != 50)


def _joined(lines: Iterable[bytes]) -> bytes:
    return b"".join(line + b"\n" for line in lines)


def _changed(text: SessionText, roles: Sequence[str], change: Callable[[bytes], bytes]) -> SessionText:
    return text | {role: change(text[role]) for role in roles if role in text}


TEXT_TRAPS: dict[str, Callable[[SessionText], SessionText]] = {
    "decimal_comma": _decimal_comma,
    "mixed_decimal_marks": _mixed_decimal_marks,
    "no_space_separator": _no_space_separator,
    "odd_ssids": _odd_ssids,
    "broken_ssid_bytes": _broken_ssid_bytes,
    "partial_last_line": _partial_last_line,
    "garbage_lines": _garbage_lines,
    "empty_file": _empty_file,
    "missing_file": _missing_file,
    "duplicate_times": _duplicate_times,
    "duplicate_landmark_rows": _duplicate_landmark_rows,
    "backward_times": _backward_times,
    "landmark_rows_without_frame": _landmark_rows_without_frame,
}
"""What each of these traps does to a session's files."""
