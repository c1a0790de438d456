"""What the page shows of a floor beside its sessions: the map and what is odd about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import compress

import numpy as np

from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import LandmarkContradiction
from vislam2tag.survey.model import Floor
from vislam2tag.views.floor_map.figures import floor_figure, surveyed_on
from vislam2tag.views.floor_map.plan import drawn_plan
from vislam2tag.views.run_page.views import SessionView

_TOLERANCE_M = 1.0
"""How far outside the plan a landmark may lie without a word: sheets hang on outer walls."""


@dataclass(frozen=True)
class FloorView:
    """A floor's map and its sessions, which pass by once."""

    floor: Floor
    landmarks: Landmarks
    sessions: Iterator[SessionView] | None
    """None where no session lies under this floor, though walks led to it."""
    contradictions: tuple[LandmarkContradiction, ...] = ()
    """Landmarks of this floor that contradict the rest."""

    @property
    def title(self) -> str:
        """The floor's name where it says more than its number."""
        number = self.floor.number
        return "" if self.floor.name.casefold() in (str(number), f"floor {number}") else self.floor.name

    @property
    def figure(self) -> str:
        """The map as Plotly's JSON, without the sessions."""
        return floor_figure(self.floor, self.landmarks, self._plan[0], self.contradictions)

    @property
    def notes(self) -> list[str]:
        """Sentences on what the map lacks and on what lies beside the plan."""
        visited = "No session starts here; walks from other floors led here." if self.sessions is None else ""
        return [note for note in (visited, self._plan[1], self._outside()) if note]

    @property
    def unplaced(self) -> list[str]:
        """Landmarks of this floor that nobody surveyed."""
        here = (self.landmarks.floor == self.floor.number) & ~self.landmarks.surveyed
        return list(compress(self.landmarks.ids, here))

    @cached_property
    def _plan(self) -> tuple[str | None, str]:
        """The plan as a data URI where it can be drawn, else a sentence that says why not."""
        return drawn_plan(self.floor)

    def _outside(self) -> str:
        """Name the surveyed landmarks beside the plan; empty where there is none."""
        if self.floor.extent_m is None:
            return ""
        low, high = self.floor.corners_m
        beside = np.maximum(low - self.landmarks.position_bcs, self.landmarks.position_bcs - high)
        wanted = surveyed_on(self.floor, self.landmarks) & (beside > _TOLERANCE_M).any(axis=1)
        ids = list(compress(self.landmarks.ids, wanted))
        if not ids:
            return ""
        size = f"{self.floor.width_m:g} m x {self.floor.height_m:g} m"
        return f"Surveyed landmarks outside the plan of {size}: {', '.join(ids)}. Check their positions or its size."
