"""Positions of a floor's landmarks and control points from all that was measured."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.transforms import as_complex
from vislam2tag.intake.extents import MAX_LOCAL_M
from vislam2tag.preparation.registration.names import (
    FAR_M,
    LandmarkTable,
    NameRules,
    Role,
    control_key,
    id_findings,
    role_of,
)
from vislam2tag.preparation.registration.network import KNOWN, Measurement, adjust_heights
from vislam2tag.preparation.registration.network_search import GrossError, search_network
from vislam2tag.preparation.registration.point_columns import PointColumn
from vislam2tag.preparation.registration.point_file import read_points
from vislam2tag.preparation.registration.record import (
    INTERCHANGED,
    RegisteredPoint,
    Registration,
    RegistrationSettings,
    Repeat,
)
from vislam2tag.preparation.registration.results import (
    clicked_point,
    network_findings,
    plane_residuals,
    scale_test,
    station_points,
    station_rows,
)
from vislam2tag.preparation.registration.tape_and_clicks import Click, TapeDistance, Target
from vislam2tag.preparation.registration.trilateration import PlanBounds, TapeResult, trilaterate
from vislam2tag.site.model import Site

ALL = "all"
"""Of the known points of the site: every one."""


def read_stations(
    paths: Sequence[Path],
    columns: Sequence[PointColumn | None] | None,
    codes: Sequence[str],
    rules: NameRules,
    settings: RegistrationSettings,
) -> tuple[list[Measurement], list[Finding]]:
    """Read total-station exports: a file is a station, unless a column names stations.

    Only shots with one of these point ``codes`` count, where any is given; the others are a finding. Raises
    SurveyError where a file cannot be used, or two files would be one station.
    """
    stems = [path.stem for path in paths]
    if double := [path for i, path in enumerate(paths) if path.stem in stems[:i]]:
        raise SurveyError(
            f"{double[0]}: another file has the same name, which is used as the name of its station; rename one"
        )
    shots: list[Measurement] = []
    findings: list[Finding] = []
    for path in paths:
        rows, problems = read_points(path, columns)
        findings += problems
        if other := [row for row in rows if codes and row.code not in codes]:
            lines = [int(row.source.rpartition(":")[2]) for row in other]
            message = f"these rows have another point code than {', '.join(codes)} and are skipped"
            findings.append(Finding.at_lines("other_code", path.name, lines, message, Severity.INFO))
        shots += [
            _named(row, rules, settings.shot_sigma_m, row.station or path.stem)
            for row in rows
            if not codes or row.code in codes
        ]
    return shots, findings


def _named(row: Measurement, rules: NameRules, sigma_m: float, station: str = KNOWN) -> Measurement:
    """A row of a file by its point's key, with the usual sigma where it has none."""
    sigma_m = sigma_m if math.isnan(row.sigma_m) else row.sigma_m
    return replace(row, point=rules.key(row.point), station=station, sigma_m=sigma_m)


def read_known_points(
    path: Path, rules: NameRules, settings: RegistrationSettings
) -> tuple[list[Measurement], list[Finding]]:
    """Read known points (BCS metres; H above the floor).

    Raises SurveyError where a name comes twice, or coordinates are those of a national grid.
    """
    rows, findings = read_points(path)
    for row in rows:
        if max(abs(row.place.real), abs(row.place.imag)) > MAX_LOCAL_M:
            raise SurveyError(
                f"{row.source}: known point {row.point} is at ({row.place.real:.0f}, {row.place.imag:.0f}) m, as in a "
                "national grid, but --control needs building coordinates. Pass the points of the grid with --station, "
                "and at least two of them in building coordinates with --control"
            )
    found: dict[str, Measurement] = {}
    for row in rows:
        one = _named(row, rules, settings.control_sigma_m)
        first = found.setdefault(one.point, one)
        if first is not one:
            raise SurveyError(
                f"{row.source}: known point {row.point} is listed twice (first: {first.source}); keep one"
            )
    return list(found.values()), findings


