"""Rules for ties between the clocks of two recordings of one walk.

Recordings of two walks in one building also agree somewhere by chance: their ties are vague, or put little of one
recording into the time of the other.
"""

from __future__ import annotations

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
