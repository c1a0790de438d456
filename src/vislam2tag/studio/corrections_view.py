"""Corrections for the page: ``corrections.toml`` and its changes."""

from __future__ import annotations

import inspect

from pydantic import TypeAdapter

from vislam2tag.common.errors import SurveyError
from vislam2tag.site.corrections import edits
from vislam2tag.site.corrections.conflicts import merged
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.corrections.unknown import CHANGES_NOTHING
from vislam2tag.site.model import Survey
from vislam2tag.studio import work_messages
from vislam2tag.studio.messages import seen_as
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.workspace import Workspace


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