def known_points_of_site(
    site: Site, floor: int, wanted: Sequence[str], rules: NameRules, settings: RegistrationSettings
) -> list[Measurement]:
    """Landmarks and control points of a floor as they are in the site's files, those ``wanted`` or :data:`ALL`.

    Landmarks that were only planned are not known. Raises UsageError where one is wanted that has no measured position.
    """
    found: dict[str, Measurement] = {}
    whole = site.landmarks.on_floor(floor)
    here = whole.without_planned_positions()
    for i in np.flatnonzero(here.surveyed).tolist():
        found[here.ids[i]] = Measurement(
            point=here.ids[i],
            place=complex(as_complex(here.position_bcs[i])),
            sigma_m=math.sqrt(float(np.trace(here.covariance_bcs[i])) / 2),
            height_m=float(here.z_m[i]),
            source=here.source[i] if here.source else "",
        )
    points = site.floor(floor).control_points
    for i, (name, place) in enumerate(zip(points.ids, points.position_bcs, strict=True)):
        key, source = control_key(name), points.source[i] if points.source else ""
        found[key] = Measurement(
            point=key, place=complex(as_complex(place)), sigma_m=settings.control_sigma_m, source=source
        )
    keys = set(found) if ALL in wanted else {rules.key(name) for name in wanted}
    if missing := sorted(keys - found.keys()):
        planned = ", only a planned one, which cannot be used" if missing[0] in whole.planned_ids else ""
        raise UsageError(f"--known {missing[0]}: floor {floor} has no measured position of this landmark{planned}")
    return [one for key, one in found.items() if key in keys]


def repeats(shots: Sequence[Measurement]) -> tuple[Repeat, ...]:
    """Points shot more than once from one station, with the spread of their shots."""
    places: dict[tuple[str, str], list[complex]] = defaultdict(list)
    for shot in shots:
        places[shot.station, shot.point].append(shot.place)
    found = []
    for (station, point), some in places.items():
        if len(some) > 1:
            values = np.array(some)
            spread = float(np.sqrt(np.sum(np.abs(values - values.mean()) ** 2) / (2 * (len(some) - 1))))
            found.append(Repeat(point=point, station=station, shots=len(some), spread_m=round(spread, 5)))
    return tuple(found)


CLICK_SIGMAS = 4.0
"""A landmark clicked so far from where it was measured is reported."""


def expected_findings(
    placed: Mapping[str, complex], expected: Mapping[str, complex], clicks: Mapping[str, Click]
) -> list[Finding]:
    """Report what differs from the site's positions and from clicks; two that lie in each other's place are named."""
    far = [name for name, place in placed.items() if name in expected and abs(place - expected[name]) > FAR_M]
    found: list[Finding] = []
    swapped: set[str] = set()
    for one, other in itertools.combinations(far, 2):
        if abs(placed[one] - expected[other]) < FAR_M and abs(placed[other] - expected[one]) < FAR_M:
            swapped |= {one, other}
            message = (
                f"landmarks {one} and {other} are at each other's position in the site: check whether their sheets "
                "or names are interchanged"
            )
            found.append(Finding(kind=INTERCHANGED, file="", count=2, message=message))
    for name in far:
        if name not in swapped:
            off = abs(placed[name] - expected[name])
            message = f"landmark {name} is {off:.2f} m from its position in the site"
            found.append(Finding(kind="moved_landmark", file="", count=1, message=message))
    if expected and (new := [name for name in placed if name not in expected]):
        message = f"the site has no position of landmark {', '.join(new)}: it is new, or its id is mistyped"
        found.append(Finding(kind="new_landmark", file="", count=len(new), message=message))
    for name, click in clicks.items():
        off = abs(placed[name] - click.place) if name in placed else 0.0
        if off > CLICK_SIGMAS * click.sigma_m:
            message = f"landmark {name} was clicked {off:.2f} m from its measured position"
            found.append(Finding(kind="click_differs", file="", count=1, message=message))
    return found


@dataclass(frozen=True)
class FloorMeasurements:
    """All measurements of one floor."""

    shots: Sequence[Measurement] = ()
    known: Sequence[Measurement] = ()
    height_sigma_m: float = RegistrationSettings().height_sigma_m
    """Of each height among them."""
    distances: Sequence[TapeDistance] = ()
    targets: Mapping[str, Target] = field(default_factory=dict)
    clicks: Mapping[str, Click] = field(default_factory=dict)
    expected: Mapping[str, complex] = field(default_factory=dict)
    """Where the site has landmarks already, surveyed or planned."""
    table: LandmarkTable | None = None
    """The landmarks that the site has there, with a position or without."""
    extent_m: PlanBounds | None = None
    """Of the plan: left, right, lower, upper, BCS."""


