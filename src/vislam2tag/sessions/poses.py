"""Pose columns: what makes a logged pose usable."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.findings import Finding

POSE_COLUMNS = dict.fromkeys(("tx", "ty", "tz", "qx", "qy", "qz", "qw"), pl.Float64)
"""Position in metres and quaternion (x, y, z, w), both in the ACS."""


def poses_of(rows: pl.DataFrame, file: str) -> tuple[FloatArray, FloatArray, BoolArray, list[Finding]]:
    """Split pose columns into positions (n, 3), unit quaternions (n, 4) and a mask (n,) of usable poses.

    A pose with a number that is not finite or a quaternion of norm zero is unusable, and a finding.
    """
    poses = rows.select(list(POSE_COLUMNS)).to_numpy()
    line = rows["row"].to_numpy()
    finite: BoolArray = np.isfinite(poses).all(axis=1)
    largest = np.abs(poses[:, 3:]).max(axis=1, initial=0.0)
    turned: BoolArray = finite & (largest > 0)
    scale = np.where(turned, largest, 1.0)[:, None]
    # Scaling by the largest component first keeps huge and tiny quaternions from overflowing.
    quaternion = np.where(turned[:, None], poses[:, 3:], np.array((0.0, 0.0, 0.0, 1.0))) / scale
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    findings = [
        *_finding("non_finite_values", file, line[~finite], "numbers must be finite; these poses are not used"),
        *_finding("zero_quaternion", file, line[finite & ~turned], "the orientation is zero; these poses are not used"),
    ]
    return poses[:, :3].copy(), quaternion, turned, findings


def _finding(kind: str, file: str, lines: IntArray, message: str) -> list[Finding]:
    return [Finding.at_lines(kind, file, lines.tolist(), message)] if len(lines) else []
