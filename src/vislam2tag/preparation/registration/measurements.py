"""Rows of surveyors' files as measurements of named points."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.similarity import as_complex
from vislam2tag.preparation.registration.heights import KNOWN_HEIGHT, MeasuredHeight
from vislam2tag.preparation.registration.names import NameRules, control_key
from vislam2tag.preparation.registration.network import KnownPoint, Shot
from vislam2tag.preparation.registration.point_file import PointColumn, PointRow, read_points
from vislam2tag.preparation.registration.record import Repeat
from vislam2tag.preparation.registration.settings import RegistrationSettings
from vislam2tag.site.model import Site

ALL = "all"
"""Of the known points of the site: every one."""


def read_stations(
    paths: Sequence[Path],
    columns: Sequence[PointColumn | None] | None,
    codes: Sequence[str],
    rules: NameRules,
    settings: RegistrationSettings,
) -> tuple[list[Shot], list[MeasuredHeight], list[Finding]]:
    """Read total-station exports: a file is a station, unless a column names stations.

    Only shots with one of these point ``codes`` count, where any is given; the others are a finding. Raises
    SurveyError where a file cannot be used, or two files would be one station.
    """
    stems = [path.stem for path in paths]
    if double := [path for i, path in enumerate(paths) if path.stem in stems[:i]]:
        raise SurveyError(f"{double[0]}: another file has the same name, which is its station's; rename one")
    shots: list[Shot] = []
    heights: list[MeasuredHeight] = []
    findings: list[Finding] = []
    for path in paths:
        rows, problems = read_points(path, columns)
        findings += problems
        if other := [row for row in rows if codes and row.code not in codes]:
            lines = [int(row.source.rpartition(":")[2]) for row in other]
            message = f"these rows have another point code than {', '.join(codes)} and are left out"
            findings.append(Finding.at_lines("other_code", path.name, lines, message, Severity.INFO))
        for row in rows:
            if codes and row.code not in codes:
                continue
            station, point = row.station or path.stem, rules.key(row.name)
            shots.append(
                Shot(
                    point=point,
                    station=station,
                    place=complex(row.east_m, row.north_m),
                    sigma_m=settings.shot_sigma_m if math.isnan(row.sigma_m) else row.sigma_m,
                    source=row.source,
                    decimals=row.decimals,
                )
            )
            if math.isfinite(row.height_m):
                heights.append(MeasuredHeight(point, station, row.height_m, settings.height_sigma_m, row.source))
    return shots, heights, findings


def read_known_points(
    path: Path, rules: NameRules, settings: RegistrationSettings
) -> tuple[list[KnownPoint], list[MeasuredHeight], list[Finding]]:
    """Read known points (BCS metres; H above the floor); raises SurveyError where a name comes twice."""
    rows, findings = read_points(path)
    first: dict[str, PointRow] = {}
    for row in rows:
        key = rules.key(row.name)
        if key in first:
            raise SurveyError(
                f"{row.source}: known point {row.name} is there twice (first: {first[key].source}); keep one"
            )
        first[key] = row
    known = [
        KnownPoint(
            point=key,
            place=complex(row.east_m, row.north_m),
            sigma_m=settings.control_sigma_m if math.isnan(row.sigma_m) else row.sigma_m,
            source=row.source,
            decimals=row.decimals,
        )
        for key, row in first.items()
    ]
    heights = [
        MeasuredHeight(key, KNOWN_HEIGHT, row.height_m, settings.height_sigma_m, row.source)
        for key, row in first.items()
        if math.isfinite(row.height_m)
    ]
    return known, heights, findings


def known_points_of_site(
    site: Site, floor: int, wanted: Sequence[str], rules: NameRules, settings: RegistrationSettings
) -> tuple[list[KnownPoint], list[MeasuredHeight]]:
    """Landmarks and control points of a floor as they stand in the site's files, those ``wanted`` or :data:`ALL`.

    Landmarks that were only planned are not known. Raises UsageError where one is wanted that has no measured position.
    """
    found: dict[str, KnownPoint] = {}
    heights: list[MeasuredHeight] = []
    whole = site.landmarks.on_floor(floor)
    here = whole.without_planned_positions()
    for i in np.flatnonzero(here.surveyed).tolist():
        sigma_m = math.sqrt(float(np.trace(here.covariance_bcs[i])) / 2)
        source = here.source[i] if here.source else ""
        found[here.ids[i]] = KnownPoint(
            point=here.ids[i], place=complex(as_complex(here.position_bcs[i])), sigma_m=sigma_m, source=source
        )
        if math.isfinite(here.z_m[i]):
            heights.append(
                MeasuredHeight(here.ids[i], KNOWN_HEIGHT, float(here.z_m[i]), settings.height_sigma_m, source)
            )
    points = site.floor(floor).control_points
    for i, (name, place) in enumerate(zip(points.ids, points.position_bcs, strict=True)):
        key, source = control_key(name), points.source[i] if points.source else ""
        found[key] = KnownPoint(
            point=key, place=complex(as_complex(place)), sigma_m=settings.control_sigma_m, source=source
        )
    keys = set(found) if ALL in wanted else {rules.key(name) for name in wanted}
    if missing := sorted(keys - found.keys()):
        planned = ", only a planned one, which is not known" if missing[0] in whole.planned_ids else ""
        raise UsageError(f"--known {missing[0]}: floor {floor} has no measured position of it{planned}")
    return [one for key, one in found.items() if key in keys], [one for one in heights if one.point in keys]


def repeats(shots: Sequence[Shot]) -> tuple[Repeat, ...]:
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
