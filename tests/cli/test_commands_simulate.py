from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from vislam2tag.cli import main
from vislam2tag.sessions.inspection import inspect_survey

SMALL = ["--floors", "1", "--devices", "1", "--sessions", "1", "--minutes", "0.25"]


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["vislam2tag", "simulate", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_writes_a_survey(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = [
        "--seed",
        "9",
        "--severity",
        "mild",
        "--trap",
        "missing_plan",
        "--names",
        "paper",
        "--landmark-count",
        "8",
    ]
    assert run(monkeypatch, str(tmp_path / "out"), *SMALL, *options) == 0
    assert "1 walk on 1 floor" in capsys.readouterr().out
    description = json.loads((tmp_path / "out" / "simulation.json").read_text())
    assert (description["seed"], description["severity"], description["names"]) == (9, 0.5, "paper")
    assert len((tmp_path / "out" / "floor_0" / "marker_dict.csv").read_text().splitlines()) == 9
    assert not list(tmp_path.rglob("floorplan.jpg"))
    assert len(list(tmp_path.rglob("CameraPose.csv"))) == 1


def test_a_file_furnishes_the_building_and_options_win(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    config = tmp_path / "own.toml"
    config.write_text("[simulation.building]\nlandmarks = 8\nwidth_m = 50.0\n")
    for name, *options in (("file",), ("option", "--landmark-count", "7")):
        assert run(monkeypatch, str(tmp_path / name), *SMALL, "--config", str(config), *options) == 0
    for name, landmarks in (("file", 8), ("option", 7)):
        description = json.loads((tmp_path / name / "simulation.json").read_text())
        assert description["building"] == {"landmarks": landmarks, "width_m": 50.0}
        assert len((tmp_path / name / "floor_0" / "marker_dict.csv").read_text().splitlines()) == landmarks + 1
        assert (tmp_path / name / "floor_dimensions.csv").read_text().splitlines()[1].startswith("0,50")


def test_writes_walks_over_floors_with_pressure_and_columns(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    size = ["--floors", "2", "--devices", "1", "--sessions", "1", "--minutes", "2", "--seed", "2"]
    wanted = ["--climb", "stairs", "--pressure", "--column", "elevation", "--column", "z", "--column", "heading"]
    assert run(monkeypatch, str(tmp_path / "out"), *size, *wanted) == 0
    description = json.loads((tmp_path / "out" / "simulation.json").read_text())
    assert (description["columns"], description["pressure"]) == (["elevation", "heading", "z"], True)
    assert [session["climb"] for session in description["sessions"]] == ["stairs", "stairs"]
    header = (tmp_path / "out" / "floor_1" / "marker_dict.csv").read_text().splitlines()[0]
    assert header == "id,x,y,z,heading_rad,heading_sigma_rad"
    truth = next((tmp_path / "out" / "floor_0").rglob("truth.csv")).read_text().splitlines()
    assert {line.rsplit(",", 1)[1] for line in truth[1:]} == {"0", "1"}
    sensors = next((tmp_path / "out" / "floor_0").rglob("sensors.csv")).read_text()
    assert sensors.count("; PRESSURE; ") > 1000


def test_writes_sessions_of_the_phone_app(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), *SMALL, "--format", "phone", "--scripts") == 0
    (session,) = tmp_path.rglob("session.json")
    names = {path.name for path in session.parent.iterdir()}
    assert names >= {"CameraPose.csv", "AnchorPose.csv", "Events.csv", "script.txt", "truth.csv"}
    assert "poses.csv" not in names


def test_usage_errors_end_with_2(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, str(tmp_path / "out"), "--trap", "pitfall") == 2
    assert "no such trap: pitfall" in capsys.readouterr().err
    assert run(monkeypatch, str(tmp_path / "out"), "--minutes", "inf") == 2
    assert run(monkeypatch, str(tmp_path / "out"), *SMALL, "--climb", "lift") == 2
    assert "--floors 2 or more" in capsys.readouterr().err
    assert run(monkeypatch, str(tmp_path / "out"), *SMALL, "--scripts") == 2
    assert "--format phone" in capsys.readouterr().err
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    assert run(monkeypatch, str(tmp_path / "full"), *SMALL) == 2
    assert "is not an empty folder" in capsys.readouterr().err


SHORT = ("--floors", "1", "--devices", "1", "--sessions", "1", "--minutes", "0.5")


def access_points(survey: Path) -> set[str]:
    return {line.split("; ")[4] for path in survey.rglob("wifi.csv") for line in path.read_text().splitlines()}


def test_a_later_survey_walks_through_the_same_building(tmp_path: Path) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    assert vislam2tag("simulate", first, *SHORT, "--seed", "5").returncode == 0
    assert vislam2tag("simulate", again, *SHORT, "--seed", "5", "--later", "2022-06-01").returncode == 0
    assert [path.name for path in again.glob("floor_0/LG/*")] == ["2022-06-01T09:14:00"]
    site = ("floor_0/marker_dict.csv", "floor_dimensions.csv", "floor_0/floorplan.jpg")
    assert all((first / name).read_bytes() == (again / name).read_bytes() for name in site if (first / name).is_file())
    one, other = access_points(first), access_points(again)
    assert len(one & other) > 0.6 * len(one)
    poses = [next(folder.rglob("poses.csv")).read_bytes() for folder in (first, again)]
    assert poses[0] != poses[1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--like", "paper", "--minutes", "3"), "--minutes: has no effect with --like; remove one of the two"),
        (("--like", "paper", "--later", "2022-06-01"), "--later: has no effect with --like"),
        (("--site", "here", "--floors", "2"), "--floors: has no effect with --site; remove one of the two (choose"),
        (("--site", "here", "--landmark-count", "9"), "--landmark-count: has no effect with --site"),
    ],
)
def test_options_that_would_be_ignored_are_refused(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    assert message in the_error(vislam2tag("simulate", tmp_path / "out", *options))
    assert not (tmp_path / "out").exists()


def test_a_sites_access_points_and_survey_stay_whoever_walks(tmp_path: Path) -> None:
    site = tmp_path / "site"
    assert vislam2tag("simulate", site, *SHORT).returncode == 0
    marks = site / "floor_0" / "marker_dict.csv"
    lines = marks.read_text().splitlines()
    marks.write_text("\n".join([f"{lines[0]},z,sigma_m", *(f"{line},1.45,0.07" for line in lines[1:])]))
    outs = [tmp_path / "one", tmp_path / "two"]
    for seed, out in enumerate(outs):
        done = vislam2tag("simulate", out, *SHORT[2:], "--site", site, "--seed", str(seed))
        assert done.returncode == 0, done.stderr
    one, two = map(access_points, outs)
    assert len(one & two) > 0.6 * len(one)
    assert {path.name for path in outs[0].glob("floor_0/LG/*")}.isdisjoint(
        path.name for path in outs[1].glob("floor_0/LG/*")
    )
    head, *rows = (outs[0] / "floor_0" / "marker_dict.csv").read_text().splitlines()
    assert head == "id,x,y,z,sigma_m"
    assert all(row.endswith(",1.4500,0.0700") for row in rows)


@pytest.mark.parametrize(
    "options", [("--floors", "1"), ("--floors", "1", "--format", "phone"), ("--floors", "2", "--climb", "mixed")]
)
def test_a_survey_without_landmarks_has_none_of_their_files(tmp_path: Path, options: tuple[str, ...]) -> None:
    short = ("--devices", "1", "--sessions", "1", "--minutes", "0.5", "--landmark-count", "0")
    done = vislam2tag("simulate", tmp_path / "survey", *short, *options)
    assert done.returncode == 0, done.stderr
    assert not list((tmp_path / "survey").rglob("marker_dict.csv"))
    assert not list((tmp_path / "survey").rglob("initPoses.csv"))
    inspected = inspect_survey(tmp_path / "survey")
    assert inspected.usable
    assert all(session.landmarks_seen == () for session in inspected.sessions)
