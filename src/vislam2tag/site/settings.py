"""Settings of a site: what is taken for granted of landmarks, and how walkable space is found on a plan."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord, SettingsRecord

SETTINGS_FILE = "vislam2tag.toml"
"""In a survey's folder: settings of the commands that read it."""


class SurveySettings(FiniteRecord):
    """What is taken for granted of landmarks."""

    landmark_sigma_m: float = Field(default=0.02, gt=0)
    """Standard deviation per axis of a surveyed landmark whose file gives none, metres. The default suits a total
    station and a sheet hung by hand.
    """
    use_planned: bool = False
    """Use positions of landmarks that are planned and not yet measured, with a sigma of 0.1 m."""


class WalkableSettings(SettingsRecord):
    """How walkable space is found on a plan."""

    removed = frozenset(("graph", "region_m2", "stroke_share", "swing_m", "symbol_m", "wall_m"))
    cell_m: float = Field(default=0.1, gt=0)
    """Side of a cell, metres. Cells are larger if the plan would have more than ``max_cells``."""
    max_cells: int = Field(default=4_000_000, ge=10_000)
    """Largest number of cells of a plan. It limits the memory."""
    max_pixels: int = Field(default=6_000_000, ge=10_000)
    """Largest number of pixels for the search of walls in an image. Larger images are reduced."""
    wall_contrast: float | None = Field(default=None, gt=0, lt=1)
    """Smallest contrast of a wall with the paper; 1 is black on white. Without a value, Otsu's threshold is used."""
    passage_m: float = Field(default=0.5, ge=0)
    """Narrower passages are not walkable, metres."""
    entrance_m: float = Field(default=3.0, ge=0)
    """Largest gap in the outer wall that counts as an entrance, metres. Wider gaps open the building to the outside."""
