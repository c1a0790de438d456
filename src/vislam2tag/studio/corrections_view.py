"""Corrections and faults for the page: ``corrections.toml`` and its changes, and faults with lines for it."""

from __future__ import annotations

import inspect
import math
import tomllib
from collections.abc import Mapping
from datetime import date, time

from pydantic import TypeAdapter

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Answer, Judgement
from vislam2tag.pipeline.labels.label_run import kept_faults
from vislam2tag.pipeline.labels.survey_evidence import thinned
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.site.corrections import edits
from vislam2tag.site.corrections.conflicts import merged
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.corrections.unknown import CHANGES_NOTHING
from vislam2tag.site.model import Survey
from vislam2tag.studio import work_messages
from vislam2tag.studio.messages import Point, seen_as
from vislam2tag.studio.outputs import LABELS
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.workspace import Snapshot, Workspace


@endpoint("GET", "/api/corrections")
def corrections_view(workspace: Workspace) -> work_messages.CorrectionsView:
    """The current file."""
    text, version = edits.corrections_text(workspace.root)
    try:
        survey = workspace.corrected(workspace.now.files, edits.corrections_of(text))
        return work_messages.CorrectionsView(version=version, text=text, entries=_entries(text, survey), problem=None)
    except SurveyError as error:
        return work_messages.CorrectionsView(version=version, text=text, entries=[], problem=str(error))


@endpoint("POST", "/api/corrections/preview")
def preview(workspace: Workspace, body: work_messages.PreviewRequest) -> work_messages.Preview:
    """The file with changes.

    Raises SurveyError if the result could not be used, ConflictError if someone else has changed the same entries since
    the text on which the changes are based.
    """
    workspace.refresh()
    saved, version = edits.corrections_text(workspace.root)
    base = saved if body.base is None else body.base
    changed = base if body.text is None else body.text
    if body.changes:
        changed = edits.changed_text(changed, body.changes)
    text = merged(base, changed, saved)
    corrections = edits.corrections_of(text)
    survey = workspace.corrected(workspace.now.files, corrections)
    return work_messages.Preview(
        before=saved,
        text=text,
        version=version,
        entries=_entries(text, survey),
        lines=edits.difference(saved, text),
        touched=workspace.touched(survey, corrections),
    )


@endpoint("PUT", "/api/corrections")
def saved(workspace: Workspace, body: work_messages.CorrectionsText, version: str) -> work_messages.CorrectionsView:
    """Save a text that is based on a version of the file.

    Raises ChangedMeanwhileError if the file has changed, SurveyError if the text cannot be used for this
    survey, OutputError if it cannot be written.
    """
    workspace.corrected(workspace.now.files, edits.corrections_of(body.text))
    edits.save_text(workspace.root, body.text, version.strip('"'))
    workspace.refresh()
    return corrections_view(workspace)


@endpoint("POST", "/api/corrections/undo")
def undone(workspace: Workspace, body: work_messages.UndoRequest) -> work_messages.Undone:
    """Undo a saved change in the current file; later changes by others stay.

    Raises ConflictError if someone else changed the same entries, SurveyError if the result could not be used,
    OutputError if it cannot be written.
    """

    def without_change(current: str) -> str:
        text = merged(body.after, body.before, current)
        workspace.corrected(workspace.now.files, edits.corrections_of(text))
        return text

    before = edits.change_text(workspace.root, without_change)
    workspace.refresh()
    return work_messages.Undone(before=before, corrections=corrections_view(workspace))


@endpoint("GET", "/api/corrections/tables")
def correction_tables() -> work_messages.CorrectionTables:
    """All kinds of corrections with the JSON schemas of their values."""
    tables = []
    for name, field in Corrections.model_fields.items():
        record = field.annotation.__args__[0]  # type: ignore[union-attr]  # each is tuple[KIND, ...]
        schema = TypeAdapter(record).json_schema(by_alias=True)
        tables.append(work_messages.CorrectionTable(name=name, summary=inspect.getdoc(record) or "", values=schema))
    return work_messages.CorrectionTables(tables=tables)


def _entries(text: str, survey: Survey) -> list[work_messages.Entry]:
    """Entries of the survey's text, with the reason if one has no effect."""
    idle = [finding.message for finding in survey.findings if finding.kind in CHANGES_NOTHING]
    return [
        seen_as(
            work_messages.Entry,
            entry,
            values={name: _plain(value) for name, value in entry.values.items()},
            findings=[message for message in idle if message.startswith(f"[[{entry.table}]] number {entry.number} ")],
        )
        for entry in edits.entries_of(text)
    ]


def _plain(value: object) -> object:
    """A value for JSON."""
    return value.isoformat() if hasattr(value, "isoformat") else value


