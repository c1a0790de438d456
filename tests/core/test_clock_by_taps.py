"""Clocks are aligned by taps on both, or refused with the figures that say why."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.clock_by_taps import align_by_taps

OFFSET_NS = 7_300_000_000
OURS_NS = np.array((1.0, 4.2, 11.9, 30.1, 30.9, 52.4)) * 1e9


def test_taps_in_common_tell_the_offset_with_its_sigma() -> None:
    hands_s = np.array((0.03, -0.02, 0.01, -0.04, 0.02, 0.0))
    theirs = np.append(OURS_NS + OFFSET_NS + hands_s * 1e9, (3e12, 0.5e12)).astype(np.int64)
    found = align_by_taps(theirs, OURS_NS.astype(np.int64))
    assert found.offset_ns is not None
    assert abs(found.offset_ns - OFFSET_NS) < 30_000_000
    assert 0.01 <= found.sigma_s < 0.03
    assert found.figures.startswith("6 taps in common")


def test_taps_that_do_not_tell_are_refused_with_their_figures() -> None:
    ours = OURS_NS.astype(np.int64)
    few = align_by_taps(ours[:3], ours)
    assert (few.offset_ns, few.figures) == (None, "3 and 6 taps, 4 of each are needed")
    even = np.arange(8, dtype=np.int64) * 2_000_000_000
    alike = align_by_taps(even, even)
    assert alike.offset_ns is None, "taps as even as a clock fit one later nearly as well"
    assert alike.figures == "8 taps in common, 7 at the best other offset"
    other = align_by_taps(np.cumsum(np.array((3, 7, 19, 43, 101))) * 1_000_000_000, ours)
    assert other.offset_ns is None
