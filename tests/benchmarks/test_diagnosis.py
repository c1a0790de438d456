"""A few surveys of the campaign of docs/results/how-good.md, of seeds of its development."""

from __future__ import annotations

import pytest
from diagnosis import outcome_of


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1004, 1007, 1011])
def test_what_is_put_in_is_named_and_nothing_else(seed: int) -> None:
    outcome = outcome_of(seed)
    assert outcome.alarms == []
    assert sorted(outcome.named) == sorted(outcome.put_in)
    assert outcome.put_in
