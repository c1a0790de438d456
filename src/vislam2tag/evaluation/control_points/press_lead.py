"""How much the labels are ahead of the presses all through a session: phone before the feet, or a slow finger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray

MIN_PRESSES = 4
"""Below this many presses made while walking no lead is estimated."""
MIN_SPEED_M_S = 0.3
"""Who is slower is not taken to walk: the time of such a press says nothing."""

MAX_SPEED_M_S = 4.0
"""Nobody walks faster: the labels jump there."""


@dataclass(frozen=True)
class Lead:
    """A session's constant lead: the label was at the point ``lead_s`` before the press (negative: after it).

    ``without_s`` (k,) is the lead by all presses but the one, so that no press corrects itself. All are NaN where there
    are too few presses.
    """

    lead_s: float
    sigma_s: float
    without_s: FloatArray


def estimate_lead(along_m: FloatArray, speed_m_s: FloatArray) -> Lead:
    """Estimate the lead from how far (k,) each label is ahead of its point, and the walking speed (k,) there.

    Either may be NaN. The least sum of absolute rests of ``along = lead x speed``: the median of the quotients,
    weighted by speed.
    """
    speed_m_s = np.nan_to_num(speed_m_s)
    usable = np.isfinite(along_m) & (speed_m_s >= MIN_SPEED_M_S) & (speed_m_s <= MAX_SPEED_M_S)
    quotient = along_m / np.where(usable, speed_m_s, np.nan)
    if usable.sum() < MIN_PRESSES:
        return Lead(float("nan"), float("nan"), np.full(len(along_m), np.nan))
    weight = np.where(usable, speed_m_s, 0.0)
    lead_s = _weighted_median(quotient, weight)
    others = weight * (1 - np.eye(len(along_m)))
    without_s = np.array([_weighted_median(quotient, one) for one in others])
    rest_m = np.abs(along_m - lead_s * speed_m_s)[usable]
    scatter_m = 1.4826 * float(np.median(rest_m))
    return Lead(lead_s, float(np.sqrt(np.pi / 2) * scatter_m / np.linalg.norm(weight)), without_s)


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """Median of the values with a weight above zero: half of all weight lies on either side."""
    kept = np.flatnonzero(weights > 0)
    order = kept[np.argsort(values[kept], kind="stable")]
    upto = np.cumsum(weights[order]) - weights[order] / 2
    return float(np.interp(weights[order].sum() / 2, upto, values[order]))
