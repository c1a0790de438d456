"""What the server tells of radio maps, as JSON; the cells of a map come as Arrow."""

from __future__ import annotations

from typing import Literal, TypeAlias

from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.changes import ChangedPoint
from vislam2tag.studio.messages import Box, Point

RadioLayer: TypeAlias = Literal["strongest", "number", "mean_dbm", "deviation_db", "sigma_db", "heard"]


class RadioPoint(FiniteRecord):
    """An access point with a map."""

    bssid: str
    ssid: str | None
    readings: int
    loudest_dbm: float | None
    rms_db: float | None
    """Of readings that were predicted without their own walk."""
    place_m: Point | None
    """Where it is estimated to be: where its map is loudest, BCS."""


class RadioFloor(FiniteRecord):
    """The maps of a floor and technology, most heard first; all of the same cells."""

    floor: int
    technology: str
    extent_m: Box
    rows: int
    columns: int
    access_points: list[RadioPoint]


class RadioChanges(FiniteRecord):
    """What changed between the labels and another output."""

    output: str
    technology: str
    counts: dict[str, int]
    changed: list[ChangedPoint]


class RadioView(FiniteRecord):
    """All radio maps; ``stale``: labels have changed since."""

    state: Literal["none", "stale", "ready"]
    floors: list[RadioFloor]
    changes: list[RadioChanges]
