"""Errors that landmarks of a completed landmark file share, as a file beside it (docs/reference/formats.md).

Landmarks that walks have placed are not independent: if the map is turned about the surveyed ones, all of it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.table_files import parquet_bytes, read_parquet
from vislam2tag.core.arrays import FloatArray, IntArray, joint_columns, of_landmarks
from vislam2tag.core.limits import MAX_JOINT_LANDMARKS
from vislam2tag.core.tracks import Landmarks

SUFFIX = ".covariance.parquet"
"""``completed.csv`` has ``completed.covariance.parquet`` beside it."""
SAME_PLACE_M = 1e-3
"""A row of the landmark file that lies elsewhere was changed since: it errs by itself."""
MOST_LANDMARKS = 400
"""Each session is given the whole covariance, which grows with the square of their number."""
_WITH = ("with_x", "with_y", "with_heading")


@dataclass(frozen=True)
class SharedErrors:
    """``k`` landmarks by floor (k,) and id, at ``position_bcs`` (k, 2) metres; ``covariance`` (3k, 3k) of x, y of each,
    then of all headings (m^2, m rad, rad^2; next to infinite where a heading is not known).
    """

    floor: IntArray
    ids: tuple[str, ...]
    position_bcs: FloatArray
    covariance: FloatArray

    def as_bytes(self) -> bytes:
        """The content of their file: a row a landmark, with three rows of the covariance each."""
        k = len(self.ids)
        x, y = self.position_bcs.T
        rows = {"with_x": slice(0, 2 * k, 2), "with_y": slice(1, 2 * k, 2), "with_heading": slice(2 * k, None)}
        every = pl.List(pl.Float64)
        shared = {name: pl.Series(self.covariance[part].tolist(), dtype=every) for name, part in rows.items()}
        return parquet_bytes(pl.DataFrame({"floor": self.floor, "landmark": list(self.ids), "x": x, "y": y} | shared))

    def onto(self, landmarks: Landmarks) -> Landmarks:
        """The landmarks with these errors, where they lie where these were placed; the others err apart."""
        own = list(zip(landmarks.floor.tolist(), landmarks.ids, strict=True))
        row = {place: i for i, place in enumerate(own)}
        places = zip(self.floor.tolist(), self.ids, strict=True)
        here = np.array([row.get(place, -1) for place in places], dtype=np.int64)
        moved_m = np.abs(landmarks.position_bcs[here] - self.position_bcs).max(axis=1, initial=0.0)
        used = np.flatnonzero((here >= 0) & (moved_m < SAME_PLACE_M))
        if not len(used):
            return landmarks
        rows, count = here[used], len(own)
        if count > MAX_JOINT_LANDMARKS:
            raise ValueError(f"{count:,} landmarks, and at most {MAX_JOINT_LANDMARKS:,} can share errors")
        joint = np.diag(np.concatenate((np.zeros(2 * count), np.nan_to_num(landmarks.heading_sigma_rad) ** 2)))
        pair = 2 * np.arange(count)[:, None] + (0, 1)
        apart = np.flatnonzero(landmarks.surveyed)
        joint[pair[apart][:, :, None], pair[apart][:, None, :]] = landmarks.covariance_bcs[apart]
        column = joint_columns(rows, count)
        joint[np.ix_(column, column)] = of_landmarks(self.covariance, used)
        covariance = landmarks.covariance_bcs.copy()
        covariance[rows] = joint[pair[rows][:, :, None], pair[rows][:, None, :]]
        return replace(landmarks, covariance_bcs=covariance, joint_covariance=joint)


def errors_file(landmark_file: Path) -> Path:
    """Where the shared errors of a landmark file's landmarks stand."""
    return landmark_file.with_suffix(SUFFIX)


def with_shared_errors(landmarks: Landmarks, landmark_file: Path) -> Landmarks:
    """Landmarks with the errors that they share, where a file beside theirs tells them.

    Raises SurveyError where that file cannot be used.
    """
    path = errors_file(landmark_file)
    if not path.exists():
        return landmarks
    try:
        return _read(path).onto(landmarks)
    except (OSError, ValueError, TypeError, pl.exceptions.PolarsError, np.linalg.LinAlgError) as error:
        raise SurveyError(
            f"{path}: cannot be used ({error}); make {landmark_file.name} again with vislam2tag survey-landmarks, or "
            "remove this file"
        ) from error


def _read(path: Path) -> SharedErrors:
    """Read the file; raises what :func:`with_shared_errors` catches where it is not what it should be."""
    table = read_parquet(path)
    parts = [np.array(table[name].to_list(), dtype=np.float64).reshape(len(table), 3 * len(table)) for name in _WITH]
    covariance = np.concatenate((np.stack(parts[:2], axis=1).reshape(-1, 3 * len(table)), parts[2]))
    position = table.select("x", "y").to_numpy().astype(np.float64)
    if not (np.isfinite(covariance).all() and np.isfinite(position).all() and np.allclose(covariance, covariance.T)):
        raise ValueError("it holds no covariance")
    np.linalg.cholesky(covariance)  # raises where no errors could have it
    return SharedErrors(
        table["floor"].to_numpy().astype(np.int64), tuple(table["landmark"].to_list()), position, covariance
    )
