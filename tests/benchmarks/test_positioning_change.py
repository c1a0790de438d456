"""Shares in circles are told with how they scatter over walks, and whether that leaves their bounds."""

from __future__ import annotations

import numpy as np
from positioning_change import told_share

BOUNDS = (0.6, 0.76)
WALK = np.repeat(np.arange(20), 10)


def test_one_asterisk_where_other_walks_might_be_within_bounds_two_where_not() -> None:
    half_of_each = np.tile([True, False], 100)
    all_or_none = WALK % 2 == 0
    assert told_share(half_of_each, WALK, BOUNDS) == "0.50 ± 0.00 **"
    assert told_share(all_or_none, WALK, BOUNDS).endswith(" *")
    assert "±" not in told_share(all_or_none, WALK // 5, BOUNDS)
    assert told_share(np.arange(200) % 10 < 7, WALK, BOUNDS) == "0.70 ± 0.00"
