"""Input rules for coordinates: how far they may be from their origin, and how much floors and tables may span, metres.

An offset is no fault: coordinates of a national grid are millions of metres. Another unit shows in the span. Degrees
and kilometres make a building smaller than a metre, millimetres make it larger than a town.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.limits import MAX_FLOOR_M
from vislam2tag.intake.cells import LENGTHS_M

MAX_LOCAL_M = 1e6
"""No building reaches this far from the origin of its plan: such a coordinate is an error, or of a national grid."""
MAX_GRID_M = 1e8
"""National grids reach some ten thousand kilometres."""


@dataclass(frozen=True)
class Extent:
    """Possible lengths of something, metres; those above ``usual_m`` are used, with a warning."""

    name: str
    least_m: float
    usual_m: float
    greatest_m: float

    def cause(self, length_m: float) -> str:
        """Why a length is not possible or not usual, a clause; empty if nothing is odd."""
        if length_m < self.least_m:
            return f"{self.name} is at least {self.least_m:g} m long. Possible cause: degrees or kilometres"
        if length_m > self.usual_m:
            return (
                f"{self.name} is rarely longer than {self.usual_m:,.0f} m and never than {self.greatest_m:,.0f} m. "
                "Possible cause: centimetres, millimetres, or points far away from the others"
            )
        return ""

    def refuses(self, length_m: float) -> bool:
        """Whether a length is not possible."""
        return not self.least_m <= length_m <= self.greatest_m


FLOOR = Extent("a floor", 1.0, 3_000.0, MAX_FLOOR_M)
"""A side of a floor or of its plan. A cupboard is 1 m deep, and the largest buildings are 2 km long."""
POSITIONS = Extent("a floor with several points", 1.0, 3_000.0, MAX_FLOOR_M)
"""What the landmarks of a floor, surveyed points, or the fingerprints of a building span along an axis."""
LARGE_PLAN_M = 1_000.0
"""Few buildings are larger. A larger plan is more likely in other units."""
UNITS_M = {name: LENGTHS_M[name] for name in ("metre", "centimetre", "millimetre", "inch", "foot")}
"""Metres a unit of drawings, the usual ones."""
_METRIC = ("metre", "centimetre", "millimetre")
_DOOR_M = (0.4, 2.0)
"""Radius of the usual swing of a floor's doors, metres."""
SMALL_FLOOR_M = 5.0
"""Few floors are shorter. A shorter one more likely has a wrong scale."""
MIN_POINTS = 3
"""Two landmarks may be next to each other."""
MAX_RATIO = 30.0
"""No floor is so many times as long as another one of its building, or as what its landmarks span. The factor is 39 for
inches and 100 for centimetres."""
SAME_CORNER_M = 0.01
"""Plans without known points or coordinates of their own begin at the same corner."""
SIZE_TOLERANCE = 0.03
"""Sizes are rounded to half a metre, and outer walls differ from floor to floor."""
_MIN_SHARED = 0.1
"""Floors that share less than this of the shorter side along an axis are not above each other."""
Box = tuple[float, float, float, float]
"""Left, right, lower and upper edge, metres."""
_MAX_FAR_SHARE = 0.1
"""If more of the positions are far from all others, they are not single errors."""


def span_m(position: FloatArray) -> float:
    """The longer side of the box around the finite positions (n, 2), metres; NaN if there are fewer than two."""
    known = position[np.isfinite(position).all(axis=1)]
    return float(np.ptp(known, axis=0).max()) if len(known) > 1 else float("nan")


def floor_findings(file: str, sides_m: dict[int, tuple[float, float]]) -> list[Finding]:
    """Report floors (width and height by number) of unusual size, and sizes in one building that differ too much."""
    found = []
    for number, (width, height) in sides_m.items():
        if cause := FLOOR.cause(max(width, height)) or FLOOR.cause(min(width, height)):
            message = f"floor {number} is {width:g} m x {height:g} m, but {cause}. Check the unit of its size"
            found.append(Finding(kind="implausible_extent", file=file, count=1, message=message))
    longest = {number: max(each) for number, each in sides_m.items()}
    if longest and max(longest.values()) > MAX_RATIO * min(longest.values()):
        small, *_, large = sorted(longest, key=longest.__getitem__)
        message = (
            f"floor {large} is {longest[large]:g} m long and floor {small} {longest[small]:g} m: check that the sizes "
            "of all floors are in metres"
        )
        found.append(Finding(kind="implausible_extent", file=file, count=2, message=message))
    return found


