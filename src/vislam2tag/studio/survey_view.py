"""The survey for the page: floors, landmarks, control points, colours and codes, and comparison of outputs."""

from __future__ import annotations

import io
import math
from collections import Counter

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.palette import EVENT_STYLES, STATUS_STYLES
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status, has_position
from vislam2tag.core.tracks import Landmarks
from vislam2tag.datasets.label_comparison import Labelled, Positions, compare_labels
from vislam2tag.site.corrections.landmarks import corrected_landmarks
from vislam2tag.site.model import Floor, SessionKey
from vislam2tag.site.plans.load import plan_picture
from vislam2tag.studio import messages
from vislam2tag.studio.messages import Text, seen_as
from vislam2tag.studio.outputs import BEFORE, LABELS, Output
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.work_messages import ComparisonView
from vislam2tag.studio.workspace import Workspace, plan_stamp


def survey_view(workspace: Workspace, command: str = "") -> messages.SurveyView:
    """Everything except the sessions; ``command`` starts the studio."""
    now = workspace.now
    labels = workspace.settings.labels
    return messages.SurveyView(
        version=now.version,
        name=workspace.root.resolve().name,
        root=str(workspace.root.resolve()),
        labels=str(workspace.out.resolve()),
        program_version=__version__,
        command=command,
        floors=[_floor(floor) for floor in now.survey.site.floors],
        landmarks=_landmarks(workspace),
        control_points=_control_points(workspace),
        devices=sorted({ref.key.device for ref in now.survey.sessions}),
        findings=[*workspace.of_labels, *now.survey.findings],
        statuses=_statuses(),
        event_kinds=[seen_as(messages.EventKindView, style, kind=kind.value) for kind, style in EVENT_STYLES.items()],
        outputs=[output_view(each) for name, each in workspace.outputs.items() if name != BEFORE],
        strategy=workspace.settings.strategy,
        sigma_limit_m=labels.max_sigma_m if math.isfinite(labels.max_sigma_m) else None,
    )


def output_view(output: Output) -> messages.OutputView:
    """The contents of a folder of labels."""
    sessions = len(list(output.root.glob("sessions/*.json")))
    return messages.OutputView(
        name=output.name, folder=str(output.root.resolve()), strategy=output.strategy(), sessions=sessions
    )


def plan_png(floor: Floor, side_px: int) -> bytes:
    """A floor's plan as PNG with a maximum longer side in pixels; raises OSError if it cannot be drawn."""
    buffer = io.BytesIO()
    plan_picture(floor, min(side_px, messages.MOST_PIXELS)).save(buffer, "png")
    return buffer.getvalue()


def _floor(floor: Floor) -> messages.FloorView:
    there = floor.plan is not None and floor.extent_m is not None
    frame = floor.site_T_bcs
    return messages.FloorView(
        number=floor.number,
        name=floor.name,
        elevation_m=floor.elevation_m,
        extent_m=floor.extent_m,
        plan=f"/api/floors/{floor.number}/plan?stamp={plan_stamp(floor)}" if there else None,
        site_T_bcs=messages.Frame(rotation_rad=frame.rotation_rad, shift_m=(frame.b.real, frame.b.imag)),
    )


def _statuses() -> list[messages.StatusView]:
    codes = {status.label: status for status in Status}
    placed = has_position(np.array(list(codes.values()))).tolist()
    there = dict(zip(codes, placed, strict=True))
    return [
        seen_as(messages.StatusView, style, code=int(codes[label]), has_position=there[label])
        for label, style in STATUS_STYLES.items()
    ]


def _landmarks(workspace: Workspace) -> list[messages.LandmarkView]:
    marks, used = workspace.now.files.site.landmarks, workspace.now.survey.site.landmarks
    corrected = _corrected_places(workspace, marks)
    seen = _seen_in(workspace)
    planned = {floor: marks.on_floor(floor).planned_ids for floor in np.unique(marks.floor).tolist()}
    views = []
    for i, (name, floor) in enumerate(zip(marks.ids, marks.floor.tolist(), strict=True)):
        before, after = marks.position_bcs[i], corrected.get((floor, name))
        moved = after is not None and bool(np.isfinite(after).all()) and not np.array_equal(before, after)
        variance = float(marks.covariance_bcs[i].trace()) / 2
        views.append(
            messages.LandmarkView(
                id=name,
                floor=floor,
                x=_known(before[0]),
                y=_known(before[1]),
                z=_known(marks.z_m[i]),
                sigma_m=math.sqrt(variance) if math.isfinite(variance) else None,
                heading_rad=_known(marks.heading_rad[i]),
                surveyed=bool(used.surveyed[i]),
                planned=name in planned[floor],
                source=marks.source[i] if marks.source else "",
                corrected=(float(after[0]), float(after[1])) if moved and after is not None else None,
                excluded=after is None,
                seen_in=seen[floor, name],
            )
        )
    return views


def _corrected_places(workspace: Workspace, marks: Landmarks) -> dict[tuple[int, str], FloatArray]:
    """Places by floor and id with the corrections that hold for every session; without excluded landmarks."""
    nobody = SessionKey(0, "", "")
    chosen, _ = corrected_landmarks(marks, workspace.now.corrections, nobody)
    return dict(zip(zip(chosen.floor.tolist(), chosen.ids, strict=True), chosen.position_bcs, strict=True))


def _seen_in(workspace: Workspace) -> Counter[tuple[int, str]]:
    seen: Counter[tuple[int, str]] = Counter()
    for id in workspace.now.ids:
        result = workspace.result(id)
        if result is not None:
            seen.update(
                (floor, name) for floor in {result.floor, *result.elsewhere} for name in result.landmarks_logged
            )
    return seen


def _control_points(workspace: Workspace) -> list[messages.ControlPointView]:
    corrected = {floor.number: floor.control_points for floor in workspace.now.survey.site.floors}
    views = []
    for floor in workspace.now.files.site.floors:
        points, moved = floor.control_points, corrected[floor.number].position_bcs
        for i, name in enumerate(points.ids):
            x, y = points.position_bcs[i].tolist()
            to_x, to_y = moved[i].tolist()
            source = points.source[i] if points.source else ""
            place = None if (to_x, to_y) == (x, y) else (to_x, to_y)
            views.append(
                messages.ControlPointView(id=name, floor=floor.number, x=x, y=y, source=source, corrected=place)
            )
    return views


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


@endpoint("GET", "/api/compare")
def comparison(workspace: Workspace, a: Text, b: Text) -> ComparisonView:
    """Compare two outputs by their names; raises KeyError for an unknown name."""
    first, second = workspace.outputs[a], workspace.outputs[b]
    pairs = ((id, _labelled(workspace, id, a), _labelled(workspace, id, b)) for id in workspace.now.ids)
    # Labels before the last change were made by the settings of this studio, which do not change.
    made_by = [workspace.outputs[LABELS if name == BEFORE else name].settings() for name in (a, b)]
    found = compare_labels((pair for pair in pairs if any(pair[1:])), *made_by)
    return ComparisonView(a=output_view(first), b=output_view(second), **dict(found))


def _labelled(workspace: Workspace, id: str, output: str) -> Labelled | None:
    """A walk in one output, by its session's id."""
    result, track = workspace.result(id, output), workspace.track(id, output)
    if result is None:
        return None
    if track is None:
        return Labelled(result, None)
    x, y = (track.columns[axis].astype(np.float64) for axis in ("x", "y"))
    return Labelled(result, Positions(np.column_stack((x, y)), track.columns["floor"], track.positioned))