def register_floor(
    floor: int,
    measured: FloorMeasurements,
    *,
    free_scale: bool = False,
    findings: Sequence[Finding] = (),
) -> Registration:
    """Adjust everything; a landmark's position is of the best source that has one: station, tape, click.

    Raises SurveyError where the stations' frames are not determined.
    """
    start = Registration(version=__version__, floor=floor, findings=tuple(findings))
    points: dict[str, RegisteredPoint] = {}
    if measured.shots:
        start, points = _by_stations(start, measured, free_scale)
    taped = _by_tape(measured, points)
    landmarks = {key: one for key, one in points.items() if role_of(key)[0] is Role.LANDMARK} | taped.placed
    control = [one for key, one in points.items() if role_of(key)[0] is Role.CONTROL]
    known = _known(measured)
    for name, click in measured.clicks.items():
        if name not in landmarks and name not in known:
            landmarks[name] = clicked_point(click)
    placed = {name: complex(one.x_m, one.y_m) for name, one in landmarks.items()}
    unplaced = {name: why for name, why in (start.unplaced | taped.unplaced).items() if name not in landmarks}
    return start.model_copy(
        update={
            "landmarks": tuple(sorted(landmarks.values(), key=_natural)),
            "control_points": tuple(sorted(control, key=_natural)),
            "tape_residuals": tuple(taped.residuals),
            "errors": (*start.errors, *taped.errors),
            "unplaced": dict(sorted(unplaced.items())),
            "findings": (
                *start.findings,
                *_id_findings(measured, placed),
                *expected_findings(placed, measured.expected, measured.clicks),
            ),
        }
    )


def _id_findings(measured: FloorMeasurements, placed: Mapping[str, complex]) -> list[Finding]:
    """What is wrong with the names of the landmarks, where the site's table is known."""
    if measured.table is None:
        return []
    roles = (role_of(shot.point) for shot in measured.shots)
    ties = list(dict.fromkeys(name for role, name in roles if role is Role.TIE))
    return id_findings(measured.table, placed, ties, measured.expected)


def _by_stations(
    start: Registration, measured: FloorMeasurements, free_scale: bool
) -> tuple[Registration, dict[str, RegisteredPoint]]:
    """Adjust the shots; the points found, by key."""
    every = [*measured.shots, *measured.known]
    fit, errors = search_network(every, free_scale=free_scale)
    heights, scale, known = adjust_heights(every, measured.height_sigma_m), scale_test(fit), _known(measured)
    points = station_points(fit, known, heights)
    sigma0 = fit.adjusted.sigma0
    used = {shot.point for shot in measured.shots} & known
    found = {
        "stations": station_rows(fit),
        "sigma0": None if sigma0 is None else round(sigma0, 3),
        "redundancy": fit.adjusted.redundancy,
        "plausible": fit.adjusted.plausible,
        "scale": scale,
        "residuals": plane_residuals(fit),
        "repeats": repeats(measured.shots),
        "errors": (*(error.text for error in errors), *heights.errors),
        "unplaced": _shot_without_position(errors, points, measured),
        "findings": (*start.findings, *network_findings(fit, heights, scale, len(used))),
    }
    return start.model_copy(update=found), points


def _known(measured: FloorMeasurements) -> set[str]:
    return {one.point for one in measured.known}


def _shot_without_position(
    errors: Sequence[GrossError], points: Mapping[str, RegisteredPoint], measured: FloorMeasurements
) -> dict[str, str]:
    """Landmarks that were shot and have no position."""
    placed, found = points.keys() | _known(measured), {}
    for shot in measured.shots:
        role, name = role_of(shot.point)
        if role in (Role.LANDMARK, Role.LEFT, Role.RIGHT) and name not in placed:
            wrong = any(shot.point in error.points for error in errors)
            found[name] = "its shots contradict others" if wrong else "only one edge of its sheet was measured"
    return found


def _by_tape(measured: FloorMeasurements, points: Mapping[str, RegisteredPoint]) -> TapeResult:
    """Tape distances; they may lead to walls and corners, known points, and what the stations gave."""
    targets = dict(measured.targets)
    for one in measured.known:
        targets.setdefault(one.point, Target(one.point, one.place, None, one.sigma_m))
    for name, point in points.items():
        targets.setdefault(name, Target(name, complex(point.x_m, point.y_m), None, point.sigma_m))
    expected = dict(measured.expected) | {name: click.place for name, click in measured.clicks.items()}
    return trilaterate(measured.distances, targets, extent_m=measured.extent_m, expected=expected)


def _natural(point: RegisteredPoint) -> tuple[int, int, str]:
    """Numbers by their value, then names."""
    number = point.point.isdecimal()
    return (0, int(point.point), "") if number else (1, 0, point.point)
