"""What the studio's server would answer as JSON, each answer with the name of its file."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import TypeAlias

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.extras import missing_extra
from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.collect.covered import covered_floors
from vislam2tag.studio.comparison import comparison
from vislam2tag.studio.corrections_view import corrections_view
from vislam2tag.studio.diagnosis_view import Diagnoses
from vislam2tag.studio.layer_registry import LAYERS
from vislam2tag.studio.messages import FloorView, SurveyView
from vislam2tag.studio.outputs import BEFORE
from vislam2tag.studio.radio.maps import Radio
from vislam2tag.studio.radio.messages import RadioView
from vislam2tag.studio.session_view import session_detail, session_list
from vislam2tag.studio.sharing.private import compared_without_folders, without_folders, without_reasons
from vislam2tag.studio.survey_view import survey_view
from vislam2tag.studio.work_messages import LayerInfo, Layers, LayerView
from vislam2tag.studio.workspace import Workspace

Answer: TypeAlias = tuple[str, FiniteRecord]
"""The server's address without ``/api/``, what stands behind its question mark as folders; and the answer."""


def shown_outputs(workspace: Workspace) -> list[str]:
    """Names of the labels that are given: the survey's, and those to compare with."""
    return [name for name in workspace.outputs if name != BEFORE]


def plan_file(floor: int) -> str:
    """Where a floor's picture lies."""
    return f"plans/{floor}.png"


def survey_answers(workspace: Workspace, radio: Radio | None) -> Iterator[Answer]:
    """All but those of each walk; ``radio`` None: nothing is heard often enough for maps."""
    view = without_folders(survey_view(workspace))
    yield "survey", _with_plan_files(view)
    yield "sessions", session_list(workspace)
    yield "corrections", without_reasons(corrections_view(workspace))
    yield "diagnosis", Diagnoses(workspace).view()
    yield "covered", covered_floors(workspace)
    none = RadioView(state="none", floors=[], changes=[])
    yield "radio", none if radio is None else radio.view(stale=False)
    yield from _layers(workspace, view.floors)
    for a, b in permutations(shown_outputs(workspace), 2):
        yield f"compare/{a}/{b}", compared_without_folders(comparison(workspace, a, b))


def walk_answer(workspace: Workspace, id: str) -> Answer:
    """Everything of a walk but its frames and raw files."""
    return f"sessions/{id}", session_detail(workspace, id).model_copy(update={"files": []})


def _with_plan_files(view: SurveyView) -> SurveyView:
    floors = [
        floor.model_copy(update={"plan": plan_file(floor.number) if floor.plan else None}) for floor in view.floors
    ]
    return view.model_copy(update={"floors": floors})


def _layers(workspace: Workspace, floors: list[FloorView]) -> Iterator[Answer]:
    """Each layer that can be drawn of every floor."""
    infos = []
    for name, layer in LAYERS.all().items():
        try:
            views = [LayerView(features=layer.features(workspace, floor.number)) for floor in floors]
        except (SurveyError, UsageError):
            continue  # the studio itself tells why
        except ModuleNotFoundError as error:
            if missing_extra(error) is None:
                raise
            continue
        infos.append(LayerInfo(name=name, title=layer.title, shown=layer.shown))
        for floor, view in zip(floors, views, strict=True):
            yield f"layers/{name}/{floor.number}", view
    yield "layers", Layers(layers=infos)
