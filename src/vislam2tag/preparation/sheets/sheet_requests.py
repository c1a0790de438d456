"""Which landmarks get a sheet (of a site, of a file, or typed ids), on which paper; settings of sheets."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.preparation.sheets.settings import SheetSize, sheet_size
from vislam2tag.site.discover import read_site
from vislam2tag.site.landmark_file import LANDMARK_FILE
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_file import has_site_file, read_site_file
from vislam2tag.site.site_table import LANDMARKS, SiteTable, finite_or_none, is_number, read_site_table, readable_table

MOST_SHEETS = 1000
"""Largest number of images in ARCore's database."""
_RANGE = re.compile(r"(\d{1,9})-(\d{1,9})")


@dataclass(frozen=True)
class SheetRequest:
    """A landmark that is to have a sheet, as far as its source contains it."""

    landmark: str
    building: str = ""
    floor: int | None = None
    floor_name: str = ""
    position_m: tuple[float, float] | None = None
    """Where it hangs, BCS, metres."""
    height_m: float | None = None
    """Of its centre above the floor, metres."""
    sheet: SheetSize | None = None
    width_m: float | None = None
    """Of the image that is recognised, metres."""
    source: str = ""
    """File and line, where it comes from a file."""
    near: str = ""
    """Nearest room with a name."""


def parse_ids(text: str) -> tuple[str, ...]:
    """Take apart ``1-40,lobby``: ids and ranges of whole numbers between commas, brought to one form.

    Raises UsageError where nothing is named, an id is unusable, given twice, or more than fit a database.
    """
    spelled: dict[str, str] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        for written in _in_range(part):
            name = landmark_id(written)
            if not name:
                raise UsageError(f"--ids: '{written}' is not a valid id; use letters, digits and signs")
            if name in spelled:
                raise UsageError(f"--ids: '{spelled[name]}' and '{written}' are the same id, {name}; name each once")
            spelled[name] = written
    if not spelled:
        raise UsageError("--ids names no landmark; write ids and ranges, such as 1-40,lobby")
    return tuple(spelled)


def _in_range(part: str) -> Sequence[str]:
    match = _RANGE.fullmatch(part)
    if not match:
        return (part,)
    first, last = int(match.group(1)), int(match.group(2))
    if last < first:
        raise UsageError(f"--ids {part}: the range ends before it starts")
    if last - first >= MOST_SHEETS:
        raise UsageError(f"--ids {part}: more than {MOST_SHEETS} ids, which is too many for a phone's database")
    return [str(number) for number in range(first, last + 1)]


def requested_sheets(source: Path | None, ids: str | None) -> tuple[tuple[SheetRequest, ...], tuple[Finding, ...]]:
    """Return which landmarks are asked for, with what is odd about their files.

    ``source`` is a site's folder, a file of landmarks or None; ``ids`` picks some of its landmarks, or names all
    where there is no source. Raises UsageError and SurveyError where none is left or what is said clashes.
    """
    wanted = None if ids is None else parse_ids(ids)
    findings: tuple[Finding, ...] = ()
    if source is None:
        if wanted is None:
            raise UsageError("no landmarks are given; pass a site's folder, a file of landmarks, --ids or --images")
        return tuple(SheetRequest(name) for name in wanted), ()
    if source.is_dir():
        found, findings = _of_site(source)
    else:
        found = _of_file(source)
    if wanted is not None:
        found = _picked(source, found, wanted)
    if not found:
        raise SurveyError(
            f"{source}: contains no landmark; plan landmarks with vislam2tag plan SITE --out plan --write, add rows to "
            f"{LANDMARK_FILE}, or pass --ids without SITE"
        )
    return tuple(found), findings


def _picked(source: Path, found: list[SheetRequest], wanted: tuple[str, ...]) -> list[SheetRequest]:
    there = {one.landmark for one in found}
    missing = [name for name in wanted if name not in there]
    if missing:
        raise UsageError(
            f"--ids: {source} has no landmark {', '.join(missing[:10])}; omit SITE for ids that are not in a site"
        )
    return [one for one in found if one.landmark in set(wanted)]


