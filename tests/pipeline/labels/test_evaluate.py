"""Evaluation of a survey, from folder to files."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.pipeline.labels.evaluate import evaluate
from vislam2tag.pipeline.labels.evaluate_session import AT_CAMERA, AT_PRISM, IDENTIFIED, NEAREST, WITHOUT_LEAD
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.quality.evaluation.record import ErrorRow, SurveyEvaluation
from vislam2tag.quality.evaluation.trajectory_files import read_tum
from vislam2tag.quality.evaluation.truth import read_truth
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import Scenario, paper_evaluation
from vislam2tag.simulation.survey import simulate

STRATEGIES = ("local", "local-corrected", "smoother")


def pressed(root: Path, sessions: int) -> Path:
    """Walks over control points on floor 1, with truth beside them."""
    planned = paper_evaluation(3)
    kept = [one for one in planned.sessions if one.key.floor == 1 and one.duration_s < 600][:sessions]
    simulate(Scenario(planned.seed, planned.severity, planned.building, tuple(kept)), root)
    return root


def tracked(root: Path, sessions: int) -> Path:
    """Walks of one phone before a total station, without any other truth."""
    planned = paper_evaluation(3)
    kept = [one for one in planned.sessions if one.key.device == "LG_tachy"][:sessions]
    simulate(Scenario(planned.seed, planned.severity, planned.building, tuple(kept)), root)
    for truth in root.rglob("truth.csv"):
        truth.unlink()
    return root


@pytest.fixture(scope="module")
def station_survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tracked(tmp_path_factory.mktemp("station") / "survey", 2)


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return pressed(tmp_path_factory.mktemp("evaluate") / "survey", 2)


@pytest.fixture(scope="module")
def out(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evaluated") / "out"
    evaluate(survey, folder, strategies=STRATEGIES)
    return folder


def found_in(out: Path) -> SurveyEvaluation:
    return SurveyEvaluation.model_validate_json((out / "evaluation.json").read_bytes())


def row_of(found: SurveyEvaluation, truth: str, method: str, strategy: str) -> ErrorRow:
    [row] = [
        row
        for row in found.rows
        if (row.truth, row.method, row.strategy) == (truth, method, strategy)
        and (row.group, row.selection, row.over) == ("all", "all walks", "walks")
    ]
    return row


def test_every_truth_and_way_has_its_row(out: Path) -> None:
    found = found_in(out)
    methods = dict.fromkeys((row.truth.value, row.method) for row in found.rows)
    assert list(methods) == [
        ("dense", ""),
        ("control_points", IDENTIFIED),
        ("control_points", NEAREST),
        ("control_points", WITHOUT_LEAD),
    ]
    dense = row_of(found, "dense", "", "smoother").mean_m.value
    identified = row_of(found, "control_points", IDENTIFIED, "smoother").mean_m.value
    assert dense is not None
    assert identified is not None
    # A finger adds its own error to that of the labels.
    assert 0.03 < dense < 0.4
    assert dense < identified < 1.0


def test_a_walk_with_too_few_presses_for_a_lead_is_not_scored_without_it(survey: Path, tmp_path: Path) -> None:
    few = tmp_path / "survey"
    shutil.copytree(survey, few)
    for presses in few.rglob("refMarker.csv"):
        presses.write_text("".join(presses.read_text().splitlines(keepends=True)[:2]))
    found = evaluate(few, tmp_path / "out", strategies=("smoother",))
    methods = {one.method for session in found.sessions for one in session.measured}
    assert methods == {"", IDENTIFIED, NEAREST}
    assert found.sessions[0].estimates["lead_s"] is None


def test_the_phone_held_ahead_is_found_and_taken_away(out: Path) -> None:
    found = found_in(out)
    assert all("lead_s" in session.estimates for session in found.sessions)
    kept, removed = (
        row_of(found, "control_points", method, "smoother").ahead_m.value for method in (IDENTIFIED, WITHOUT_LEAD)
    )
    assert kept is not None
    assert removed is not None
    assert abs(removed) < abs(kept)


def test_what_a_strategy_keeps_and_how_landmarks_moved(out: Path) -> None:
    found = found_in(out)
    assert found.retention["local"] == 1
    kept = found.retention["local-corrected"]
    assert kept is not None
    assert 0.5 < kept < 1
    for session in found.sessions:
        assert session.faulty == (session.retention["local-corrected"] != 1)
        assert session.movement_m is not None
        assert 0 < session.movement_m < 30


def test_dense_truth_tells_of_ways_and_speeds(out: Path) -> None:
    found = found_in(out)
    relative = {
        row.low: row.mean_m for row in found.dense if (row.strategy, row.what) == ("smoother", "relative error")
    }
    assert list(relative) == [1, 5, 10, 50]
    both = [(row.mean_m, row.rmse_m) for row in found.dense if row.mean_m is not None and row.rmse_m is not None]
    assert len(both) == len(STRATEGIES) * len(relative)
    assert all(mean <= rmse for mean, rmse in both)
    assert relative[1] is not None
    assert relative[10] is not None
    assert 0 < relative[1] < relative[10]
    speeds = [row for row in found.dense if (row.strategy, row.what) == ("local-corrected", "speed")]
    assert max(speeds, key=lambda row: row.points).low in (0.8, 1.2)
    assert set(found.drift) == set(STRATEGIES)


def test_trajectories_are_those_of_the_run(survey: Path, out: Path) -> None:
    for session in found_in(out).sessions:
        folder = survey / f"floor_{session.floor}" / session.device / session.session
        truth = read_truth(folder / "truth.csv")
        written = read_tum(out / "trajectories" / f"{session.slug}.truth.tum")
        np.testing.assert_allclose(written.position_bcs, truth.position_bcs, atol=1e-6)
        labels = read_tum(out / "trajectories" / f"{session.slug}.smoother.tum")
        shared = np.isin(written.time_ns, labels.time_ns), np.isin(labels.time_ns, written.time_ns)
        apart = np.linalg.norm(written.position_bcs[shared[0]] - labels.position_bcs[shared[1]], axis=1)
        [measured] = [one for one in session.measured if (one.truth, one.strategy) == ("dense", "smoother")]
        assert apart.mean() == pytest.approx(measured.mean_m, abs=0.02)


def test_tables_hold_what_the_record_holds(out: Path) -> None:
    found = found_in(out)
    with (out / "errors.csv").open(encoding="utf-8") as stream:
        errors = list(csv.DictReader(stream))
    assert len(errors) == len(found.rows)
    assert float(errors[0]["mean_m"]) == found.rows[0].mean_m.value
    with (out / "sessions.csv").open(encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == sum(len(session.measured) for session in found.sessions)
    assert (out / "errors.tex").read_text().count("\\begin{tabular}") == 4
    assert json.loads((out / "run.json").read_bytes())["strategies"] == list(STRATEGIES)


def test_the_same_survey_gives_the_same_bytes_in_any_number_of_processes(
    survey: Path, out: Path, tmp_path: Path
) -> None:
    before = bytes_of(survey)
    evaluate(survey, tmp_path / "again", strategies=STRATEGIES, jobs=2)
    assert bytes_of(tmp_path / "again") == bytes_of(out)
    assert bytes_of(survey) == before


def test_labels_that_are_not_sure_enough_do_not_count(survey: Path, tmp_path: Path) -> None:
    settings = Settings(labels=LabelSettings(max_sigma_m=0.05))
    found = evaluate(survey, tmp_path / "out", settings, strategies=("smoother",))
    labelled = row_of(found, "dense", "", "smoother").labelled.value
    assert labelled is not None
    assert labelled < 0.5


def test_that_for_walks_without_poses_is_not_among_the_usual_strategies(tmp_path: Path) -> None:
    evaluate(make_survey(tmp_path / "survey", devices=("LG",), seconds=20.0), tmp_path / "out")
    names = json.loads((tmp_path / "out" / "run.json").read_bytes())["strategies"]
    assert "smoother" in names
    assert "dead-reckoning" not in names


def test_damaged_poses_are_refused_unless_dead_reckoning_is_among_the_strategies(survey: Path, tmp_path: Path) -> None:
    damaged = Path(shutil.copytree(survey, tmp_path / "survey"))
    for session in damaged.glob("floor_*/*/*/"):
        (session / "poses.csv").write_bytes(b"")
        rows = pl.read_csv(session / "truth.csv").gather_every(2000).select("time_ns", "x", "y").rows()
        fixes = "".join(f"{time_ns}; {x}; {y}\n" for time_ns, x, y in rows)
        (session / "fixes.csv").write_text(fixes, encoding="utf-8")
    refused = evaluate(damaged, tmp_path / "refused", strategies=("smoother",))
    assert all("--strategy dead-reckoning" in str(each.error) for each in refused.sessions)
    found = evaluate(damaged, tmp_path / "mapped", strategies=("dead-reckoning",))
    assert [each.error for each in found.sessions] == [None] * len(found.sessions)
    assert all(each.measured for each in found.sessions)


def test_truth_of_another_tool_from_its_own_folder(survey: Path, out: Path, tmp_path: Path) -> None:
    bare = tmp_path / "survey"
    shutil.copytree(survey, bare)
    for truth in bare.rglob("truth.csv"):
        truth.unlink()
    truths = tmp_path / "truths"
    truths.mkdir()
    slug = found_in(out).sessions[0].slug
    shutil.copy(out / "trajectories" / f"{slug}.truth.tum", truths / f"{slug}.tum")
    found = evaluate(bare, tmp_path / "out", strategies=("smoother",), truth=truths)
    assert [len([m for m in s.measured if m.truth == "dense"]) for s in found.sessions] == [1, 0]
    theirs, ours = row_of(found, "dense", "", "smoother"), found_in(out).sessions[0].measured
    assert theirs.mean_m.value == pytest.approx(next(m.mean_m for m in ours if m.strategy == "smoother"), abs=1e-3)


def test_a_truth_on_another_clock_or_unreadable_is_said_to_be_missing(survey: Path, tmp_path: Path) -> None:
    odd = tmp_path / "survey"
    shutil.copytree(survey, odd)
    first, second = sorted(odd.rglob("truth.csv"))
    first.write_text("time_ns,x,y\n7000,1,2\n")
    second.write_text("t,x\n")
    found = evaluate(odd, tmp_path / "out", strategies=("smoother",))
    assert "use the same clock" in found.sessions[0].missing[0]
    assert "expected a table" in found.sessions[1].missing[0]
    assert found.failed == 0
    assert {row.truth for row in found.rows} == {"control_points"}


def test_presses_without_control_points_say_so(survey: Path, tmp_path: Path) -> None:
    bare = tmp_path / "survey"
    shutil.copytree(survey, bare)
    (bare / "floor_1" / "refmarker.csv").unlink()
    found = evaluate(bare, tmp_path / "out", strategies=("smoother",), selection=Selection(floors=(1,)))
    assert all("has no control points" in session.missing[0] for session in found.sessions)


def test_without_any_truth_nothing_is_begun(tmp_path: Path) -> None:
    bare = make_survey(tmp_path / "survey", devices=("LG",))
    for points in bare.rglob("refmarker.csv"):
        points.unlink()
    (elsewhere := tmp_path / "truth").mkdir()
    (elsewhere / "walk.tum").write_text("0 1 2 0 0 0 0 1\n")
    with pytest.raises(
        SurveyError, match=r"found walk.tum. Rename the files, or remove --truth to use the truth files"
    ):
        evaluate(bare, tmp_path / "out", truth=elsewhere)
    for name in ("truth.csv", "refmarker.csv"):
        for path in bare.rglob(name):
            path.unlink()
    with pytest.raises(SurveyError, match="no ground truth to compare"):
        evaluate(bare, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_session_that_cannot_be_read_is_counted_and_the_others_go_on(survey: Path, tmp_path: Path) -> None:
    broken = tmp_path / "survey"
    shutil.copytree(survey, broken)
    sorted(broken.rglob("poses.csv"))[0].unlink()
    found = evaluate(broken, tmp_path / "out", strategies=("smoother",))
    assert found.failed == 1
    assert found.sessions[0].faulty is None
    assert "could not be mapped by any strategy" in str(found.sessions[0].error)
    assert found.sessions[1].measured


def test_folders_of_other_commands_and_wrong_names_are_refused(survey: Path, out: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="contains the output of `vislam2tag evaluate`"):
        process(survey, out)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(OutputError, match="vislam2tag evaluate did not create it"):
        evaluate(survey, tmp_path / "mine")
    with pytest.raises(OutputError, match="this folder is among the survey's sessions"):
        evaluate(survey, survey / "floor_1" / "evaluated")
    with pytest.raises(UsageError, match="no mapping strategy"):
        evaluate(survey, tmp_path / "out", strategies=("best",))
    with pytest.raises(UsageError, match="not a folder"):
        evaluate(survey, tmp_path / "out", truth=tmp_path / "missing")


def test_nothing_of_an_earlier_evaluation_stays(survey: Path, tmp_path: Path) -> None:
    evaluate(survey, tmp_path / "out", strategies=("local", "smoother"))
    evaluate(survey, tmp_path / "out", strategies=("local",))
    assert not list((tmp_path / "out" / "trajectories").glob("*.smoother.tum"))


@pytest.mark.slow
def test_a_station_tells_of_all_walks_of_a_phone(station_survey: Path, tmp_path: Path) -> None:
    before = bytes_of(station_survey)
    found = evaluate(station_survey, tmp_path / "out", strategies=("smoother",))
    assert [(row.truth.value, row.method) for row in found.rows if row.over == "walks"][::2] == [
        ("total_station", AT_PRISM),
        ("total_station", AT_CAMERA),
    ]
    error = row_of(found, "total_station", AT_PRISM, "smoother")
    assert error.walks == 2
    assert error.mean_m.value is not None
    assert 0.03 < error.mean_m.value < 0.5
    first, second = (session.estimates for session in found.sessions)
    assert first == second
    assert first["station_clock_sigma_s"] is not None
    assert first["station_clock_sigma_s"] < 0.1
    assert not any(session.missing for session in found.sessions)
    assert "station_drift_ppm" not in first
    drifting = evaluate(station_survey, tmp_path / "out", strategies=("smoother",), clock_drift=True)
    assert "station_drift_ppm" in drifting.sessions[0].estimates
    assert bytes_of(station_survey) == before


def test_a_control_point_that_is_measured_elsewhere_is_named(survey: Path, out: Path, tmp_path: Path) -> None:
    assert found_in(out).odd_points == []
    pressed_often = [one.point for session in found_in(out).sessions for one in session.presses]
    point = max(set(pressed_often), key=pressed_often.count)
    moved = tmp_path / "survey"
    shutil.copytree(survey, moved)
    table = moved / "floor_1/refmarker.csv"
    control_points = open_survey(moved).site.floor(1).control_points
    row = control_points.ids.index(point)
    lines = table.read_text().splitlines()
    line = int(control_points.source[row].rpartition(":")[2]) - 1
    x, rest = lines[line].split(",", 1)
    lines[line] = f"{float(x) + 2.0},{rest}"
    table.write_text("\n".join(lines) + "\n")
    odd = evaluate(moved, tmp_path / "out", strategies=("smoother",)).odd_points
    assert [one.point for one in odd] == [point]
    assert odd[0].size_m == pytest.approx(2.0, abs=0.8)
