"""Runs: selection, resuming, determinism, bad sessions, raw data untouched."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import polars as pl
import pytest

from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError, SessionError, SurveyError, UsageError
from vislam2tag.labeling.results import Summary
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.labeling.tables import OPTIONAL, SCHEMAS
from vislam2tag.pipeline.labels import session
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.settings import Settings
from vislam2tag.site.frame_change import CHANGE_FILE
from vislam2tag.site.model import SessionRef


class Recorder:
    """Collects the outcomes that a run reports."""

    def __init__(self) -> None:
        self.outcomes: list[Outcome] = []

    def __call__(self, outcome: Outcome, total: int) -> None:
        assert total > 0
        self.outcomes.append(outcome)

    @property
    def repeated(self) -> set[str]:
        return {outcome.slug for outcome in self.outcomes if outcome.repeated}


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A survey of two short sessions that a test may spoil."""
    return make_survey(tmp_path / "survey", seconds=60.0)


def session_folders(survey: Path) -> list[Path]:
    return sorted(path.parent for path in survey.glob("floor_*/*/*/poses.csv"))


def test_a_clean_survey_has_no_findings(clean_run: Path) -> None:
    summary = Summary.model_validate_json((clean_run / "summary.json").read_bytes())
    assert summary.findings == {}
    assert (summary.sessions, summary.failed) == (4, 0)


def test_parallel_and_serial_runs_write_the_same_bytes(clean_survey: Path, clean_run: Path, tmp_path: Path) -> None:
    before = bytes_of(clean_survey)
    process(clean_survey, tmp_path / "out", jobs=2)
    assert bytes_of(tmp_path / "out") == bytes_of(clean_run)
    assert bytes_of(clean_survey) == before


def test_what_is_done_and_unchanged_is_not_repeated(survey: Path, tmp_path: Path) -> None:
    first, again, changed, other = Recorder(), Recorder(), Recorder(), Recorder()
    process(survey, tmp_path / "out", progress=first)
    done = bytes_of(tmp_path / "out")
    process(survey, tmp_path / "out", progress=again)
    assert (len(first.repeated), len(again.repeated)) == (2, 0)
    assert bytes_of(tmp_path / "out") == done
    wifi = session_folders(survey)[0] / "wifi.csv"
    wifi.write_bytes(b"".join(wifi.read_bytes().splitlines(keepends=True)[:-1]))
    process(survey, tmp_path / "out", progress=changed)
    assert len(changed.repeated) == 1
    process(survey, tmp_path / "out", Settings(strategy="local"), replace=True, progress=other)
    assert len(other.repeated) == 2