class FloorFit(Enum):
    """How a floor fits another one of its building."""

    FITS = auto()
    """They are above each other and have the same size."""
    DIFFERS = auto()
    """They are above each other, and their sizes and shapes have nothing in common: no fault can be seen."""
    APART = auto()
    """They are not above each other: their plans have different origins."""
    OTHER_SIZE = auto()
    """Same shape, another size: one of the scales is wrong."""
    OTHER_SHAPE = auto()
    """Same corner, another size and shape: the drawings may begin at different places."""


def floor_fit(one: Box, other: Box) -> FloorFit:
    """Compare two floors by left, right, lower and upper edge in their shared frame, metres."""
    axes = ((0, 1), (2, 3))
    shared = [min(one[end], other[end]) - max(one[start], other[start]) for start, end in axes]
    sides = [(one[end] - one[start], other[end] - other[start]) for start, end in axes]
    if any(length < _MIN_SHARED * min(pair) for length, pair in zip(shared, sides, strict=True)):
        return FloorFit.APART
    ratios = [side / other_side for side, other_side in sides]
    if not any(map(is_other_size, ratios)):
        return FloorFit.FITS
    if not is_other_size(ratios[0] / ratios[1]):
        return FloorFit.OTHER_SIZE
    same_corner = max(abs(one[0] - other[0]), abs(one[2] - other[2])) <= SAME_CORNER_M
    return FloorFit.OTHER_SHAPE if same_corner else FloorFit.DIFFERS


def is_other_size(ratio: float) -> bool:
    """Whether two lengths of this ratio are not the same one, however they were rounded."""
    return max(ratio, 1 / ratio) > 1 + SIZE_TOLERANCE


def unit_fits(sides: tuple[float, float], door: float | None, unit_m: float) -> bool:
    """Whether a plan's sides, and the radius of its usual door swing if it has one, are those of a floor in a unit."""
    of_floor = not any(FLOOR.cause(side * unit_m) for side in sides)
    return of_floor and (door is None or _DOOR_M[0] <= door * unit_m <= _DOOR_M[1])


def unit_doubt(sides: tuple[float, float], door: float | None, unit_m: float, *, metric: bool) -> str:
    """Why the unit that a drawing's header states may be wrong, and the others that fit; empty if nothing is odd.

    ``metric``: whether the header says so. ``sides`` and ``door`` as :func:`unit_fits`, units of the file.
    """
    stated = next((name for name, each in UNITS_M.items() if np.isclose(each, unit_m)), f"{unit_m:g} m")
    fits = unit_fits(sides, door, unit_m)
    if fits and (door is not None or not metric or stated in _METRIC or stated not in UNITS_M):
        return ""
    others = [name for name in UNITS_M if name != stated and (name in _METRIC or not metric)]
    choices = fitting_units(sides, door, others)
    size = _sides_m(sides, unit_m)
    why = (
        "but also that it is metric"
        if fits
        else "which no floor" + ("" if door is None else " with such doors") + " is"
    )
    return f"a unit is 1 {stated} ({size}), {why}: use {choices}" if choices else ""


def fitting_units(sides: tuple[float, float], door: float | None, names: Iterable[str] = UNITS_M) -> str:
    """The options for the usual units that fit, with the size they give; empty if none does; as :func:`unit_fits`."""
    choices = [
        f"--unit-m {UNITS_M[name]:g} if a unit is 1 {name} ({_sides_m(sides, UNITS_M[name])})"
        for name in names
        if unit_fits(sides, door, UNITS_M[name]) and max(sides) * UNITS_M[name] >= SMALL_FLOOR_M
    ]
    return " or ".join(choices)


def scale_doubt(sides: tuple[float, float], door: float | None, unit_m: float) -> str:
    """Why the scale that a user chose is wrong, a sentence without its cure; empty if nothing is odd.

    ``sides`` and ``door`` as :func:`unit_fits`, units of the file.
    """
    if unit_fits(sides, door, unit_m) and max(sides) * unit_m >= SMALL_FLOOR_M:
        return ""
    doors = "" if door is None else f" and its doors are {door * unit_m:.2g} m wide"
    return f"the floor is {_sides_m(sides, unit_m)}{doors}, so its scale is wrong"


def _sides_m(sides: tuple[float, float], unit_m: float) -> str:
    metres = (side * unit_m for side in sides)
    return " x ".join(f"{side:,.0f} m" if side >= 100 else f"{side:.3g} m" for side in metres)


