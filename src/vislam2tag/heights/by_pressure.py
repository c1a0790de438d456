"""Height and floor of walks that nothing but air pressure tells of."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.context import PressureLog, Storeys
from vislam2tag.heights.estimate import Heights
from vislam2tag.heights.floors import floor_of_heights
from vislam2tag.heights.rides import altitude_m
from vislam2tag.heights.settings import HeightSettings


def heights_by_pressure(
    time_ns: IntArray, pressure: PressureLog | None, storeys: Storeys | None, settings: HeightSettings
) -> Heights:
    """Find height and floor at boot-clock times (n,) of a walk that starts on its own floor, phone in hand.

    Only floors whose elevation is known are told apart; without pressure the walk stays on its own.
    """
    n = len(time_ns)
    if storeys is None:
        return Heights(np.full(n, np.nan), np.empty(0, dtype=np.int64))
    floor, z = np.full(n, storeys.own, dtype=np.int64), np.full(n, np.nan)
    known = np.isfinite(storeys.elevation_m)
    number, elevation = storeys.number[known], storeys.elevation_m[known]
    if storeys.own not in number.tolist() or n == 0:
        return Heights(z, floor)
    own = int(np.flatnonzero(number == storeys.own)[0])
    rise = np.zeros(n) if pressure is None else altitude_m(pressure, time_ns)
    height = elevation[own] + settings.carried_m + rise - rise[0]
    if len(number) > 1 and pressure is not None:
        floor = number[floor_of_heights(height, elevation, settings.carried_m, own)]
    return Heights(height, floor)
