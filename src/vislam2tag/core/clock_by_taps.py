"""How far one recorder's clock is ahead of another's, by moments at which somebody tapped on both."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.clock_alignment import ClockAlignment

TOGETHER_S = 0.4
"""Taps with two hands, or one after the other at once, are no farther apart."""
FEWEST = 4
"""Fewer taps in common fall together by chance."""
_LEAD = 2
"""By how many fewer taps any other offset must bring together."""
_MOST = 2000


def align_by_taps(theirs_ns: IntArray, ours_ns: IntArray) -> ClockAlignment:
    """Align two clocks by taps (n,) and (m,), ns; the offset brings most of them together."""
    theirs, ours = np.unique(theirs_ns), np.unique(ours_ns)
    if min(len(theirs), len(ours)) < FEWEST:
        return ClockAlignment(None, figures=f"{len(theirs)} and {len(ours)} taps, {FEWEST} of each are needed")
    if max(len(theirs), len(ours)) > _MOST:
        return ClockAlignment(None, figures=f"more than {_MOST} taps")
    apart = np.sort((theirs[:, None] - ours[None, :]).ravel())
    reach = round(TOGETHER_S * 1e9)
    count = np.searchsorted(apart, apart + reach, side="right") - np.arange(len(apart))
    best = int(np.argmax(count))
    together = apart[best : best + count[best]]
    elsewhere = count[np.abs(apart - apart[best]) > 2 * reach]
    other = int(elsewhere.max(initial=0))
    figures = f"{count[best]} taps in common, {other} at the best other offset"
    if count[best] < FEWEST or count[best] - other < _LEAD:
        return ClockAlignment(None, figures=figures)
    offset_ns = round(float(np.median(together - together[0]))) + int(together[0])
    sigma_s = float(np.std((together - offset_ns) * 1e-9, ddof=1)) / np.sqrt(len(together))
    return ClockAlignment(offset_ns, max(float(sigma_s), 0.01), figures=figures)
