from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.arrays import runs_of


@given(st.lists(st.booleans(), max_size=30))
def test_runs_are_the_true_values_in_order_with_a_false_one_between(values: list[bool]) -> None:
    mask = np.array(values, dtype=bool)
    runs = runs_of(mask)
    found = np.zeros_like(mask)
    for start, stop in runs:
        assert start < stop
        found[start:stop] = True
    assert (found == mask).all()
    assert all(stop < start for (_, stop), (start, _) in pairwise(runs))
