"""Limits on what a file may make the program compute or keep in memory: each with its unit and its reason.

A file of some kilobytes can state any number: how wide a floor is, how long a recording lasted, how many landmarks
were seen. What follows from such a number is bounded here, far above real surveys.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, IntArray

MAX_FLOOR_M = 10_000.0
"""Width and height of a floor, metres. The largest buildings are 2 km long; a plan that is wider has a wrong scale or
something drawn far away from the building."""

MAX_RECORDING_S = 24 * 3600.0
"""How far times of one session may be from their median, seconds: series are resampled over all of that time. Phones
record for minutes to hours; a time further away is wrong."""

MAX_LANDMARKS = 1_000
"""Landmarks in the log of one session: the smoother's matrices have three rows and columns for each (72 MB). A walk of
an hour passes one or two hundred. The landmarks of a site are not limited by this."""

MAX_SOLVER_BLOCKS = 200_000_000
"""Passes of a session times the square of its landmarks: what one solution of the smoother multiplies (a few
seconds, and 500 MB at most). A walk of two hours past 200 landmarks has 80 million."""

MAX_DIAGNOSED_PASSES = 2_000
"""Passes of a session that `diagnose` compares with each other, each with each (600 MB). A walk of two hours has
about 1,500."""

MAX_PAIRS = 200_000
"""Pairs of passes that are tried as a first guess of where a walk was: the pairs of 600 passes."""

MAX_AT_ONCE = 4_000_000
"""Numbers of an array that is larger as a whole and therefore made in parts (32 MB)."""

MAX_JOINT_LANDMARKS = 6_000
"""Landmarks whose errors are solved for, or given, together: a matrix with three rows and columns for each (2.6 GB). A
hospital campus has 5,000."""

MAX_CONTROL_POINTS = 2_000
"""Control points of a floor: each press is compared with each pair of them (32 MB). Floors have about a hundred."""

MAX_REACH_CELLS = 1_000
"""Cells of a map that are further along an axis from the median cell are not drawn (32 MB): one wrong position must
not make the map as large as its error."""

MAX_LEVEL_CELLS = 40_000_000
"""Cells of a floor times its access points, of levels heard there (320 MB): 200 m by 200 m at 1 m with 1,000 access
points. Larger floors get larger cells."""

MAX_CELLS = 4_000_000
"""Cells of a grid over a floor (32 MB a layer): 1 km by 1 km at 0.5 m. Larger floors get larger cells."""


def of_one_recording(time_ns: IntArray) -> BoolArray:
    """Mask (n,) of the times that are within :data:`MAX_RECORDING_S` of their median."""
    seconds = time_ns * 1e-9
    if not len(seconds) or seconds.max() - seconds.min() <= MAX_RECORDING_S:
        return np.ones(len(seconds), dtype=np.bool_)
    return np.asarray(np.abs(seconds - np.median(seconds)) <= MAX_RECORDING_S)
