"""3D Scanner App for iOS: ``frame_00000.json`` with ``cameraPoseARFrame`` (4 x 4 by rows), ``intrinsics`` and ``time``,
seconds, beside ``frame_00000.jpg`` where it kept the picture; ARKit's axes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.sessions.apps.keyframes import Keyframe, KeyframeFormat
from vislam2tag.sessions.registry import register


class Scanner3dAppFormat(KeyframeFormat):
    """Reads the folders of 3D Scanner App."""

    name = "scanner-3d-app"
    files = {"poses": ("frame_00000.json",)}

    def frame_files(self, folder: Path) -> list[Path]:
        """The files of all frames."""
        return sorted(folder.glob("frame_*.json"))

    def keyframe(self, values: Mapping[str, Any]) -> Keyframe:
        """Make a frame of its file's content."""
        matrix = np.reshape(np.asarray(values["cameraPoseARFrame"], dtype=np.float64), (4, 4))[:3]
        lens = np.reshape(np.asarray(values["intrinsics"], dtype=np.float64), (3, 3))
        return Keyframe(round(float(values["time"]) * 1e9), matrix, lens[(0, 1, 0, 1), (0, 1, 2, 2)])

    def picture(self, file: Path) -> Path:
        """The picture of the same name."""
        return file.with_suffix(".jpg")


register(Scanner3dAppFormat())
