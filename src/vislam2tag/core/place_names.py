"""Places as people on site find them: by the landmarks that hang near."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.tracks import Landmarks

NAMED = 2
"""So many landmarks tell where a place is: two distances leave two places at most."""


def near_landmarks(landmarks: Landmarks, floor: int, place_m: tuple[float, float]) -> str:
    """Name a place (BCS) by the surveyed landmarks of its floor: ``3 m from landmark 9, 12 m from landmark 4``.

    Empty where the floor has none.
    """
    here = landmarks.on_floor(floor)
    away_m = np.linalg.norm(here.position_bcs - np.asarray(place_m), axis=1)
    surveyed = here.surveyed
    rows = [row for row in np.argsort(away_m, kind="stable").tolist() if surveyed[row]]
    return ", ".join(f"{away_m[row]:.0f} m from landmark {here.ids[row]}" for row in rows[:NAMED])