def _of_site(root: Path) -> tuple[list[SheetRequest], tuple[Finding, ...]]:
    site, findings = read_site(root, follow_links=True)
    building = read_site_file(root).name if has_site_file(root) else ""
    own: dict[str, tuple[SheetSize | None, float | None, str]] = {}
    for path in sorted({root / source.rpartition(":")[0] for source in site.landmarks.source}):
        table = read_site_table(root, path, columns=LANDMARKS)
        own |= {
            table.place(line): (*_size(table, line, fields), table.cell(fields, "near")) for line, fields in table.rows
        }
    landmarks = site.landmarks
    names = {floor.number: floor.name for floor in site.floors}
    requests = [
        SheetRequest(
            landmark=name,
            building=building,
            floor=int(landmarks.floor[i]),
            floor_name=names.get(int(landmarks.floor[i]), ""),
            position_m=_pair(*landmarks.position_bcs[i]),
            height_m=_finite(landmarks.z_m[i]),
            sheet=own[landmarks.source[i]][0],
            width_m=own[landmarks.source[i]][1],
            near=own[landmarks.source[i]][2],
            source=landmarks.source[i],
        )
        for i, name in enumerate(landmarks.ids)
    ]
    return requests, tuple(finding for finding in findings if Path(finding.file).stem == Path(LANDMARK_FILE).stem)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _pair(x_m: float | None, y_m: float | None) -> tuple[float, float] | None:
    if x_m is None or y_m is None or not np.isfinite((x_m, y_m)).all():
        return None
    return float(x_m), float(y_m)


def _of_file(path: Path) -> list[SheetRequest]:
    """Read a file of landmarks: its first column is the id; floor, x, y, z, sheet, width_m, near, floor_name and
    building may follow.
    """
    table = readable_table(path.parent, path, "; expected a site or a landmark file", columns=LANDMARKS)
    if not table.header or is_number(table.header[0]):
        raise SurveyError(
            f"{path}: the first line must name the columns id,floor,x,y,z,sheet,width_m (all but id optional)"
        )
    found: dict[tuple[int | None, str], SheetRequest] = {}
    for line, fields in table.rows:
        one = _request(table, line, fields)
        first = found.setdefault((one.floor, one.landmark), one)
        if first is not one:
            raise SurveyError(
                f"{first.source} and {one.source} have the same id, {one.landmark}, on one floor; rename one"
            )
    return list(found.values())


def _request(table: SiteTable, line: int, fields: tuple[str, ...]) -> SheetRequest:
    place = table.place(line)
    name = landmark_id(fields[0])
    if not name:
        raise SurveyError(f"{place}: '{fields[0]}' is not a valid id; use letters, digits and signs")
    try:
        x, y, z = (finite_or_none(table.cell(fields, column)) for column in ("x", "y", "z"))
        floor_text = table.cell(fields, "floor")
        floor = int(landmark_id(floor_text)) if floor_text else None
    except ValueError as error:
        raise SurveyError(f"{place}: floor, x, y and z must be numbers or empty ({error})") from error
    sheet, width = _size(table, line, fields)
    return SheetRequest(
        landmark=name,
        building=table.cell(fields, "building"),
        floor=floor,
        floor_name=table.cell(fields, "floor_name"),
        position_m=_pair(x, y),
        height_m=z,
        near=table.cell(fields, "near"),
        sheet=sheet,
        width_m=width,
        source=place,
    )


def _size(table: SiteTable, line: int, fields: tuple[str, ...]) -> tuple[SheetSize | None, float | None]:
    """Size of paper and width of the image that a row names; raises SurveyError for what they cannot be."""
    paper, text = table.cell(fields, "sheet"), table.cell(fields, "width_m")
    try:
        size = sheet_size(paper) if paper else None
        width = finite_or_none(text)
    except (UsageError, ValueError) as error:
        raise SurveyError(f"{table.place(line)}: {error}") from error
    if width is not None and width <= 0:
        raise SurveyError(f"{table.place(line)}: width_m {text} must be above 0 (metres)")
    return size, width
