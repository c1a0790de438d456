"""A selection changes the results of what it selects and no others: parts add up to one full run."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import OutputError
from vislam2tag.common.findings import Finding
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.settings import Settings

GROUND, FIRST = Selection(floors=(0,)), Selection(floors=(1,))
LG, ONE_PLUS = Selection(devices=("LG",)), Selection(devices=("OnePlus",))
USERS = ("notes.txt", "sessions/notes.json", "wifi/floor_0_mine.parquet", "backup/notes.txt")


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four short sessions on two floors, that no test may change."""
    return make_survey(tmp_path_factory.mktemp("selections") / "survey", floors=2, seconds=30.0)


@pytest.fixture(scope="module")
def full(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What one run of all sessions writes."""
    out = tmp_path_factory.mktemp("full") / "out"
    process(survey, out)
    return bytes_of(out)


def with_notes(out: Path) -> None:
    for name in USERS:
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_text("mine")


def without_notes(out: Path) -> dict[str, str]:
    """The files in ``out`` except the user's, which must be there and unchanged."""
    assert all((out / name).read_text() == "mine" for name in USERS)
    return {name: digest for name, digest in bytes_of(out).items() if name not in USERS}


@pytest.mark.parametrize("parts", [(GROUND, FIRST), (ONE_PLUS, LG), (Selection(), GROUND), (FIRST, Selection())])
def test_selections_add_up_to_one_full_run(
    survey: Path, full: dict[str, str], tmp_path: Path, parts: tuple[Selection, Selection]
) -> None:
    out = tmp_path / "out"
    process(survey, out, selection=parts[0])
    with_notes(out)
    summary = process(survey, out, selection=parts[1])
    assert without_notes(out) == full
    assert summary.sessions == 4


@pytest.mark.slow
def test_walks_mapped_together_add_up_too(survey: Path, tmp_path: Path) -> None:
    settings = Settings(together=True)
    process(survey, tmp_path / "full", settings)
    for selection in (GROUND, FIRST):
        process(survey, tmp_path / "parts", settings, selection=selection)
    assert bytes_of(tmp_path / "parts") == bytes_of(tmp_path / "full")


def test_other_settings_are_refused_and_change_nothing(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process(survey, out, selection=GROUND)
    before = bytes_of(out)
    other = Settings(labels=LabelSettings(max_sigma_m=0.3))
    with pytest.raises(OutputError, match=r"results of other settings \(labels\) for floor_0\..* and 1 more, which"):
        process(survey, out, other, selection=FIRST)
    with pytest.raises(OutputError, match="never mixes settings; run without --floor and --device"):
        process(survey, out, Settings(strategy="local"), selection=FIRST, replace=True)
    assert bytes_of(out) == before
    process(survey, out, other, selection=GROUND)
    process(survey, out, other, selection=FIRST)


def test_results_that_are_out_of_date_are_kept_and_named(survey: Path, tmp_path: Path) -> None:
    changed = shutil.copytree(survey, tmp_path / "survey")
    out = tmp_path / "out"
    process(changed, out)
    landmarks = changed / "floor_0" / "marker_dict.csv"
    landmarks.write_text(landmarks.read_text() + "\n", encoding="utf-8")
    points = landmarks.read_text().splitlines()
    points[1] = points[1].replace(points[1].split(",")[1], str(float(points[1].split(",")[1]) + 0.5))
    landmarks.write_text("\n".join(points) + "\n", encoding="utf-8")
    told: list[Finding] = []
    summary = process(changed, out, selection=FIRST, tell=told.extend)
    assert {finding.kind for finding in told} == {"outdated_labels"}
    assert summary.sessions == 4
    assert summary.site_findings["outdated_labels"] == len(told) > 0
    assert process(changed, out, selection=GROUND).site_findings == {}


def test_sessions_that_are_gone_go_in_a_run_without_selection_which_names_them(survey: Path, tmp_path: Path) -> None:
    changed = shutil.copytree(survey, tmp_path / "survey")
    out = tmp_path / "out"
    process(changed, out)
    with_notes(out)
    shutil.rmtree(changed / "floor_0" / "LG")
    told: list[Finding] = []
    assert process(changed, out, selection=GROUND, tell=told.extend).sessions == 3
    assert not told
    assert len(list(out.glob("sessions/floor_0.LG.*.json"))) == 1
    process(changed, out, tell=told.extend)
    assert [finding.kind for finding in told] == ["removed_labels"]
    assert "results of floor_0.LG." in told[0].message
    process(changed, tmp_path / "alone")
    assert without_notes(out) == bytes_of(tmp_path / "alone")


def test_an_excluded_session_goes_with_the_selection_that_contains_it(survey: Path, tmp_path: Path) -> None:
    changed = shutil.copytree(survey, tmp_path / "survey")
    out = tmp_path / "out"
    process(changed, out)
    (changed / "corrections.toml").write_text('[[exclude_session]]\nfloor = 0\ndevice = "LG"\nreason = "wrong way"\n')
    assert process(changed, out, selection=FIRST).sessions == 3
    assert len(list(out.glob("sessions/floor_0.LG.*.json"))) == 1
    told: list[Finding] = []
    assert process(changed, out, selection=GROUND, tell=told.extend).sessions == 3
    assert not list(out.glob("*/floor_0.LG.*"))
    assert [finding.kind for finding in told if finding.kind != "excluded_session"] == ["removed_labels"]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["evaluate", "check"])
def test_a_record_of_all_sessions_is_not_replaced_by_one_of_some(survey: Path, tmp_path: Path, command: str) -> None:
    out = tmp_path / "out"
    options = (survey, "--out", out, "--jobs", "1", *(("--strategy", "local") if command == "evaluate" else ()))
    assert vislam2tag(command, *options, "--floor", "0").returncode == 0
    before = bytes_of(out)
    error = the_error(vislam2tag(command, *options, "--floor", "1"))
    assert "would remove the results of floor_0." in error
    assert "run without --floor and --device, or choose another --out" in error
    assert bytes_of(out) == before
    assert vislam2tag(command, *options).returncode == 1  # a session on floor 1 passes too few landmarks
    record = json.loads((out / ("evaluation.json" if command == "evaluate" else "check.json")).read_text())
    assert len(record["sessions"]) == 4
