"""Label errors at control points, as the paper takes them (section VI-A)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.residuals import residuals_at_presses


def press_errors(trajectory: Trajectory, presses_ns: IntArray, control_points: FloatArray) -> FloatArray:
    """Distance (k,) from the label at each press to the *nearest* control point (p, 2), metres.

    NaN for presses without a label. The nearest point need not be the one pressed at: large errors come out too
    small where points stand close together. It is the paper's rule.
    """
    return np.asarray(np.linalg.norm(residuals_at_presses(trajectory, presses_ns, control_points).error_m, axis=1))


def walk_error(errors_m: FloatArray) -> float:
    """Mean over the labelled presses of a walk, metres; NaN where there is none."""
    labelled = errors_m[np.isfinite(errors_m)]
    return float(labelled.mean()) if labelled.size else float("nan")


def is_faulty(local: Trajectory, corrected: Trajectory) -> bool:
    """Tell whether ``local-corrected`` discards any frame that ``local`` maps (the paper's faulty trajectories)."""
    return bool(np.any(has_position(local.status) & ~has_position(corrected.status)))
