"""A tie is refused if it is vague, or leaves most of a recording without counterpart."""

from __future__ import annotations

import pytest

from vislam2tag.intake.clock_ties import motion_mismatch, tie_fault


@pytest.mark.parametrize(
    ("sigma_s", "matched", "said"),
    [
        (0.76, 1.0, None),
        (0.001, 0.51, None),
        (1.34, 0.76, "the clock is known to 1.3 s only"),
        (0.76, 0.35, "only 35 % of the recording is within the walk"),
        (float("nan"), 1.0, "the clock is known to nan s only"),
        (0.1, float("nan"), "only nan % of the recording"),
    ],
)
def test_a_tie_needs_precision_and_a_counterpart(sigma_s: float, matched: float, said: str | None) -> None:
    fault = tie_fault(sigma_s, matched)
    assert fault is None if said is None else fault is not None and said in fault


def test_motion_that_contradicts_a_common_clock_is_reported() -> None:
    assert motion_mismatch(0.3, "turn rates", "floor_0-LG", 9) == []
    (finding,) = motion_mismatch(0.05, "turn rates", "floor_0-LG", 9)
    assert (finding.kind, finding.count) == ("motion_mismatch", 9)
    assert "the turn rates do not match (correlation 0.05): the table is perhaps of another walk" in finding.message