class Diagnoses:
    """The faults of a workspace: of the last complete diagnosis if it is current, otherwise from the labels."""

    def __init__(self, workspace: Workspace) -> None:
        """Start without a search."""
        self._workspace = workspace
        self._quick: tuple[str, list[Fault], Judgement] | None = None

    def view(self) -> work_messages.DiagnosisView:
        """The list."""
        version, full = self._workspace.refresh().sessions, self._workspace.diagnosis
        if full is not None and full[1] == version:
            return self._seen("full", full[0].faults, full[0].judgement, stale=False)
        open_before = [] if full is None else self._not_answered(full[0].faults)
        if not self._workspace.outputs[LABELS].stamp():
            judgement = _with_open(self._not_looked_at(), open_before)
            return self._seen("none", open_before, judgement, stale=full is not None)
        if self._quick is None or self._quick[0] != version:
            now, folder = self._workspace.now, OutputFolder(self._workspace.out)
            refs = [ref for ref in now.survey.sessions if not now.corrections.excludes(ref.key)]
            results = folder.results(ref.slug for ref in thinned(refs))
            passes = {result.slug: result.passes for result in results if result.passes is not None}
            self._quick = version, *kept_faults(now.survey, refs, passes)
        faults, judgement = _together(self._quick[1], open_before), _with_open(self._quick[2], open_before)
        return self._seen("quick", faults, judgement, stale=full is not None)

    def _seen(
        self, state: str, faults: list[Fault], judgement: Judgement, *, stale: bool
    ) -> work_messages.DiagnosisView:
        views = fault_views(faults, self._workspace.now)
        return work_messages.DiagnosisView.model_validate(
            {"state": state, "stale": stale, "faults": views, "judgement": judgement}
        )

    def _not_answered(self, faults: list[Fault]) -> list[Fault]:
        """Faults with corrections that are not all in the file; all faults while the file cannot be read."""
        try:
            written = tomllib.loads(edits.corrections_text(self._workspace.root)[0])
        except (SurveyError, tomllib.TOMLDecodeError):
            return faults
        return [
            fault
            for fault in faults
            if not fault.corrections or not all(_is_written(entry, written) for entry in fault.corrections)
        ]

    def _not_looked_at(self) -> Judgement:
        why = "no walk has labels yet" if self._workspace.now.survey.sessions else "the survey has no walks yet"
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=why)


def _with_open(judgement: Judgement, faults: list[Fault]) -> Judgement:
    """The answer, including faults of an earlier search that are still open."""
    return judgement.model_copy(update={"answer": Answer.WRONG}) if faults else judgement


def _is_written(entry: CorrectionEntry, written: Mapping[str, object]) -> bool:
    """Whether a file's tables have an entry; the page writes dates as texts."""
    tables = written.get(entry.table, [])
    if not isinstance(tables, list):
        return False
    wanted = _plain_values(entry.values).items()
    return any(
        isinstance(table, dict) and all(_plain_values(table).get(name) == value for name, value in wanted)
        for table in tables
    )


def _together(now: list[Fault], before: list[Fault]) -> list[Fault]:
    """Faults from the labels, and other faults of the last search, which stay open until the next search."""
    known = {(fault.kind, fault.floor, *fault.landmarks, *fault.sessions) for fault in now}
    return [*now, *(one for one in before if (one.kind, one.floor, *one.landmarks, *one.sessions) not in known)]


def fault_views(faults: list[Fault], now: Snapshot) -> list[work_messages.FaultView]:
    """Faults in the order of the gain of their corrections."""
    places = {
        (floor, name): (float(x), float(y))
        for name, floor, (x, y) in zip(
            now.survey.site.landmarks.ids,
            now.survey.site.landmarks.floor.tolist(),
            now.survey.site.landmarks.position_bcs.tolist(),
            strict=True,
        )
        if math.isfinite(x) and math.isfinite(y)
    }
    return [_fault_view(fault, places, now) for fault in sorted(faults, key=_order)]


def _order(fault: Fault) -> tuple[float, float, float]:
    """Sort key: larger share of labelled frames, then smaller expected error, then higher certainty."""
    gain = fault.gain
    labelled = gain.labelled_after - gain.labelled_before if gain else 0.0
    before, after = (gain.expected_before_m, gain.expected_after_m) if gain else (None, None)
    better = before - after if before is not None and after is not None else 0.0
    return -labelled, -better, -(fault.odds or 0.0)


def _fault_view(fault: Fault, places: Mapping[tuple[int, str], Point], now: Snapshot) -> work_messages.FaultView:
    return seen_as(
        work_messages.FaultView,
        fault,
        id=f"{fault.kind.value}:{fault.floor}:{','.join(fault.landmarks)}:{','.join(fault.sessions)}",
        kind=fault.kind.value,
        sessions=[now.id_of_key[key] for key in fault.sessions if key in now.id_of_key],
        changes=[edits.AddEntry(table=entry.table, values=_plain_values(entry.values)) for entry in fault.corrections],
        places=_places(fault, places),
    )


def _plain_values(values: Mapping[str, object]) -> dict[str, object]:
    """Values for JSON."""
    return {
        name: value.isoformat() if isinstance(value, date | time) else value
        for name, value in values.items()
        if value is not None
    }


def _places(fault: Fault, places: Mapping[tuple[int, str], Point]) -> list[work_messages.FaultPlace]:
    """Positions of its landmarks in the table and according to the walks, if known."""
    if fault.floor is None:
        return []
    to: dict[str, Point] = {
        str(entry.values["id"]): (float(entry.values["x"]), float(entry.values["y"]))
        for entry in fault.corrections
        if entry.table == "move_landmark"
    }
    known = [name for name in fault.landmarks if (fault.floor, name) in places]
    if fault.kind is FaultKind.SWAPPED:
        to = {name: places[fault.floor, after] for name, after in zip(known, [*known[1:], *known[:1]], strict=True)}
    found = []
    for name in known:
        x, y = places[fault.floor, name]
        to_x, to_y = to.get(name, (None, None))
        found.append(work_messages.FaultPlace(floor=fault.floor, landmark=name, x=x, y=y, to_x=to_x, to_y=to_y))
    return found
