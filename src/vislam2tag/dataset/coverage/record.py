"""Coverage as JSON (``coverage.json``): what is covered on each floor, and the walks that fill the gaps."""

from __future__ import annotations

from collections.abc import Sequence

from vislam2tag.common.records import Record
from vislam2tag.dataset.coverage.floor_coverage import FloorCoverage
from vislam2tag.dataset.coverage.gap_walk import GapWalk
from vislam2tag.dataset.settings import CoverageSettings


class WalkRecord(Record):
    """One walk to make; corners and stops are in the BCS, metres, in order."""

    length_m: float
    minutes: float
    gap_m2: float
    points_m: list[tuple[float, float]]
    stops_m: list[tuple[float, float]]


class FloorCoverageRecord(Record):
    """One floor."""

    building: str
    floor: int
    cell_m: float
    walkable_m2: float
    covered_m2: float
    share: float | None
    """None where only the fingerprints themselves tell what is walkable."""
    fingerprints: int
    far: int
    """Fingerprints too far from the others to be counted."""
    walks: list[WalkRecord]


class CoverageRecord(Record):
    """All floors."""

    settings: CoverageSettings
    technology: str
    floors: list[FloorCoverageRecord]


def floor_record(coverage: FloorCoverage, walks: Sequence[GapWalk]) -> FloorCoverageRecord:
    """Reduce one floor's cells."""
    building, floor = coverage.storey
    cell_m2 = coverage.grid.cell_m**2
    return FloorCoverageRecord(
        building=building,
        floor=floor,
        cell_m=coverage.grid.cell_m,
        walkable_m2=round(float(coverage.walkable.sum()) * cell_m2, 3),
        covered_m2=round(float(coverage.covered.sum()) * cell_m2, 3),
        share=round(coverage.share, 6) if coverage.share is not None and coverage.tells else None,
        fingerprints=int(coverage.total.sum()),
        far=coverage.far,
        walks=[_walk_record(walk, cell_m2) for walk in walks],
    )


def _walk_record(walk: GapWalk, cell_m2: float) -> WalkRecord:
    return WalkRecord(
        length_m=round(walk.length_m, 3),
        minutes=round(walk.minutes(), 3),
        gap_m2=round(walk.gap_cells * cell_m2, 3),
        points_m=[(round(x, 3), round(y, 3)) for x, y in walk.points_m.tolist()],
        stops_m=[(round(x, 3), round(y, 3)) for x, y in walk.stops_m.tolist()],
    )
