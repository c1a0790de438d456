"""Every setting of a plan: what is demanded of it, how sheets are seen, how long is searched."""

from __future__ import annotations

from math import sqrt, tan
from typing import Annotated

from pydantic import Field

from vislam2tag.common.records import SettingsRecord
from vislam2tag.preparation.sheets.settings import SHEET_SIZES, SheetSize

Angle = Annotated[float, Field(gt=0.1, lt=3.0)]
FILLED = 0.25
"""Share of the picture that an image must fill to be recognised at first (ARCore)."""
ASIDE_M = 0.75
"""Distance of the phone from the middle of the way when passing a sheet without a detour, metres ..."""
DETOUR_M = 3.6
"""... and at most, if the largest sheet requires it: half of the widest corridor, metres."""


class CameraSettings(SettingsRecord):
    """What a phone's camera sees, and how near the phone comes to a wall."""

    removed = frozenset(("aside_m", "detour_m", "filled"))
    field_of_view_rad: tuple[Angle, Angle] = (1.1694, 0.925)
    """Angles of view along the longer and the shorter side of the picture, rad. The default is a 26 mm equivalent lens,
    67 x 53 degrees.
    """
    nearest_m: float = Field(default=0.3, gt=0)
    """Smallest distance of the phone from a wall in passing, metres."""
    range_m: float = Field(default=3.0, gt=0)
    """Largest distance at which a sheet is recognised in passing, metres."""
    angle_rad: float = Field(default=1.05, gt=0, lt=1.57)
    """Largest angle to the sheet's normal at which it is recognised in passing, rad."""

    def fill_distance_m(self, size: SheetSize) -> float:
        """Distance from which the square image of a sheet just fills its share of the picture, metres."""
        long, short = (tan(angle / 2) for angle in self.field_of_view_rad)
        return size.image_m / (2 * sqrt(FILLED * long * short))

    def sheet_for(self, line_m: float, sheets: tuple[str, ...], detour_m: float) -> tuple[SheetSize, float] | None:
        """The smallest of some sheets that is recognised in passing a wall ``line_m`` from the middle of the way.

        Without a detour where one is large enough for that, else the largest, with a detour of at most ``detour_m``.
        Also the distance in passing, metres; None where the wall is too far off.
        """
        sizes = sorted((SHEET_SIZES[name] for name in sheets), key=lambda size: size.image_m)
        easy_m = max(line_m - ASIDE_M, self.nearest_m)
        for size in sizes:
            if self.fill_distance_m(size) >= easy_m:
                return size, easy_m
        reach_m = self.fill_distance_m(sizes[-1])
        return (sizes[-1], reach_m) if self.nearest_m <= reach_m and line_m - detour_m <= reach_m else None


class PlanSettings(SettingsRecord):
    """What is demanded of a plan, and where sheets may hang (docs/explanation/planning.md)."""

    removed = frozenset(("flat_m", "gap", "margin_m", "nodes", "off_turn_m"))
    spacing_m: float = Field(default=15.0, ge=2, le=1000)
    """Largest distance of a walk without a landmark, metres."""
    short_m: float = Field(default=3.0, ge=0)
    """Turns within this distance count as one and need no landmark between them, metres."""
    turn_rad: float = Field(default=0.6, gt=0, lt=3.14)
    """A larger change of direction is a critical turn, rad."""
    rooms: bool = False
    """Whether walks through rooms need landmarks as corridors do. Otherwise a walk only enters a room and leaves it
    again.
    """
    sheets: tuple[str, ...] = Field(default=("A4", "A3"), min_length=1)
    """Allowed paper sizes."""
    camera: CameraSettings = CameraSettings()
    step_m: float = Field(default=1.0, ge=0.1)
    """Distance between candidate places for landmarks, metres."""
    visible_m: float = Field(default=2.0, ge=0)
    """Smallest length of the way on which a sheet is in view, metres."""
    height_m: float = Field(default=1.4, gt=0)
    """Height of the centre of a sheet above the floor, metres."""
    survey_sigma_m: float = Field(default=0.02, gt=0)
    """Standard deviation per axis with which the landmarks will be surveyed, metres. The predicted label error depends
    on it.
    """
    speed_m_s: float = Field(default=1.0, gt=0)
    """Walking speed of the tour."""
    further: int = Field(default=3, ge=0)
    """Number of additional landmarks to propose, with the gain of each."""
    time_limit_s: float = Field(default=120.0, gt=0)
    """Time limit of the search on each floor, seconds."""

    @property
    def niche_m(self) -> float:
        """Dead ends shorter than this are looked into and left again, like rooms: in and out within the spacing."""
        return self.spacing_m / 2
