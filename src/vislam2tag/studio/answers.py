"""The server's answers as JSON files for a static page, without private data."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import TypeAlias

from vislam2tag.common.errors import SurveyError, UsageError, missing_extra
from vislam2tag.common.files.stored_folder import with_addresses
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.studio.collecting import covered_floors
from vislam2tag.studio.corrections_view import corrections_view
from vislam2tag.studio.fault_view import Diagnoses
from vislam2tag.studio.layer_registry import LAYERS
from vislam2tag.studio.messages import FloorView, OutputView, SurveyView
from vislam2tag.studio.outputs import BEFORE
from vislam2tag.studio.radio import Radio, RadioView
from vislam2tag.studio.session_view import session_detail, session_list
from vislam2tag.studio.survey_view import comparison, survey_view
from vislam2tag.studio.work_messages import ComparisonView, CorrectionsView, LayerInfo, Layers, LayerView
from vislam2tag.studio.workspace import Workspace

Answer: TypeAlias = tuple[str, FiniteRecord]
"""The server's address without ``/api/``, with query parameters as folders, and the answer."""


def shown_outputs(workspace: Workspace) -> list[str]:
    """Names of the exported labels: those of the survey and of comparisons."""
    return [name for name in workspace.outputs if name != BEFORE]


def plan_file(floor: int) -> str:
    """Path of a floor's picture."""
    return f"plans/{floor}.png"


def survey_answers(workspace: Workspace, radio: Radio | None) -> Iterator[Answer]:
    """All answers except those of each walk; ``radio`` is None if no access point has enough readings for maps."""
    view = without_folders(survey_view(workspace))
    yield "survey", _with_plan_files(view)
    yield "sessions", session_list(workspace)
    yield "corrections", without_reasons(corrections_view(workspace))
    yield "diagnosis", Diagnoses(workspace).view()
    yield "covered", covered_floors(workspace)
    none = RadioView(state="none", floors=[], changes=[])
    yield "radio", none if radio is None else radio.view(stale=False)
    yield from _layer_answers(workspace, view.floors)
    for a, b in permutations(shown_outputs(workspace), 2):
        yield f"compare/{a}/{b}", compared_without_folders(comparison(workspace, a, b))


def walk_answer(workspace: Workspace, id: str) -> Answer:
    """Everything about a walk except its frames and raw files."""
    return f"sessions/{id}", session_detail(workspace, id).model_copy(update={"files": []})


def _with_plan_files(view: SurveyView) -> SurveyView:
    floors = [
        floor.model_copy(update={"plan": plan_file(floor.number) if floor.plan else None}) for floor in view.floors
    ]
    return view.model_copy(update={"floors": floors})


def _layer_answers(workspace: Workspace, floors: list[FloorView]) -> Iterator[Answer]:
    """Each layer that can be drawn of every floor."""
    infos = []
    for name, layer in LAYERS.all().items():
        try:
            views = [LayerView(features=layer.features(workspace, floor.number)) for floor in floors]
        except (SurveyError, UsageError):
            continue  # the studio itself shows the reason
        except ModuleNotFoundError as error:
            if missing_extra(error) is None:
                raise
            continue
        infos.append(LayerInfo(name=name, title=layer.title, shown=layer.shown))
        for floor, view in zip(floors, views, strict=True):
            yield f"layers/{name}/{floor.number}", view
    yield "layers", Layers(layers=infos)


REASON = "reason"
_ADDRESS = re.compile(r"\b[0-9A-Fa-f]{2}([:-][0-9A-Fa-f]{2}){5}\b")


def export_privacy(key: bytes | None) -> Privacy:
    """The privacy rules of data sets: no names, no networks that opted out, and hashed addresses."""
    return Privacy(hash_key=key or secrets.token_bytes(32), keep_ssids=False)


def without_folders(view: SurveyView) -> SurveyView:
    """A survey with names of folders instead of paths."""
    outputs = [_without_folder(output) for output in view.outputs]
    return view.model_copy(update={"root": view.name, "labels": _name(view.labels), "outputs": outputs})


def compared_without_folders(view: ComparisonView) -> ComparisonView:
    """A comparison with names of folders instead of paths."""
    return view.model_copy(update={"a": _without_folder(view.a), "b": _without_folder(view.b)})


def without_reasons(view: CorrectionsView) -> CorrectionsView:
    """Entries without reasons and comments."""
    entries = [
        entry.model_copy(update={"values": {name: value for name, value in entry.values.items() if name != REASON}})
        for entry in view.entries
    ]
    return view.model_copy(update={"text": "", "version": "", "entries": entries})


def without_addresses(text: str) -> str:
    """A text without addresses of radios."""
    return _ADDRESS.sub("(address)", text)


def hidden_texts(workspace: Workspace) -> list[str]:
    """Texts to hide in sentences about a survey: folders of its files, and reasons of its corrections."""
    here = {str(folder) for place in (workspace.root, workspace.out) for folder in (place, place.resolve())}
    folders = here | {with_addresses(folder) for folder in here}
    corrections = workspace.now.corrections
    entries = (entry for name in type(corrections).model_fields for entry in getattr(corrections, name))
    return [
        *(f"{folder}/" for folder in sorted(folders, key=len, reverse=True) if folder not in (".", "/")),
        *{f" ({entry.reason})" for entry in entries if entry.reason},
    ]


def json_without(record: FiniteRecord, hidden: Sequence[str]) -> bytes:
    """A record as JSON, without hidden texts and with addresses of radios replaced."""
    text = record.model_dump_json()
    for one in hidden:
        text = text.replace(_quoted(one), "")
    return without_addresses(text).encode()


def _quoted(text: str) -> str:
    """A text as escaped in JSON."""
    return json.dumps(text, ensure_ascii=False)[1:-1]


def _without_folder(output: OutputView) -> OutputView:
    return output.model_copy(update={"folder": _name(output.folder)})


def _name(folder: str) -> str:
    return folder.rstrip("/").rpartition("/")[2]
