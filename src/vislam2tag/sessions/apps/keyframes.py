"""Apps that write a file of JSON for each frame: its pose, its lens, and perhaps a picture beside it."""

from __future__ import annotations

import hashlib
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.files.plain_files import json_values, read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.sessions.apps.axes import pose_rows, poses_of_matrices
from vislam2tag.sessions.apps.format import SIGHTINGS_FILE, AppFormat
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.sessions.model import FileRecord
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.site.site_table import is_file


@dataclass(frozen=True)
class Keyframe:
    """One frame: ``time_ns``, ``matrix`` (3, 4) from the camera's frame to the ACS, ``lens_px`` (4,) fx, fy, cx, cy."""

    time_ns: int
    matrix: FloatArray
    lens_px: FloatArray


class KeyframeFormat(AppFormat):
    """Reads folders with a file a frame."""

    @abstractmethod
    def frame_files(self, folder: Path) -> list[Path]:
        """The files of all frames, sorted. Raises OSError where the folder cannot be looked into."""

    @abstractmethod
    def keyframe(self, values: Mapping[str, Any]) -> Keyframe:
        """Make a frame of its file's content. Raises KeyError, TypeError or ValueError where that is something else."""

    @abstractmethod
    def picture(self, file: Path) -> Path:
        """Where the picture of a frame's file would be."""

    def recognises(self, folder: Path) -> bool:
        """A session has at least one frame."""
        return bool(self.frame_files(folder))

    def input_files(self, folder: Path) -> list[Path]:
        """The frames' files, and the landmarks found in their pictures."""
        sightings = folder / SIGHTINGS_FILE
        return [*self.frame_files(folder), *([sightings] if is_file(sightings) else [])]

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames, in order of their files."""
        files = self.frame_files(reading.folder)
        contents = [read_bytes(path) for path in files]
        found, whole = self._frames(contents), b"".join(contents)
        name, digest = files[0].name if files else "", hashlib.sha256(whole).hexdigest()
        reading.files.append(FileRecord(name, "poses", len(whole), digest, len(files), len(found)))
        if len(found) < len(files):
            message = "files of frames do not hold the pose that is expected; they are left out: look at the first ones"
            odd = [number + 1 for number in range(len(files)) if number not in found]
            reading.findings.append(Finding.at_lines("malformed_lines", name, odd, message))
        rows = pl.DataFrame(
            {"row": [number + 1 for number in found], "time_ns": [frame.time_ns for frame in found.values()]},
            schema={"row": pl.Int64, "time_ns": pl.Int64},
        )
        matrices = np.array([frame.matrix for frame in found.values()]).reshape(-1, 3, 4)
        return pose_rows(rows, poses_of_matrices(matrices)).sort("time_ns", maintain_order=True)

    def pictures(self, folder: Path) -> Pictures | None:
        """The frames that kept their picture."""
        files = self.frame_files(folder)
        found = self._frames(read_bytes(path) for path in files)
        kept = {n: frame for n, frame in found.items() if is_file(self.picture(files[n]))}
        if not kept:
            return None
        order = sorted(kept, key=lambda number: kept[number].time_ns)
        return Pictures(
            np.array([kept[n].time_ns for n in order]),
            np.array([kept[n].lens_px for n in order]),
            files=tuple(self.picture(files[n]) for n in order),
        )

    def _frames(self, contents: Iterable[bytes]) -> dict[int, Keyframe]:
        """Frames by the number of their file; those that are not understood are left out."""
        found = {}
        for number, content in enumerate(contents):
            try:
                found[number] = self.keyframe(json_values(content))
            except (ValueError, KeyError, TypeError, OverflowError, AttributeError):
                continue
        return found
