"""A fleet's studios in one folder: a searchable list of surveys, with a studio for each survey with labels.

``fleet/first.json`` contains the first rows of the list, ``fleet/catalogue.parquet`` all rows for searching, and
``surveys/NAME`` the data of a survey.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import polars as pl

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.store import address_of
from vislam2tag.common.files.stored_folder import folder_at_hand
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import FiniteRecord
from vislam2tag.pipeline.fleet.catalogue import CATALOGUE, LABELS, SURVEYS, Fleet, FleetTotals, totals_of
from vislam2tag.pipeline.fleet.process import chosen
from vislam2tag.settings import Settings
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.studio.answers import without_addresses
from vislam2tag.studio.export import ExportRecord, new_export, recorded, write_page, write_rows, write_survey
from vislam2tag.studio.workspace import Workspace

LIST = "fleet"
FIRST_ROWS = 100
"""Number of rows that are shown at first."""


class FleetRow(FiniteRecord):
    """A survey in the list, from the catalogue without its errors, which may contain paths."""

    survey: str
    site: str
    floors: int
    devices: str
    """Separated by commas."""
    first_date: str
    """For example 2026-05-31; empty if no session's name begins with a date."""
    last_date: str
    sessions: int
    failed: int
    state: str
    labelled_share: float | None
    """Share of labelled frames; None if none is processed."""
    page: bool
    """Whether its walks can be viewed."""


class FleetView(FiniteRecord):
    """The first part of the list."""

    name: str
    totals: FleetTotals
    rows: list[FleetRow]
    """The first rows."""


def export_fleet(
    fleet: Path,
    out: Path,
    settings: Callable[[Path], Settings],
    only: Sequence[str] = (),
    key: bytes | None = None,
    progress: Progress[str] = silent,
    *,
    follow_links: bool = False,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> ExportRecord:
    """Write the list of a fleet's surveys, or of the named ones, and the studio of each survey with labels.

    ``settings`` returns those of a survey's folder. ``progress`` is called for each survey with labels, ``tell`` with
    files that are skipped because links lead outside the survey, unless ``follow_links`` is given. Raises UsageError
    if there is no fleet or no such survey. Raises SurveyError if a survey with labels can no longer be opened,
    StoreError if a store cannot be read, OutputError if the folder contains anything else or cannot be written.
    """
    catalogue = chosen(Fleet(fleet), only)
    rows = [_row(each) for each in catalogue]
    opened = [row.survey for row in rows if row.page]
    totals = totals_of(pl.DataFrame(catalogue, schema=CATALOGUE, orient="row"))
    with new_export(out) as folder:
        write_page(folder, LIST)
        first = FleetView(name=_name(fleet), totals=totals, rows=rows[:FIRST_ROWS])
        folder.write(f"{LIST}/first.json", first.model_dump_json())
        table = pl.DataFrame([row.model_dump() for row in rows], schema_overrides={"labelled_share": pl.Float64})
        write_rows(table, folder, f"{LIST}/catalogue.parquet")
        walks, left_out = 0, list[Finding]()
        for name in opened:
            with _opened(fleet, name, settings) as workspace:
                gone = write_survey(workspace, folder.folder(f"{SURVEYS}/{name}"), key, follow_links=follow_links)
                left_out += [finding.model_copy(update={"file": name}) for finding in gone]
                walks += len(workspace.now.ids)
            progress(name, len(opened))
        tell(left_out)
        return recorded(folder, len(rows), walks, left_out)


@contextmanager
def _opened(fleet: Path, name: str, settings: Callable[[Path], Settings]) -> Iterator[Workspace]:
    """A survey and its labels, fetched if they are in a store."""
    try:
        with (
            survey_at_hand(fleet / SURVEYS / name) as root,
            folder_at_hand(fleet / LABELS / name) as labels,
            closing(Workspace(root, labels, settings(root))) as workspace,
        ):
            yield workspace
    except SurveyError as error:
        raise SurveyError(f"{name}: {error}") from error


def _name(fleet: Path) -> str:
    return without_addresses((fleet if address_of(fleet) else fleet.resolve()).name)


def _row(row: dict[str, Any]) -> FleetRow:
    return FleetRow(
        survey=row["survey"],
        site=without_addresses(row["site"] or ""),
        floors=len(row["floors"] or ()),
        devices=without_addresses(", ".join(row["devices"] or ())),
        first_date=str(row["first_date"] or ""),
        last_date=str(row["last_date"] or ""),
        sessions=row["sessions"],
        failed=row["failed"],
        state=row["state"],
        labelled_share=row["frames_labelled"] / row["frames"] if row["frames"] else None,
        page=row["labels"] is not None,
    )
