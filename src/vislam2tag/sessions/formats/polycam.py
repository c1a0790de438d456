"""Polycam's raw keyframes: ``keyframes/cameras/TIME.json`` with ``t_00`` to ``t_23`` and the lens.

Times are microseconds, axes ARKit's; pictures lie in ``keyframes/images``. ``corrected_cameras`` were moved afterwards,
to fit pictures that were undistorted: they are no tracker's poses any more, and are not read.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.sessions.apps.keyframes import Keyframe, KeyframeFormat
from vislam2tag.sessions.registry import register


class PolycamFormat(KeyframeFormat):
    """Reads the folders of Polycam's raw data."""

    name = "polycam"
    files = {"poses": ("cameras",)}

    def frame_files(self, folder: Path) -> list[Path]:
        """The files of all frames."""
        return sorted(folder.glob("keyframes/cameras/*.json"))

    def keyframe(self, values: Mapping[str, Any]) -> Keyframe:
        """Make a frame of its file's content."""
        matrix = np.array([[float(values[f"t_{row}{column}"]) for column in range(4)] for row in range(3)])
        lens = np.array([float(values[name]) for name in ("fx", "fy", "cx", "cy")])
        return Keyframe(int(values["timestamp"]) * 1000, matrix, lens)

    def picture(self, file: Path) -> Path:
        """The picture of the same name."""
        return file.parent.parent / "images" / f"{file.stem}.jpg"


register(PolycamFormat())
