"""What a page for everybody does not tell of a survey: networks' names and addresses, people's words, our folders."""

from __future__ import annotations

import json
import re
import secrets

from vislam2tag.common.files.stored_folder import with_addresses
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.studio.messages import OutputView, SurveyView
from vislam2tag.studio.work_messages import ComparisonView, CorrectionsView
from vislam2tag.studio.workspace import Workspace

REASON = "reason"
_ADDRESS = re.compile(r"\b[0-9A-Fa-f]{2}([:-][0-9A-Fa-f]{2}){5}\b")


def export_privacy(key: bytes | None) -> Privacy:
    """The data set's rules: no names of networks, none that opted out, addresses hashed, without a key by a new one."""
    return Privacy(hash_key=key or secrets.token_bytes(32), keep_ssids=False)


def without_folders(view: SurveyView) -> SurveyView:
    """A survey whose folders are told by their names alone."""
    outputs = [_without_folder(output) for output in view.outputs]
    return view.model_copy(update={"root": view.name, "labels": _name(view.labels), "outputs": outputs})


def compared_without_folders(view: ComparisonView) -> ComparisonView:
    """A comparison whose folders are told by their names alone."""
    return view.model_copy(update={"a": _without_folder(view.a), "b": _without_folder(view.b)})


def without_reasons(view: CorrectionsView) -> CorrectionsView:
    """Entries without what people wrote beside them: reasons, and the comments of the text."""
    entries = [
        entry.model_copy(update={"values": {name: value for name, value in entry.values.items() if name != REASON}})
        for entry in view.entries
    ]
    return view.model_copy(update={"text": "", "version": "", "entries": entries})


def without_addresses(text: str) -> str:
    """A text in which nobody reads the addresses of radios."""
    return _ADDRESS.sub("(address)", text)


class Hiding:
    """Takes out of sentences what the tables do not tell either."""

    def __init__(self, workspace: Workspace) -> None:
        """Of a survey: the folders of its files, with what they stand for, and the reasons of its corrections."""
        here = {str(folder) for place in (workspace.root, workspace.out) for folder in (place, place.resolve())}
        folders = here | {with_addresses(folder) for folder in here}
        corrections = workspace.now.corrections
        entries = (entry for name in type(corrections).model_fields for entry in getattr(corrections, name))
        self._hidden = [
            *(f"{folder}/" for folder in sorted(folders, key=len, reverse=True) if folder not in (".", "/")),
            *{f" ({entry.reason})" for entry in entries if entry.reason},
        ]

    def json(self, record: FiniteRecord) -> bytes:
        """A record as JSON, of whose texts these are taken out and addresses of radios replaced."""
        text = record.model_dump_json()
        for hidden in self._hidden:
            text = text.replace(_quoted(hidden), "")
        return without_addresses(text).encode()


def _quoted(text: str) -> str:
    """A text as it stands within JSON."""
    return json.dumps(text, ensure_ascii=False)[1:-1]


def _without_folder(output: OutputView) -> OutputView:
    return output.model_copy(update={"folder": _name(output.folder)})


def _name(folder: str) -> str:
    return folder.rstrip("/").rpartition("/")[2]
