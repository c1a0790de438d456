"""How walkable space is found on a plan, and how it becomes a graph."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord


class GraphSettings(FiniteRecord):
    """How walkable space becomes a graph."""

    spur_share: float = Field(default=0.5, gt=0)
    """A branch into a corner is no dead end where it leaves the largest disc at its foot by less than this share of
    the disc's radius."""
    merge_m: float = Field(default=1.0, ge=0)
    """Nodes nearer to each other than this (or than the corridor's half width there) become one, metres."""
    turn_rad: float = Field(default=0.6, gt=0, lt=3.14)
    """A corridor that changes its direction by more than this makes a turn, rad."""
    door_m: float = Field(default=1.4, ge=0)
    """A short passage narrower than this is a door, metres."""
    door_depth_m: float = Field(default=2.0, gt=0)
    """A narrow passage longer than this is a corridor, metres."""
    room_m: float = Field(default=12.0, ge=0)
    """What lies behind doors and has more metres of graph than this is a corridor, not a room."""
    hall_m: float = Field(default=8.0, gt=0)
    """Where the walls are farther apart than this, a floor is an open area, metres."""
    hall_step_m: float = Field(default=6.0, gt=0)
    """Distance of nodes in open areas, metres."""


class WalkableSettings(FiniteRecord):
    """How walkable space is found on a plan."""

    cell_m: float = Field(default=0.1, gt=0)
    """Side of a cell, metres; larger where the plan would have more than ``max_cells``."""
    max_cells: int = Field(default=4_000_000, ge=10_000)
    """Most cells of a plan: what bounds memory."""
    max_pixels: int = Field(default=6_000_000, ge=10_000)
    """Most pixels at which walls are looked for on an image; larger images are reduced."""
    wall_contrast: float | None = Field(default=None, gt=0, lt=1)
    """Ink that differs from the paper by more than this (1: black on white) is a wall; else than Otsu's threshold."""
    wall_m: float = Field(default=0.1, gt=0)
    """Thickness of walls that are given as lines, metres."""
    stroke_share: float = Field(default=0.4, ge=0, lt=1)
    """Strokes thinner than this share of the walls' usual thickness are no walls: door swings, dimensions, text."""
    symbol_m: float = Field(default=2.0, ge=0)
    """Ink that touches nothing else and fits into a square of this side is no wall: text, furniture; metres."""
    swing_m: tuple[float, float] = (0.5, 1.4)
    """Quarter circles with a radius in this range are swings of doors, metres."""
    passage_m: float = Field(default=0.5, ge=0)
    """Nobody gets through what is narrower than this, metres."""
    entrance_m: float = Field(default=3.0, ge=0)
    """Gaps in the outer wall up to this width do not make the inside part of the outside, metres."""
    region_m2: float = Field(default=4.0, gt=0)
    """Closed-off regions smaller than this are not reported, square metres."""
    graph: GraphSettings = GraphSettings()
