"""How the server describes a walk that the plan alone does not place, and that one tap places."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.studio.placed_survey import AMBIGUOUS, set_tap, true_place, write_unplaced_survey
from tests.views.factory import START_NS, unplaced
from vislam2tag.core.status import Status
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.studio.messages import TapsView
from vislam2tag.studio.session_view import session_detail, session_list, taps
from vislam2tag.studio.survey_view import survey_view
from vislam2tag.studio.workspace import Workspace


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workspace]:
    root = tmp_path_factory.mktemp("placing")
    survey = write_unplaced_survey(root, *AMBIGUOUS)
    process(survey, root / "labels")
    with closing(Workspace(survey, root / "labels", Settings())) as opened:
        yield opened


def test_a_refused_walk_has_its_reason_its_paths_and_a_moment_to_tap(workspace: Workspace) -> None:
    (walk,) = session_list(workspace).sessions
    assert walk.refused in {status.label for status in Status}
    assert walk.labelled_share == 0
    placing = session_detail(workspace, walk.id).placing
    assert placing is not None
    assert (placing.reason, placing.labelled_share) == (walk.refused, 0)
    assert placing.tap_s == walk.tap_s
    assert placing.tap_s is not None
    assert placing.t == sorted(placing.t)
    assert 0 < placing.t[0] <= placing.t[-1] < walk.duration_s
    assert 0 <= placing.tap_s <= walk.duration_s
    weights = [path.weight for path in placing.candidates]
    assert len(weights) > 1
    assert weights == sorted(weights, reverse=True)
    assert 0.9 < sum(weights) <= 1.001
    assert {len(path.points) for path in placing.candidates} == {len(placing.t)}


def test_labels_that_were_mapped_together_are_reported(workspace: Workspace, tmp_path: Path) -> None:
    assert workspace.of_labels == ()
    shutil.copytree(workspace.out, tmp_path / "labels")
    run = tmp_path / "labels" / "run.json"
    run.write_text(run.read_text().replace('"together": false', '"together": true'))
    with closing(Workspace(workspace.root, tmp_path / "labels", Settings())) as opened:
        finding = survey_view(opened).findings[0]
    assert finding.kind == "mapped_together"
    assert finding.message.endswith("run: vislam2tag process SURVEY --out LABELS --together")


def test_a_tap_places_it(workspace: Workspace, tmp_path: Path) -> None:
    (walk,) = session_list(workspace).sessions
    assert taps(workspace, walk.id) == TapsView(taps=[])
    assert walk.tap_s is not None
    x, y = true_place(workspace.root, walk.key.session, walk.tap_s)
    set_tap(workspace.root, walk.key.session, walk.tap_s, x, y)
    with closing(Workspace(workspace.root, tmp_path / "labels", Settings())) as tapped:
        process(workspace.root, tmp_path / "labels")
        (placed,) = session_list(tapped).sessions
        placing = session_detail(tapped, walk.id).placing
        (tap,) = taps(tapped, walk.id).taps or []
    (workspace.root / "corrections.toml").unlink()
    workspace.refresh()
    assert (placed.refused, placed.tap_s, placed.labelled_share) == (None, None, 1)
    assert placing is not None
    assert (placing.reason, placing.candidates) == ("ok", [])
    assert (tap.at_s, tap.x, tap.y) == (walk.tap_s, x, y)


def test_without_a_plan_taps_of_a_walk_with_tracker_are_of_no_use(workspace: Workspace, tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    sessions = next(workspace.root.glob("floor_*"))
    (survey / sessions.name).mkdir(parents=True)
    (survey / sessions.name / "LG").symlink_to(sessions / "LG")
    with closing(Workspace(survey, tmp_path / "labels", Settings())) as planless:
        (walk,) = session_list(planless).sessions
        assert taps(planless, walk.id).taps is None
        assert session_detail(planless, walk.id).placing is None
        assert (walk.refused, walk.tap_s) == (None, None)


def test_no_tap_is_asked_for_where_none_helps() -> None:
    assert unplaced("ambiguous").best_tap_s(START_NS) == 130
    assert unplaced("fits_nowhere").best_tap_s(START_NS) is None
    assert unplaced("ok").model_copy(update={"best_tap_ns": None}).best_tap_s(START_NS) is None
    assert unplaced("ambiguous").refused
    assert not unplaced("ok").refused
