"""Sessions of phones without a tracker: a file of fixes in place of poses, from simulated survey to labels."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from vislam2tag.cli.app import app
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.without_poses import with_presses_as_fixes
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import SessionLayout, WalkStyle, walk_settings
from vislam2tag.simulation.survey import WritingOptions, simulate, walk_and_track
from vislam2tag.site.model import ControlPoints


def simulated(out: Path, layout: SessionLayout = SessionLayout.PUBLISHED) -> Path:
    options = WritingOptions(without_poses=True, layout=layout)
    simulate(regular_survey(5, "none", (0,), ("LG",), 1, 60.0), out, options)
    return out


def session_folder(survey: Path) -> Path:
    return next(survey.glob("floor_0/LG/*"))


def read(survey: Path) -> Session:
    return read_session(open_survey(survey).sessions[0])


def test_from_simulate_to_labels_on_the_command_line(tmp_path: Path) -> None:
    survey, out = tmp_path / "survey", tmp_path / "out"
    options = ("--floors", "1", "--devices", "1", "--sessions", "1", "--minutes", "1", "--without-poses")
    assert CliRunner().invoke(app, ["simulate", str(survey), *options]).exit_code == 0
    assert not list(survey.rglob("poses.csv"))
    assert CliRunner().invoke(app, ["process", str(survey), "--out", str(out)]).exit_code == 0
    summary = json.loads((out / "summary.json").read_bytes())
    assert (summary["sessions"], summary["failed"]) == (1, 0)
    errors = summary["errors"]
    known = sum(errors["inside"])
    assert sum(row["sum_m"] for row in errors["rows"]) / known < 1.0
    assert sum(errors["inside"][:95]) / known > 0.85
    (wifi,) = (pl.read_parquet(path) for path in (out / "wifi").glob("*.parquet"))
    assert set(wifi["status"]) <= {"ok", "duplicate", "outside_frames"}
    assert wifi.filter(status="ok").select(pl.col("x", "y", "sigma").is_not_null().all()).row(0) == (True, True, True)


def test_the_phone_apps_layout_without_poses_is_mapped_alike(tmp_path: Path) -> None:
    summary = process(simulated(tmp_path / "survey", SessionLayout.PHONE), tmp_path / "out")
    assert (summary.failed, set(summary.frames)) == (0, {"ok"})


def test_what_a_tracker_would_have_written_is_not_missed(tmp_path: Path) -> None:
    session = read(simulated(tmp_path / "survey"))
    assert session.findings == ()
    assert session.camera.inertial is not None
    assert session.camera.fixes is not None
    assert len(session.camera.fixes.time_ns) == 4


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("100; 1.0; 2.0\n", {"too_few_fixes"}),
        ("100; 1.0; nan\n200; 1.0; 2.0\n300; 2.0; 2.0\n", {"non_finite_values"}),
        ("100; 1.0; 2.0\nabc\n300; 2.0; 2.0\n", {"malformed_lines"}),
    ],
)
def test_bad_rows_of_fixes_are_findings(tmp_path: Path, text: str, kinds: set[str]) -> None:
    survey = simulated(tmp_path / "survey")
    (session_folder(survey) / "fixes.csv").write_text(text, encoding="utf-8")
    assert {finding.kind for finding in read(survey).findings} == kinds


def mapped_kinds(survey: Path, out: Path) -> dict[str, str]:
    """Messages of what mapping found of the only session, by kind."""
    process(survey, out)
    found = json.loads(next((out / "sessions").glob("*.json")).read_bytes())["findings"]
    return {finding["kind"]: finding["message"] for finding in found}


@pytest.mark.parametrize("kept", [2, 3])
def test_a_walk_through_fewer_than_three_fixes_could_not_be_judged(tmp_path: Path, kept: int) -> None:
    survey = simulated(tmp_path / "survey")
    file = session_folder(survey) / "fixes.csv"
    rows = file.read_text(encoding="utf-8").splitlines()
    file.write_text("\n".join([*rows[: kept - 1], rows[-1]]) + "\n", encoding="utf-8")
    found = mapped_kinds(survey, tmp_path / "out")
    assert set(found) & {"unjudged_fixes", "contradicting_fixes"} == ({"unjudged_fixes"} if kept == 2 else set())
    if kept == 2:
        assert "could not be verified: the walk has 2 known positions" in found["unjudged_fixes"]


def test_the_true_fixes_of_a_cart_contradict_steps_that_it_does_not_make(tmp_path: Path) -> None:
    survey = simulated(tmp_path / "survey")
    file = session_folder(survey) / "sensors.csv"
    rows = [line.split("; ") for line in file.read_text(encoding="utf-8").splitlines()]
    rolled = [[*row[:2], "0.01", "6.9", "6.9", *row[5:]] if row[1] == "ACC" else row for row in rows]
    file.write_text("".join("; ".join(row) + "\n" for row in rolled), encoding="utf-8")
    message = mapped_kinds(survey, tmp_path / "out")["contradicting_fixes"]
    assert "Check which points were pressed" in message
    assert "the phone was probably on a cart and not carried" in message


def test_without_inertial_readings_nothing_can_be_mapped(tmp_path: Path) -> None:
    survey = simulated(tmp_path / "survey")
    (session_folder(survey) / "sensors.csv").unlink()
    found = {finding.kind: finding.message for finding in read(survey).findings}
    assert "no usable poses, and accelerometer or gyroscope" in found["no_frames"]


def test_fixes_of_a_session_with_poses_change_nothing(tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    simulate(regular_survey(5, "none", (0,), ("LG",), 1, 20.0), survey, WritingOptions())
    before = read(survey).camera
    (session_folder(survey) / "fixes.csv").write_text("1; 0; 0\n2; 1; 1\n", encoding="utf-8")
    after = read(survey).camera
    assert after.inertial is None
    assert (after.position_acs == before.position_acs).all()


def test_taps_on_the_plan_are_fixes_where_no_camera_was(tmp_path: Path) -> None:
    survey = simulated(tmp_path / "survey", SessionLayout.PHONE)
    expected = read(survey).camera.fixes
    assert expected is not None
    (session_folder(survey) / "fixes.csv").unlink()
    places = expected.position_bcs.tolist()
    rows = [f"{t},{n},tap,{x},{y},0.6" for n, (t, (x, y)) in enumerate(zip(expected.time_ns, places, strict=True))]
    rows[0] = rows[0].removesuffix("0.6")
    wrong = [f"{expected.time_ns[0] + 10**9},98,tap,0,0,0.6", f"{expected.time_ns[0] + 2 * 10**9},98,undo,,,"]
    nowhere = f"{expected.time_ns[0] + 3 * 10**9},99,tap,,,"
    text = "\n".join(("time_ns,n,action,x_m,y_m,sigma_m", *rows, *wrong, nowhere)) + "\n"
    (session_folder(survey) / "ControlPoint.csv").write_text(text, encoding="utf-8")
    session = read(survey)
    assert session.camera.fixes is not None
    assert session.camera.fixes.time_ns.tolist() == expected.time_ns.tolist()
    assert session.camera.fixes.position_bcs.tolist() == expected.position_bcs.tolist()
    assert session.camera.fixes.sigma_m is not None
    assert np.isnan(session.camera.fixes.sigma_m[0])
    assert (session.camera.fixes.sigma_m[1:] == 0.6).all()
    assert session.camera.inertial is not None
    assert [(each.kind, each.file) for each in session.findings] == [("non_finite_values", "ControlPoint.csv")]
    assert len(session.presses_ns) == 0


def test_presses_are_fixes_at_the_control_points_in_order_where_no_camera_was(tmp_path: Path) -> None:
    survey, out = tmp_path / "survey", tmp_path / "out"
    walk = walk_settings(WalkStyle.CONTROL_POINTS)
    scenario = regular_survey(5, "none", (0,), ("LG",), 1, 60.0, walk=walk)
    pressed = replace(scenario, sessions=tuple(replace(each, presses=True) for each in scenario.sessions))
    simulate(pressed, survey, WritingOptions(layout=SessionLayout.PHONE))
    true = walk_and_track(pressed, pressed.sessions[0])[0]
    points = pressed.building.floor(0).control_points[true.pressed_point]
    rows = "".join(f"{x},{y}\n" for x, y in points)
    (survey / "floor_0" / "refmarker.csv").write_text(rows, encoding="utf-8")
    for name in ("CameraPose.csv", "LandmarkPose.csv", "AnchorPose.csv"):
        (session_folder(survey) / name).unlink()
    unmapped = read(survey)
    fewer = ControlPoints(("1",), points[:1])
    assert with_presses_as_fixes(unmapped, fewer) is unmapped
    summary = process(survey, out)
    assert (summary.failed, set(summary.frames)) == (0, {"ok"})
    found = json.loads(next((out / "sessions").glob("*.json")).read_bytes())
    assert not {"missing_file", "no_frames"} & {finding["kind"] for finding in found["findings"]}
    assert summary.errors is not None
    assert sum(row.sum_m for row in summary.errors.rows) / sum(summary.errors.inside) < 1.0