def test_labels_of_another_strategy_are_replaced_only_when_told(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process(survey, out, Settings(strategy="local"))
    before = bytes_of(out)
    with pytest.raises(OutputError, match=r"out: .* labels of the strategy local; use --replace .* of smoother"):
        process(survey, out)
    assert bytes_of(out) == before
    process(survey, out, Settings(strategy="local", labels=LabelSettings(max_sigma_m=0.5)))
    (out / CHANGE_FILE).write_text("")
    run = json.loads((out / "run.json").read_bytes())
    (out / "run.json").write_text(json.dumps(run | {"rebase": [{"floor": 0}]}))
    with pytest.raises(OutputError, match="contains labels from `vislam2tag site rebase`; use --replace"):
        process(survey, out, Settings(strategy="local"))
    process(survey, out, replace=True)
    process(survey, tmp_path / "fresh")
    assert bytes_of(out) == bytes_of(tmp_path / "fresh")
    (out / "run.json").write_text(json.dumps({"program": "vislam2tag evaluate"}))
    with pytest.raises(OutputError, match="contains the output of `vislam2tag evaluate`; pass --replace"):
        process(survey, out)
    process(survey, out, replace=True)
    assert bytes_of(out) == bytes_of(tmp_path / "fresh")


def test_a_changed_source_makes_all_sessions_again(
    survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process(survey, tmp_path / "out")
    monkeypatch.setattr(session, "code_key", lambda *modules: "+".join(modules))
    again = Recorder()
    process(survey, tmp_path / "out", progress=again)
    assert len(again.repeated) == 2


def test_a_session_whose_files_cannot_be_hashed_is_repeated(
    survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(ref: SessionRef) -> dict[str, str]:
        raise SessionError(f"{ref.folder}: cannot be read: Input/output error")

    process(survey, tmp_path / "out")
    monkeypatch.setattr(session, "hash_inputs", refuse)
    again = Recorder()
    process(survey, tmp_path / "out", progress=again)
    assert len(again.repeated) == 2


def test_a_lost_table_is_made_again(survey: Path, tmp_path: Path) -> None:
    process(survey, tmp_path / "out")
    done = bytes_of(tmp_path / "out")
    next((tmp_path / "out/wifi").glob("*.parquet")).unlink()
    recorder = Recorder()
    process(survey, tmp_path / "out", progress=recorder)
    assert len(recorder.repeated) == 1
    assert bytes_of(tmp_path / "out") == done


def test_adding_a_session_does_not_change_the_others(survey: Path, tmp_path: Path) -> None:
    late = session_folders(survey)[1]
    shutil.move(late, tmp_path / "late")
    process(survey, tmp_path / "out")
    alone = bytes_of(tmp_path / "out")
    shutil.move(tmp_path / "late", late)
    process(survey, tmp_path / "out")
    both = bytes_of(tmp_path / "out")
    assert {name: both[name] for name in alone if "/" in name} == {n: h for n, h in alone.items() if "/" in n}
    assert len(both) == len(alone) + 4


def test_a_selection_of_nothing_is_refused(clean_survey: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"--floor 7: .* it has: 0, 1"):
        process(clean_survey, tmp_path / "out", selection=Selection(floors=(7,)))


def test_a_session_without_poses_fails_alone(survey: Path, tmp_path: Path) -> None:
    bad = session_folders(survey)[0]
    (bad / "poses.csv").unlink()
    summary = process(survey, tmp_path / "out")
    assert (summary.sessions, summary.failed) == (2, 1)
    assert summary.findings["missing_file"] == 1
    tables = {path.stem: pl.read_parquet(path) for path in (tmp_path / "out/wifi").glob("*.parquet")}
    statuses = {name: set(table["status"]) for name, table in tables.items()}
    assert any(found == {"outside_frames"} for found in statuses.values())
    assert any("ok" in found for found in statuses.values())
    assert len(pl.read_parquet(tmp_path / "out/trajectory/*.parquet")) > 0


def test_empty_files_still_give_tables_with_zero_rows(survey: Path, tmp_path: Path) -> None:
    for name in ("wifi.csv", "sensors.csv"):
        (session_folders(survey)[0] / name).write_bytes(b"")
    summary = process(survey, tmp_path / "out")
    assert summary.failed == 0
    assert summary.findings["empty_file"] == 2
    assert 0 in [len(pl.read_parquet(path)) for path in (tmp_path / "out/wifi").glob("*.parquet")]
    assert len(pl.read_parquet(tmp_path / "out/wifi/*.parquet")) > 0


def test_corrections_are_used_and_reported(survey: Path, tmp_path: Path) -> None:
    bad, good = session_folders(survey)
    (survey / "corrections.toml").write_text(
        f'[[exclude_session]]\nsession = "{bad.name}"\ndevice = "{bad.parent.name}"\nreason = "wrong floor"\n'
        '[[shift_clock]]\ntable = "sensors"\noffset_s = 3600.0\n'
    )
    summary = process(survey, tmp_path / "out")
    assert summary.sessions == 1
    result = json.loads(next((tmp_path / "out/sessions").iterdir()).read_text())
    assert result["session"] == good.name
    assert "shifted by +3600 s" in result["corrections"][0]
    assert result["readings"]["sensors"].keys() == {"outside_frames"}
    assert "wrong floor" in (tmp_path / "out/report.html").read_text()


def test_what_is_no_survey_or_no_place_to_write(survey: Path, tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="not a survey"):
        process(tmp_path, tmp_path / "out")
    with pytest.raises(OutputError, match="vislam2tag did not create it"):
        process(survey, survey)
    with pytest.raises(OutputError, match="among the survey's sessions"):
        process(survey, survey / "floor_0" / "labels")
    assert not (survey / "floor_0" / "labels").exists()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("rule", LabelRule)
def test_excluded_spans_are_invalid(survey: Path, tmp_path: Path, rule: LabelRule) -> None:
    spans = "[[exclude_span]]\nfrom_s = 8.0\nto_s = 12.0\n[[exclude_span]]\nfrom_s = 20.0\nto_s = 20.5\n"
    (survey / "corrections.toml").write_text(spans)
    process(survey, tmp_path / "out", Settings(labels=LabelSettings(rule=rule)))
    frames = pl.read_parquet(next((tmp_path / "out/trajectory").iterdir()))
    sensors = pl.read_parquet(next((tmp_path / "out/sensors").iterdir()))
    start = frames["time_ns"][0]
    inside = frames.filter((pl.col("time_ns") - start).is_between(8_000_000_000, 11_990_000_000))
    assert set(inside["status"]) == {"invalid"}
    elapsed = pl.col("time_ns") - start
    for first, last in ((8_000_000_000, 11_999_999_999), (20_000_000_000, 20_499_999_999)):
        within = sensors.filter(elapsed.is_between(first, last))
        assert set(within["status"]) == {"invalid"}
        assert within["x"].is_null().all()


def test_a_session_that_becomes_unreadable_keeps_no_old_labels(
    survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process(survey, tmp_path / "out")

    def refuse(*_: object) -> None:
        raise SessionError("the disk is broken")

    monkeypatch.setattr("vislam2tag.sessions.prepared.read_session", refuse)
    monkeypatch.setattr("vislam2tag.pipeline.labels.session.hash_inputs", refuse)
    summary = process(survey, tmp_path / "out")
    assert summary.failed == 2
    for table, schema in ((name, SCHEMAS[name]) for name in SCHEMAS.keys() - OPTIONAL):
        rows = pl.read_parquet(tmp_path / "out" / table / "*.parquet")
        assert len(rows) == 0
        assert list(rows.schema.items()) == list(schema.items())
        assert len(list((tmp_path / "out" / table).iterdir())) == 2


def test_what_is_wrong_with_the_site_is_in_the_summary_and_its_files_are_hashed(survey: Path, tmp_path: Path) -> None:
    (survey / "floor_0/floorplan.jpg").unlink()
    process(survey, tmp_path / "out")
    summary = Summary.model_validate_json((tmp_path / "out/summary.json").read_bytes())
    assert summary.site_findings == {"missing_plan": 1}
    run = json.loads((tmp_path / "out/run.json").read_text())
    assert set(run["site_files"]) == {"floor_dimensions.csv", "floor_0/marker_dict.csv"}


def test_a_hole_in_the_frames_is_time_lost(survey: Path, tmp_path: Path) -> None:
    for folder in session_folders(survey):
        lines = (folder / "poses.csv").read_bytes().splitlines(keepends=True)
        (folder / "poses.csv").write_bytes(b"".join(lines[:900] + lines[1020:]))
    summary = process(survey, tmp_path / "out")
    assert summary.frame_seconds["gap"] == pytest.approx(8.0, abs=4.1)
    assert sum(summary.frame_seconds.values()) == pytest.approx(summary.duration_s, abs=0.01)


def test_ble_is_labelled_where_it_is_logged_and_gone_where_it_is_not_any_more(survey: Path, tmp_path: Path) -> None:
    session = next(survey.glob("floor_0/*/*"))
    poses = (session / "poses.csv").read_text().splitlines()
    times = [line.split(";")[0] for line in poses[10:-10:20]]
    (session / "ble.csv").write_text("".join(f"{time}; c2:ca:b5:46:df:bb; desk; -70\n" for time in times))
    summary = process(survey, tmp_path / "out")
    assert sum(summary.readings["ble"].values()) == len(times)
    (table,) = (tmp_path / "out" / "ble").iterdir()
    rows = pl.read_parquet(table)
    assert list(rows.schema.items()) == list(SCHEMAS["ble"].items())
    trajectory = pl.read_parquet(tmp_path / "out" / "trajectory" / table.name)
    for row in rows.filter(pl.col("status") == "ok").iter_rows(named=True):
        frame = trajectory.filter(pl.col("time_ns") == row["time_ns"]).row(0, named=True)
        assert (row["x"], row["y"]) == (frame["x"], frame["y"])
    (session / "ble.csv").unlink()
    assert "ble" not in process(survey, tmp_path / "out").readings
    assert list((tmp_path / "out" / "ble").iterdir()) == []
