"""Floors of a site that a ``site.toml`` describes."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.site.floor_file import FLOOR_FILE
from vislam2tag.site.georeference import Georeference, georeference_of
from vislam2tag.site.landmark_file import read_control_points
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.drawing import Bounds
from vislam2tag.site.plans.load import plan_extent
from vislam2tag.site.plans.placing import extent_sides_m
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.room_names import rooms_of
from vislam2tag.site.site_file import SITE_FILE, FloorPart, read_site_file
from vislam2tag.site.site_table import is_file

MASK_FILE = "floorplan.mask.png"
"""In a floor's folder: green can be walked, red cannot."""


def described_floors(root: Path, folders: Mapping[int, Path]) -> tuple[list[Floor], list[Finding]]:
    """Read the floors of a ``site.toml``, sorted by number; ``folders`` are the ``floor_K`` folders that there are.

    A plan that cannot be read or has no scale is a finding, and so is a folder of a floor that the file does not
    have: such a floor has no plan. Raises SurveyError where the file is wrong.
    """
    site = read_site_file(root)
    earth = None if site.georeference is None else site.georeference.georeference()
    described = {part.number: part for part in site.floors}
    findings = [_about(FLOOR_FILE, "second_file", f"{SITE_FILE} is read instead; remove one of the two", Severity.INFO)]
    if not (root / FLOOR_FILE).is_file():
        findings = []
    floors = []
    for number in sorted({*described, *folders}):
        if number not in described:
            message = f"floor {number} is not in {SITE_FILE}: it has no plan; add it there"
            findings.append(_about(folders[number].name, "floor_without_size", message, Severity.WARNING))
        part = described.get(number, FloorPart(number=number))
        floor, problems = _floor(root, folders.get(number, root / f"floor_{number}"), part, earth)
        floors.append(floor)
        findings += problems
    return floors, findings


def _floor(root: Path, folder: Path, part: FloorPart, earth: Georeference | None) -> tuple[Floor, list[Finding]]:
    site_T_bcs = part.site_T_bcs.similarity()
    georeference = None if earth is None else georeference_of(earth, site_T_bcs)
    control_points, findings = read_control_points(root, folder)
    extent, problems = _extent(root, part.plan, georeference)
    left, right, low, high = extent or (0.0, 0.0, 0.0, 0.0)
    floor = Floor(
        number=part.number,
        name=part.name or f"Floor {part.number}",
        width_m=right - left if extent else None,
        height_m=high - low if extent else None,
        elevation_m=part.elevation_m,
        plan=None if part.plan is None else root / part.plan.file,
        control_points=control_points,
        lower_left_m=(left, low),
        source=part.plan,
        mask=mask_of(folder),
        rooms=rooms_of(folder),
        georeference=georeference,
        site_T_bcs=site_T_bcs,
    )
    return floor, [*findings, *problems]


def mask_of(folder: Path) -> Path | None:
    """The corrections of where a floor can be walked that its folder has."""
    mask = folder / MASK_FILE
    with suppress(PermissionError):  # a locked folder is told of where its sessions are looked for
        return mask if is_file(mask) else None
    return None


def _extent(
    root: Path, source: PlanSource | None, georeference: Georeference | None
) -> tuple[Bounds | None, list[Finding]]:
    if source is None:
        return None, []
    try:
        found = plan_extent(root / source.file, source, georeference)
    except OSError as error:
        message = f"the plan {error}; a metric grid is drawn instead"
        return None, [_about(source.file, "unreadable_plan", message, Severity.WARNING)]
    if source.extent is not None:  # exactly as given, not as it comes out of the calculation
        left, low = source.extent.lower_left_m
        width_m, height_m = extent_sides_m(source.extent, found)
        found = left, left + width_m, low, low + height_m
    return found, []


def _about(file: str, kind: FindingKind, message: str, severity: Severity) -> Finding:
    return Finding(kind=kind, file=file, count=1, message=message, severity=severity)