def landmark_findings(floor: int, position: FloatArray, plan_m: tuple[float, float] | None) -> list[Finding]:
    """Report the landmarks (n, 2) of a floor if their span is not possible, or too small for its plan's sides."""
    span, count = span_m(position), int(np.isfinite(position).all(axis=1).sum())
    if count < MIN_POINTS:
        return []
    if cause := POSITIONS.cause(span):
        message = (
            f"the {count} landmarks of floor {floor} span {span:.3g} m, but {cause}. Write them in metres from the "
            "plan's origin"
        )
        severity = Severity.ERROR if POSITIONS.refuses(span) else Severity.WARNING
        return [Finding(kind="implausible_extent", file="", count=count, message=message, severity=severity)]
    if plan_m is None or count == MIN_POINTS or max(plan_m) <= MAX_RATIO * span:
        return []
    message = (
        f"the {count} landmarks of floor {floor} span {span:.3g} m of a plan that is {max(plan_m):g} m long: check "
        "that the size of the floor is in metres"
    )
    return [Finding(kind="implausible_extent", file="", count=count, message=message)]


def too_far(names: Sequence[str], position: FloatArray) -> str:
    """Why positions (n, 2) with these names cannot be read in a site's files, a sentence; empty if they can."""
    far = [name for name, place in zip(names, position, strict=True) if not np.abs(place).max() <= MAX_LOCAL_M]
    if not far:
        return ""
    return (
        f"the coordinates of {far[0]} are larger than {MAX_LOCAL_M:g} m, as in a national grid, and a site's files may "
        "not contain them. Use an origin in the building: place the plan there, and convert points of the grid with "
        "vislam2tag register --control"
    )


def refused_positions(names: Sequence[str], position: FloatArray) -> str:
    """Why positions (n, 2) with these names are not those of points to survey, a sentence; empty if they may be."""
    span = span_m(position)
    if len(set(names)) < MIN_POINTS or not span < POSITIONS.least_m:
        return ""
    return f"{len(set(names))} points span {span:.3g} m, but {POSITIONS.cause(span)}. Convert them to metres"


def fingerprint_problem(rows: pl.DataFrame) -> str:
    """Why the positions of a data set are not metres, a sentence; empty if they may be.

    ``rows``: ``building``, ``x``, ``y`` of fingerprints. One position for all is no such fault.
    """
    known = rows.drop_nulls(["x", "y"])
    widest = float(max(_spans_m(known), default=0.0) or known.select(_SPAN).item() or 0.0)
    if 0 < widest < POSITIONS.least_m:
        x, y = known.select("x", "y").to_numpy().mean(axis=0).tolist()
        return (
            f"the positions span {widest:.3g} m about ({x:g}, {y:g}), but {POSITIONS.cause(widest)}. Convert them to "
            "metres, for example to UTM, and import the files again"
        )
    far = known.filter(is_far())
    if far.height <= _MAX_FAR_SHARE * known.height:
        return ""
    return (
        f"{far.height} of {known.height} positions are more than {MAX_FLOOR_M / 2:,.0f} m from the centre of their "
        f"building, but {POSITIONS.cause(MAX_FLOOR_M)}. Convert them to metres, and import the files again"
    )


def is_far() -> pl.Expr:
    """Whether ``x`` or ``y`` is further from the median of its ``building`` than any building reaches."""
    away = [(pl.col(axis) - pl.col(axis).median().over("building")).abs() for axis in ("x", "y")]
    return pl.max_horizontal(away) > MAX_FLOOR_M / 2


def fingerprint_findings(rows: pl.DataFrame) -> list[Finding]:
    """Report single positions far from all others, and fingerprints that all have one position; ``rows`` as above."""
    known = rows.drop_nulls(["x", "y"])
    far = known.filter(is_far()).height
    found = []
    if far:
        message = (
            f"positions are more than {MAX_FLOOR_M / 2:,.0f} m from the centre of their building, so they are left "
            "out: correct them"
        )
        found.append(Finding(kind="implausible_extent", file="", count=far, message=message))
    widest = float(max(_spans_m(known.filter(~is_far())), default=0.0))
    if widest > POSITIONS.usual_m:
        message = f"the positions of a building span {widest:,.0f} m, but {POSITIONS.cause(widest)}. Check their unit"
        found.append(Finding(kind="implausible_extent", file="", count=known.height, message=message))
    if known.height >= MIN_POINTS and known.select(pl.struct("x", "y").n_unique()).item() == 1:
        message = "all fingerprints have the same position: check the columns of the coordinates"
        found.append(Finding(kind="implausible_extent", file="", count=known.height, message=message))
    return found


_SPAN = pl.max_horizontal(pl.col("x").max() - pl.col("x").min(), pl.col("y").max() - pl.col("y").min()).alias("span")


def _spans_m(rows: pl.DataFrame) -> list[float]:
    """The longer side of the box around the positions of each building, metres."""
    return rows.group_by("building").agg(_SPAN)["span"].to_list()
