"""Pose columns: what makes a logged pose usable."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.findings import Finding

POSE_COLUMNS = dict.fromkeys(("tx", "ty", "tz", "qx", "qy", "qz", "qw"), pl.Float64)
"""Position in metres and quaternion (x, y, z, w), both in the ACS."""
GREATEST = 1e6
"""No tracker's frame reaches this far, metres: such a number is a fault, and its square might overflow."""
NOT_FINITE = f"numbers must be finite and less than {GREATEST:g}; these poses are not used"


def poses_of(rows: pl.DataFrame, file: str) -> tuple[FloatArray, FloatArray, BoolArray, list[Finding]]:
    """Split pose columns into positions (n, 3), unit quaternions (n, 4) and a mask (n,) of usable poses.

    A pose that is not finite or beyond :data:`GREATEST`, or whose quaternion cannot be normalised, is unusable and a
    finding; its quaternion comes out as the identity.
    """
    poses = rows.select(list(POSE_COLUMNS)).to_numpy(order="c")
    line = rows["row"].to_numpy()
    with np.errstate(over="ignore", invalid="ignore"):
        finite = np.einsum("ij,ij->i", poses, poses) < GREATEST**2
        norm = np.sqrt(np.einsum("ij,ij->i", poses[:, 3:], poses[:, 3:]))
        turned = finite & (norm > 0)
    quaternion = poses[:, 3:].copy()
    quaternion[~turned] = 0.0, 0.0, 0.0, 1.0
    quaternion /= np.where(turned, norm, 1.0)[:, None]
    findings = [
        *_finding("non_finite_values", file, line[~finite], NOT_FINITE),
        *_finding(
            "invalid_quaternions",
            file,
            line[finite & ~turned],
            "an orientation is zero; these poses are not used",
        ),
    ]
    return poses[:, :3].copy(), quaternion, turned, findings


def _finding(kind: str, file: str, lines: IntArray, message: str) -> list[Finding]:
    return [Finding.at_lines(kind, file, lines.tolist(), message)] if len(lines) else []
