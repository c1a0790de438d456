"""The paper's Tables I and II: one error a walk and strategy, then statistics over the walks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.survey.model import SessionKey

PAPER_TABLE_1 = {
    "local": (0.91, 0.63, 4.51),
    "local-corrected": (0.53, 0.49, 0.87),
    "global-affine": (2.80, 0.54, 20.78),
}
"""Mean, median and maximum over all walks at control points, metres (the paper's global is an affine map here)."""
PAPER_TABLE_1_NON_FAULTY = {"local": (0.51, 0.49, 0.72), "global-affine": (0.43, 0.40, 0.72)}
PAPER_TABLE_2 = {"local": (0.73, 0.23, 2.68), "local-corrected": (0.18, 0.18, 0.31)}
"""Mean, median and maximum over the walks in the total station's view, metres."""


@dataclass(frozen=True)
class WalkErrors:
    """Mean error of one walk by strategy, metres; NaN where the strategy labels nothing."""

    key: SessionKey
    error_m: dict[str, float]
    faulty: bool


@dataclass(frozen=True)
class OverWalks:
    """Statistics over walks, metres."""

    walks: int
    mean_m: float
    median_m: float
    max_m: float


def over_walks(walks: list[WalkErrors], strategy: str, only_non_faulty: bool = False) -> OverWalks:
    """Reduce the walks that this strategy labels (at least in part) to mean, median and maximum."""
    errors = np.array([w.error_m[strategy] for w in walks if not (only_non_faulty and w.faulty)])
    errors = errors[np.isfinite(errors)]
    if not errors.size:
        return OverWalks(0, float("nan"), float("nan"), float("nan"))
    return OverWalks(len(errors), float(errors.mean()), float(np.median(errors)), float(errors.max()))
