"""How good positions are: the figures that the field reports (ISO/IEC 18305, EvAAL, IPIN competition)."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.positioning.places import Positions, ScanPlaces

FLOOR_PENALTY_M = 15.0
"""What a wrong floor costs in the IPIN score, metres a floor."""
BUILDING_PENALTY_M = 50.0
"""What a wrong building costs in the IPIN score (EvAAL-ETRI), metres."""


class ErrorQuantiles(Record):
    """Errors of scans, metres; None without any."""

    scans: int
    mean_m: float | None = None
    median_m: float | None = None
    p75_m: float | None = None
    p95_m: float | None = None
    rmse_m: float | None = None
    max_m: float | None = None


class Score(Record):
    """Figures of one model on one test part."""

    scans: int
    """All scans of the test part."""
    answered: float
    """Share of them that the model did not call unknown, 0 to 1; all other figures are over those."""
    floor_hit: float | None
    """Share on the right floor (and in the right building)."""
    building_hit: float | None
    plane: ErrorQuantiles
    """Error in the plane, whatever the floor."""
    plane_on_floor: ErrorQuantiles
    """The same of scans on the right floor."""
    space: ErrorQuantiles
    """Error in space, where heights are known."""
    ipin_m: float | None
    """Third quartile of the error in the plane plus 15 m for each floor off (50 m for a wrong building)."""
    inside_68: float | None
    """Share of true places inside the stated 68 % circle; None where none is stated."""
    inside_95: float | None


def plane_error_m(found: Positions, truth: ScanPlaces) -> FloatArray:
    """(n,) distance in the plane; NaN where the answer is unknown."""
    return truth.distance_m(found.xy)


def score(found: Positions, truth: ScanPlaces) -> Score:
    """Compare positions (n) with the truth (n); the truth's storeys must be the model's.

    Raises ValueError where they are not.
    """
    if found.storeys != truth.storeys:
        raise ValueError("positions and truth number their storeys differently")
    known = found.known
    answered, true = found[known], truth[known]
    error = plane_error_m(answered, true)
    right = answered.storey == true.storey
    same_building = _buildings(found)[answered.storey] == _buildings(found)[true.storey]
    return Score(
        scans=len(truth),
        answered=float(known.mean()) if len(truth) else 0.0,
        floor_hit=_share(right),
        building_hit=_share(same_building),
        plane=error_quantiles(error),
        plane_on_floor=error_quantiles(error[right]),
        space=error_quantiles(np.hypot(error, answered.z - true.z)),
        ipin_m=error_quantiles(error + _penalty_m(answered, true, same_building)).p75_m,
        inside_68=_inside(error, answered.radius_68_m),
        inside_95=_inside(error, answered.radius_95_m),
    )


def error_quantiles(error_m: FloatArray) -> ErrorQuantiles:
    """Reduce errors (n,) to figures; those that are not finite are left out."""
    error_m = error_m[np.isfinite(error_m)]
    if not len(error_m):
        return ErrorQuantiles(scans=0)
    median, p75, p95 = np.quantile(error_m, [0.5, 0.75, 0.95])
    return ErrorQuantiles(
        scans=len(error_m),
        mean_m=float(error_m.mean()),
        median_m=float(median),
        p75_m=float(p75),
        p95_m=float(p95),
        rmse_m=float(np.sqrt(np.mean(error_m**2))),
        max_m=float(error_m.max()),
    )


def _penalty_m(found: Positions, truth: ScanPlaces, same_building: BoolArray) -> FloatArray:
    """(n,) what wrong floors and buildings cost, metres."""
    floors_off = np.abs(found.floor - truth.floor)
    return np.asarray(FLOOR_PENALTY_M * floors_off + np.where(same_building, 0.0, BUILDING_PENALTY_M))


def _buildings(found: Positions) -> FloatArray:
    """(storeys,) a number for each storey's building."""
    names = [storey.building for storey in found.storeys]
    return np.array([names.index(name) for name in names])


def _inside(error_m: FloatArray, radius_m: FloatArray) -> float | None:
    """Share of errors (n,) within radii (n,); None where none is stated."""
    stated = np.isfinite(radius_m) & np.isfinite(error_m)
    return _share(error_m[stated] <= radius_m[stated])


def _share(hits: BoolArray) -> float | None:
    """Share of hits (n,); None of none."""
    return float(hits.mean()) if len(hits) else None
