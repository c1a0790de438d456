"""Walks of a floor that tell one another where landmarks hang."""

from __future__ import annotations

import csv
import json
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import make_survey
from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import joint_columns
from vislam2tag.estimation.landmark_survey.comparison import OtherWalks
from vislam2tag.estimation.tracker_errors import noise_of_other_walks
from vislam2tag.labeling.results import Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.landmark_survey import ReducedSession, join_sessions, reduce_session
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome, jobs_of
from vislam2tag.pipeline.labels.together import HeardWalk, JoiningJob, _told, heard_walk, told_tasks
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.pipeline.run.workers import process_all
from vislam2tag.quality.diagnosis.record import References
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.corrections.file import Corrections

SURVEYED = ("2", "5", "8")
TOGETHER = ProcessSettings(together=True)


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four walks on a floor of which three landmarks are surveyed."""
    root = make_survey(tmp_path_factory.mktemp("together") / "survey", sessions=2, seconds=120.0, severity="default")
    path = root / "floor_0/marker_dict.csv"
    next((root / "floor_0").glob("floorplan.*")).unlink()  # by which walks would be placed
    head, *rows = csv.reader(path.read_text().splitlines())
    kept = [row if row[0] in SURVEYED else [row[0], "", ""] for row in rows]
    path.write_text("\n".join(",".join(row) for row in [head, *kept]) + "\n")
    return root


@pytest.fixture(scope="module", name="together")
def _together(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Summary]:
    out = tmp_path_factory.mktemp("labels") / "out"
    return out, process(survey, out, TOGETHER)


def test_walks_together_are_mapped_where_walks_alone_cannot_be(
    survey: Path, together: tuple[Path, Summary], tmp_path: Path
) -> None:
    alone = process(survey, tmp_path / "alone")
    assert alone.failed > 0
    assert together[1].failed == 0
    assert together[1].frames["ok"] > 1.5 * alone.frames["ok"]
    assert together[1].findings["told_by_others"] > 0
    assert not (tmp_path / "alone/conflicts.json").exists()


def test_sessions_are_told_of_how_far_walks_see_landmarks_off(survey: Path) -> None:
    opened = open_survey(survey)
    tasks = [session_task(ref, opened, Corrections(), TOGETHER) for ref in opened.sessions]
    joint = join_sessions(opened, [reduce_session(TOGETHER.mapping, task) for task in tasks], 0.02)
    others = OtherWalks(joint.joined)
    for number, told in enumerate(_told(joint)[session.key] for session in joint.mapped):
        exact, passed = others.told(number), joint.joined.maps[number].landmark
        own = joint_columns(np.flatnonzero(np.isin(exact.landmark, passed)), len(exact.landmark))[: 2 * len(told.ids)]
        off_m2 = np.diag(told.joint_covariance)[: len(own)] - np.diag(exact.covariance)[own]
        assert np.median(off_m2) == pytest.approx(joint.joined.doubts.seen_off_m2, rel=0.3)


def test_how_references_fit_one_another_lies_beside_the_report(together: tuple[Path, Summary], tmp_path: Path) -> None:
    found = References.model_validate_json((together[0] / "conflicts.json").read_text())
    assert {one.landmark for one in found.compared if one.session is None} == set(SURVEYED)
    assert len({one.session for one in found.compared}) == 5
    assert 'href="conflicts.html"' in (together[0] / "report.html").read_text()
    out = tmp_path / "out"
    shutil.copytree(together[0], out)
    with claim(out, {}, replace=True):
        assert not (out / "conflicts.json").exists()
        assert not (out / "conflicts.html").exists()


@pytest.mark.slow
def test_nothing_is_repeated_unless_others_tell_something_new(
    survey: Path, together: tuple[Path, Summary], tmp_path: Path
) -> None:
    again: list[Outcome] = []
    out = tmp_path / "out"
    shutil.copytree(together[0], out)
    process(survey, out, TOGETHER, progress=lambda outcome, _: again.append(outcome))
    assert not any(outcome.repeated for outcome in again)
    fewer = tmp_path / "fewer"
    shutil.copytree(survey, fewer)
    left_out = next((fewer / "floor_0/LG").iterdir())
    shutil.rmtree(left_out)
    changed: list[Outcome] = []
    process(fewer, out, TOGETHER, progress=lambda outcome, _: changed.append(outcome))
    assert all(outcome.repeated for outcome in changed)


@pytest.mark.slow
def test_the_order_and_number_of_processes_do_not_matter(
    survey: Path, together: tuple[Path, Summary], tmp_path: Path
) -> None:
    process(survey, tmp_path / "out", TOGETHER, jobs=2)
    for path in sorted((together[0] / "trajectory").glob("*.parquet")):
        assert path.read_bytes() == (tmp_path / "out/trajectory" / path.name).read_bytes()


def test_the_run_says_that_walks_were_mapped_together(together: tuple[Path, Summary]) -> None:
    assert json.loads((together[0] / "run.json").read_text())["settings"]["together"] is True


def test_other_strategies_map_alone(survey: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="remove --together or --strategy"):
        process(survey, tmp_path / "out", TOGETHER.model_copy(update={"strategy": "local"}))
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_walks_without_poses_help_each_other_on_their_floor_alone(tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    options = WritingOptions(without_poses=True)
    simulate(regular_survey(5, "none", (0, 1), ("LG",), 2, 60.0), survey, options)
    shutil.rmtree(next((survey / "floor_1/LG").iterdir()))
    alone, helped = process(survey, tmp_path / "alone"), process(survey, tmp_path / "helped", TOGETHER)
    assert (alone.failed, helped.failed) == (0, 0)
    names = {path.name for path in (tmp_path / "alone/wifi").glob("*.parquet")}
    changed = {
        name
        for name in names
        if (tmp_path / "alone/wifi" / name).read_bytes() != (tmp_path / "helped/wifi" / name).read_bytes()
    }
    assert len(names) == 3
    assert changed == {name for name in names if name.startswith("floor_0")}


def test_a_session_that_workers_die_of_tells_others_nothing(survey: Path) -> None:
    opened = open_survey(survey)
    task = session_task(opened.sessions[0], opened, Corrections(), TOGETHER)
    (of_session,) = jobs_of([task], TOGETHER)
    for reduce, nothing in ((reduce_session, ReducedSession), (heard_walk, HeardWalk)):
        job = JoiningJob(of_session, "", reduce, nothing)
        assert job.given_up("3 workers died of it") == nothing(task.ref.key, error="3 workers died of it")


def test_a_session_is_told_how_noisy_others_of_its_device_are(survey: Path) -> None:
    opened = open_survey(survey)
    tasks = [session_task(ref, opened, Corrections(), TOGETHER) for ref in opened.sessions]
    with_told = told_tasks(opened, tasks, TOGETHER, partial(process_all, workers=1), lambda *_: None).tasks
    noise = {task.ref.key: reduce_session(TOGETHER.mapping, task).noise for task in tasks}
    for task in with_told:
        keys = sorted(noise)
        shown = [one.evidence for one in map(noise.get, keys) if one is not None]
        assert len(shown) == len(keys)
        assert task.tracker == noise_of_other_walks([key.device for key in keys], shown)[keys.index(task.ref.key)]
    assert any(task.tracker is not None for task in with_told)
