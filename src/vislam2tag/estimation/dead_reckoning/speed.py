"""How fast a window of walking is: linear in its features, the coefficients learned (``training``)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.dead_reckoning.features import NAMES, WindowFeatures

COEFFICIENTS = "speed_model.json"
"""File of the package with the coefficients, and what they were learned from."""
FASTEST_M_S = 3.0


@dataclass(frozen=True)
class SpeedModel:
    """``coefficients`` (28,) by :data:`~vislam2tag.estimation.dead_reckoning.features.NAMES`, m/s."""

    coefficients: FloatArray

    def speed_m_s(self, features: WindowFeatures, time_s: FloatArray) -> FloatArray:
        """Speed (n,) at the moments ``time_s`` (n,) of a walk."""
        window = (features.values @ self.coefficients).clip(0, FASTEST_M_S) * features.moving
        return np.asarray(np.interp(time_s, features.time_s, window))


@cache
def speed_model() -> SpeedModel:
    """The model that comes with the package."""
    record = json.loads(files(__package__).joinpath(COEFFICIENTS).read_text(encoding="utf-8"))
    return SpeedModel(np.array([record["coefficients"][name] for name in NAMES]))
