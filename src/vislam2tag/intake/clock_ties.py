"""Rules for ties between the clocks of two recordings of one walk.

Recordings of two walks in one building also agree somewhere by chance: their ties are vague, or put little of one
recording into the time of the other.
"""

from __future__ import annotations

from collections.abc import Mapping

from vislam2tag.common.findings import Finding

MAX_SIGMA_S = 1.0
"""A walker gets 1.4 m in a second. Scans of two phones on one body give 0.3 to 0.8 s."""
MIN_MATCHED = 0.5
"""Share of a recording that is within the walk."""


def tie_fault(sigma_s: float, matched: float) -> str | None:
    """Say why a tie is refused by its sigma, seconds, and by the share of a recording that it puts into the walk."""
    if not matched >= MIN_MATCHED:
        return f"only {100 * matched:.0f} % of the recording is within the walk"
    if not sigma_s <= MAX_SIGMA_S:
        return f"the clock is known to {sigma_s:.1f} s only; at most {MAX_SIGMA_S:g} s is accepted"
    return None


MIN_AGREEMENT = 0.3
"""Recordings of one device on one clock correlate by 0.7 and more, those of two walks by 0.05 usually."""
MIN_SPREAD: Mapping[str, float] = {"GYRO": 0.1, "ACC": 0.5}
"""Motion of a walk that can be compared: standard deviation of turn rates, rad/s, and accelerations, m/s2."""


def motion_mismatch(agreement: float, what: str, walk: str, rows: int) -> list[Finding]:
    """Report ``rows`` of a table whose times are within a walk, but whose motion (``what``) is not that of the walk.

    ``agreement`` is the correlation of both at these times.
    """
    if agreement >= MIN_AGREEMENT:
        return []
    message = (
        f"the times are within the walk {walk}, but the {what} do not match (correlation {agreement:.2f}): the table "
        "is perhaps of another walk, or the phone was restarted. Check to which walk it belongs"
    )
    return [Finding(kind="motion_mismatch", file="", count=rows, message=message)]
