"""``corrections.toml`` as the page sees it: its entries, what changes would make of it, and its saving."""

from __future__ import annotations

import inspect

from pydantic import TypeAdapter

from vislam2tag.common.errors import SurveyError
from vislam2tag.site.corrections.edits import (
    change_text,
    changed_text,
    corrections_of,
    corrections_text,
    difference,
    entries_of,
    save_text,
)
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.corrections.merging import merged
from vislam2tag.site.model import Survey
from vislam2tag.studio.work_messages import (
    CorrectionsView,
    CorrectionTable,
    CorrectionTables,
    Entry,
    Preview,
    PreviewRequest,
    Undone,
    UndoRequest,
)
from vislam2tag.studio.workspace import Workspace


def corrections_view(workspace: Workspace) -> CorrectionsView:
    """The file as it is."""
    text, version = corrections_text(workspace.root)
    try:
        survey = workspace.corrected(workspace.now.files, corrections_of(text))
        return CorrectionsView(version=version, text=text, entries=_entries(text, survey), problem=None)
    except SurveyError as error:
        return CorrectionsView(version=version, text=text, entries=[], problem=str(error))


def preview(workspace: Workspace, request: PreviewRequest) -> Preview:
    """What changes would make of the file.

    Raises SurveyError where it could not be used then, ConflictError where someone else changed the same entries after
    the text that the changes were made from.
    """
    workspace.refresh()
    saved, version = corrections_text(workspace.root)
    base = saved if request.base is None else request.base
    changed = base if request.text is None else request.text
    if request.changes:
        changed = changed_text(changed, request.changes)
    text = merged(base, changed, saved)
    corrections = corrections_of(text)
    survey = workspace.corrected(workspace.now.files, corrections)
    return Preview(
        before=saved,
        text=text,
        version=version,
        entries=_entries(text, survey),
        lines=difference(saved, text),
        touched=workspace.touched(survey, corrections),
    )


def saved(workspace: Workspace, text: str, version: str) -> CorrectionsView:
    """Save a text that was made from a version of the file.

    Raises ChangedMeanwhileError where the file is another now, SurveyError where the text cannot be used for this
    survey, OutputError where it cannot be written.
    """
    workspace.corrected(workspace.now.files, corrections_of(text))
    save_text(workspace.root, text, version)
    workspace.refresh()
    return corrections_view(workspace)


def undone(workspace: Workspace, request: UndoRequest) -> Undone:
    """Take a saved change back in the file as it is now; all that others changed since then stays.

    Raises ConflictError where someone else changed the same entries, SurveyError where the file could not be used then,
    OutputError where it cannot be written.
    """

    def without_change(current: str) -> str:
        text = merged(request.after, request.before, current)
        workspace.corrected(workspace.now.files, corrections_of(text))
        return text

    before = change_text(workspace.root, without_change)
    workspace.refresh()
    return Undone(before=before, corrections=corrections_view(workspace))


def correction_tables() -> CorrectionTables:
    """All kinds of corrections with the JSON schemas of their values."""
    tables = []
    for name, field in Corrections.model_fields.items():
        record = field.annotation.__args__[0]  # type: ignore[union-attr]  # each is tuple[KIND, ...]
        schema = TypeAdapter(record).json_schema(by_alias=True)
        tables.append(CorrectionTable(name=name, summary=inspect.getdoc(record) or "", values=schema))
    return CorrectionTables(tables=tables)


def _entries(text: str, survey: Survey) -> list[Entry]:
    """Entries of a text that is the survey's, with why one has no effect."""
    idle = [finding.message for finding in survey.findings if finding.kind == "unused_correction"]
    return [
        Entry(
            table=entry.table,
            number=entry.number,
            values={name: _plain(value) for name, value in entry.values.items()},
            first_line=entry.first_line,
            last_line=entry.last_line,
            findings=[message for message in idle if message.startswith(f"[[{entry.table}]] number {entry.number} ")],
        )
        for entry in entries_of(text)
    ]


def _plain(value: object) -> object:
    """A value as JSON has it."""
    return value.isoformat() if hasattr(value, "isoformat") else value
