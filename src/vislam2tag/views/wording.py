"""Numbers and codes as people read them: the template's filters. No line breaks inside a number with its unit."""

from __future__ import annotations

import math

MISSING = "–"
"""What stands where a value is not known."""


def percent(share: float | None) -> str:
    """Write a share 0 to 1 in percent; short of everything never reads 100 %, more than nothing never 0 %."""
    if share is None:
        return MISSING
    if 0.995 < share < 1:
        return _unbroken("> 99 %")
    if 0 < share < 0.005:
        return _unbroken("< 1 %")
    return _unbroken(f"{100 * share:.0f} %")


def duration(seconds: float | None) -> str:
    """Write seconds as ``12.3 s``, ``4 min 05 s`` or ``2 h 03 min``."""
    if seconds is None:
        return MISSING
    if seconds < 59.95:
        return _unbroken(f"{seconds:.1f} s")
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return _unbroken(f"{minutes} min {rest:02d} s")
    hours, minutes = divmod(round(seconds / 60), 60)
    return _unbroken(f"{hours} h {minutes:02d} min")


def distance(metres: float | None) -> str:
    """Write metres as ``12 m``, kilometres from ten thousand metres on."""
    if metres is None:
        return MISSING
    return _unbroken(f"{metres / 1000:.1f} km" if metres >= 10_000 else f"{count(round(metres))} m")


def number(value: float | None, decimals: int, unit: str = "") -> str:
    """Write a number with fixed decimals and its unit."""
    return MISSING if value is None else _unbroken(f"{value:.{decimals}f} {unit}".rstrip())


def degrees(radians: float | None) -> str:
    """Write an angle given in radians in degrees."""
    return MISSING if radians is None else _unbroken(f"{math.degrees(radians):.1f} °")


def count(value: int) -> str:
    """Write a count with narrow spaces between thousands."""
    return f"{value:,}".replace(",", "\u202f")


def size(size_bytes: int) -> str:
    """Write a file size in kB or MB (powers of ten)."""
    return _unbroken(f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 1_000_000 else f"{size_bytes / 1e3:.1f} kB")


def words(code: str) -> str:
    """Write a code such as ``scan_throttling`` as words."""
    return code.replace("_", " ")


def _unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


FILTERS = {
    "percent": percent,
    "duration": duration,
    "distance": distance,
    "number": number,
    "degrees": degrees,
    "count": count,
    "size": size,
    "words": words,
}
"""The filters by the name templates use."""
