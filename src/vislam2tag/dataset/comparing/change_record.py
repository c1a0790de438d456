"""What a joined set tells of changes: a summary (JSON) and the tables of access points and places (CSV)."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.common.spreadsheet_text import escaped
from vislam2tag.dataset.comparing.changes import (
    APPEARED,
    CHANGED,
    FAINTER,
    LOUDER,
    MOVED,
    OUTDATED,
    UNCHANGED,
    VANISHED,
    Changes,
)

RECORD = "changes.json"
MOST_CHANGED: FindingKind = "most_changed"
NOTHING_COMPARED: FindingKind = "nothing_compared"
CHANGED_POINTS = (APPEARED, VANISHED, MOVED, LOUDER, FAINTER)


class SurveyDeviceOffset(Record):
    """How much louder a phone hears than the mean of all phones, dB."""

    survey: str
    """``base`` or ``later``."""
    device: str
    offset_db: float


class ChangedPoint(Record):
    """An access point that changed; places are centres of cells, BCS metres."""

    bssid: str
    ssid: str | None
    change: str
    difference_db: float
    """Mean over its common places, later - base."""
    base_floor: int | None
    base_x: float | None
    base_y: float | None
    """Where the base heard it loudest."""
    later_floor: int | None
    later_x: float | None
    later_y: float | None


class TechnologyChanges(Record):
    """What changed for one technology."""

    technology: str
    cell_m: float
    offsets: tuple[SurveyDeviceOffset, ...]
    access_points: dict[str, int]
    """How many there are of each kind of change."""
    places: dict[str, int]
    changed: tuple[ChangedPoint, ...]


class SurveyChanges(Record):
    """What changed between a data set and a later survey."""

    base: str
    later: str
    technologies: tuple[TechnologyChanges, ...]
    findings: tuple[Finding, ...] = ()


def survey_record(base: str, later: str, changes: Sequence[Changes]) -> SurveyChanges:
    """Sum up what changed between the data sets of these names."""
    technologies = tuple(_record(one) for one in changes)
    findings = tuple(finding for one in technologies for finding in _findings(one))
    return SurveyChanges(base=base, later=later, technologies=technologies, findings=findings)


def _findings(one: TechnologyChanges) -> tuple[Finding, ...]:
    """Doubt that both surveys are of one building where hardly anything stayed."""
    compared = len(one.changed) + one.access_points.get(UNCHANGED, 0)
    if not compared:
        count = sum(one.places.values())
        message = f"{one.technology}: the surveys share no place, or heard too little there: what changed is unknown"
        return (Finding(kind=NOTHING_COMPARED, file="", count=count, message=message),)
    if 2 * len(one.changed) <= compared:
        return ()
    message = (
        f"{one.technology}: of {compared} access points {len(one.changed)} changed; is the later survey of the same "
        "building, and are its floors numbered and measured in the same way?"
    )
    return (Finding(kind=MOST_CHANGED, file="", count=len(one.changed), message=message),)


def _record(changes: Changes) -> TechnologyChanges:
    changed = changes.access_points.filter(pl.col("change").is_in(CHANGED_POINTS))
    return TechnologyChanges(
        technology=changes.technology,
        cell_m=changes.cell_m,
        offsets=tuple(
            SurveyDeviceOffset(survey=survey, device=device, offset_db=round(offset, 2))
            for (survey, device), offset in sorted(changes.offsets_db.items())
        ),
        access_points=_counts(changes.access_points),
        places=_counts(changes.places),
        changed=tuple(ChangedPoint(**row) for row in changed.select(ChangedPoint.model_fields.keys()).rows(named=True)),
    )


def _counts(table: pl.DataFrame) -> dict[str, int]:
    return dict(table.group_by("change").len().sort("change").iter_rows())


def write_changes(folder: Folder, record: SurveyChanges, changes: Sequence[Changes]) -> None:
    """Write ``changes.json``, ``access_points.csv`` and ``places.csv``; what changed comes first, the most first."""
    folder.write(RECORD, record.model_dump_json(indent=1) + "\n")
    for name in ("access_points", "places"):
        tables = [getattr(one, name).with_columns(technology=pl.lit(one.technology)) for one in changes]
        if tables:
            write_csv(escaped(_listed(pl.concat(tables))), folder, f"{name}.csv")


def _listed(table: pl.DataFrame) -> pl.DataFrame:
    """Order a table by what is to be done about it, and write lists as words."""
    first = ~pl.col("change").is_in([*CHANGED_POINTS, CHANGED, OUTDATED])
    size = "size_db" if "size_db" in table.columns else "score"
    words = (pl.col(name).list.join(" ") for name, kind in table.schema.items() if isinstance(kind, pl.List))
    order = (first, "technology", "change", size)
    ordered = table.sort(*order, descending=[False, False, False, True], nulls_last=True, maintain_order=True)
    return ordered.select("technology", pl.exclude("technology")).with_columns(*words)
