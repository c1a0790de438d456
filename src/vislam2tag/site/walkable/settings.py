"""How walkable space is found on a plan."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import SettingsRecord


class WalkableSettings(SettingsRecord):
    """How walkable space is found on a plan."""

    removed = frozenset(("graph", "region_m2", "stroke_share", "swing_m", "symbol_m", "wall_m"))
    cell_m: float = Field(default=0.1, gt=0)
    """Side of a cell, metres; larger where the plan would have more than ``max_cells``."""
    max_cells: int = Field(default=4_000_000, ge=10_000)
    """Most cells of a plan: what bounds memory."""
    max_pixels: int = Field(default=6_000_000, ge=10_000)
    """Most pixels at which walls are looked for on an image; larger images are reduced."""
    wall_contrast: float | None = Field(default=None, gt=0, lt=1)
    """Ink that differs from the paper by more than this (1: black on white) is a wall; else than Otsu's threshold."""
    passage_m: float = Field(default=0.5, ge=0)
    """Nobody gets through what is narrower than this, metres."""
    entrance_m: float = Field(default=3.0, ge=0)
    """Gaps in the outer wall up to this width do not make the inside part of the outside, metres."""
