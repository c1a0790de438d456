"""Which pictures a session has, and with which pose and lens each was taken."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vislam2tag.core.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Pictures:
    """Pictures of a session, ``k`` of them, in order of time.

    ``video`` holds them all, its frames numbered by ``frame`` (k,), or each is a file of its own. ``time_ns`` (k,) are
    the times of their poses; ``lens_px`` (k, 4) focal lengths and principal point fx, fy, cx, cy, pixels.
    """

    time_ns: IntArray
    lens_px: FloatArray
    video: Path | None = None
    frame: IntArray | None = None
    files: tuple[Path, ...] = ()
