"""A floor's landmark table that is turned by a quarter against the plan: landmarks lie beside the plan, but would not.

Walks cannot tell it: they fit a table however it is turned as a whole. Nor do a plan's edges tell a half turn.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import ComplexArray
from vislam2tag.quality.diagnosis.evidence import Table
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.quality.diagnosis.words import REASON

BESIDE_M = 1.0
"""A landmark farther outside the plan than this does not hang on its outer wall."""
FEWEST_BESIDE, LEAST_SHARE = 2, 0.15
"""So many landmarks, and this share of them, must lie beside the plan."""


def turned_tables(table: Table) -> list[Fault]:
    """Name the floors whose table fits onto the plan when it is turned by a quarter, and not as it is."""
    found = []
    for floor, (width_m, height_m) in sorted(table.size_m.items()):
        places = np.array([table.place[mark] for mark in table.on(floor)])
        beside = _beside(places, width_m, height_m)
        if beside < max(FEWEST_BESIDE, LEAST_SHARE * len(places)) or _beside(1j * places + width_m, width_m, height_m):
            continue
        values = {"floor": floor, "turn_deg": 90.0, "shift_m": [width_m, 0.0], "reason": REASON}
        found.append(
            Fault(
                kind=FaultKind.TURNED,
                floor=floor,
                summary=f"the landmark table of floor {floor} is turned by a quarter against its plan",
                evidence=f"{beside} of {len(places)} landmarks lie beside the plan of {width_m:g} x {height_m:g} m, "
                "and none once the table is turned; whether by 90 or by 270 degrees the plan must tell (270: "
                f"turn_deg = 270.0, shift_m = [0.0, {height_m:g}])",
                corrections=[CorrectionEntry(table="turn_landmarks", values=values)],
            )
        )
    return found


def _beside(places: ComplexArray, width_m: float, height_m: float) -> int:
    x, y = places.real, places.imag
    outside = (x < -BESIDE_M) | (x > width_m + BESIDE_M) | (y < -BESIDE_M) | (y > height_m + BESIDE_M)
    return int(outside.sum())
