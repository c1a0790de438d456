"""Links of a survey that lead outside it: read, but left out of what leaves the machine."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.linked import annex, link_plan, move_out, private_pictures, survey_beside_private
from vislam2tag.common.errors import DatasetError, SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.datasets.figures import make_dataset_figures
from vislam2tag.pipeline.datasets.import_export import ExportOptions, export, import_format
from vislam2tag.pipeline.fleet.add import add_surveys
from vislam2tag.pipeline.labels.process import process


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A survey of two walks, with a private picture beside it."""
    return survey_beside_private(tmp_path)


def sessions_of(survey: Path) -> list[Path]:
    return sorted(path for path in (survey / "floor_0" / "LG").iterdir() if path.is_dir())


def from_outside(labels: Path) -> list[bool]:
    files = sorted((labels / "sessions").glob("*.json"))
    return [SessionResult.model_validate_json(file.read_bytes()).from_outside for file in files]


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ("process", "--out", "OUT"),
        ("check", "--out", "OUT"),
        ("diagnose", "--conflicts", "OUT.html"),
        ("site show", "--out", "OUT.html"),
        ("site show", "--out", "OUT.png"),
        ("site write", "--out", "OUT"),
        ("dataset", "--out", "OUT"),
        ("run", "--out", "OUT"),
    ],
    ids=" ".join,
)
def test_no_page_shows_a_plan_from_outside(survey: Path, tmp_path: Path, command: tuple[str, ...]) -> None:
    link_plan(survey)
    name, *options = command

    def made(out: str, *more: str) -> Path:
        given = [text.replace("OUT", str(tmp_path / out)) for text in options]
        done = vislam2tag(*name.split(), survey, *given, *more)
        assert done.returncode in (0, 1), done.stderr
        if not more:
            assert "floor_0/floorplan.png" in done.stdout + done.stderr
            assert "--follow-links" in done.stdout + done.stderr
        return Path(given[-1])

    assert private_pictures(made("out")) == []
    assert private_pictures(made("followed", "--follow-links"))


@pytest.mark.parametrize("command", [("site", "walkable"), ("plan",)], ids=" ".join)
def test_nothing_is_made_of_a_plan_from_outside(survey: Path, tmp_path: Path, command: tuple[str, ...]) -> None:
    link_plan(survey)
    done = vislam2tag(*command, survey, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--follow-links" in done.stderr
    assert not (tmp_path / "out").exists()


def test_sessions_from_outside_are_processed_and_left_out_of_data_sets(survey: Path, tmp_path: Path) -> None:
    first, _ = sessions_of(survey)
    move_out(first / "wifi.csv", tmp_path / "private" / "wifi.csv")
    labels = tmp_path / "labels"
    assert process(survey, labels).failed == 0
    assert from_outside(labels) == [True, False]
    heard: list[Finding] = []
    made = build_dataset(labels, tmp_path / "set", tell=heard.extend)
    rows = pl.read_parquet(tmp_path / "set" / "sessions.parquet")
    assert rows["name"].to_list() == [sessions_of(survey)[1].name]
    (left_out,) = [finding for finding in made.info.findings if finding.kind == "from_outside"]
    assert left_out.count == 1
    assert first.name not in (tmp_path / "set" / "dataset.json").read_text()
    assert first.name.replace(":", "") in heard[0].message
    assert "--follow-links" in heard[0].message
    build_dataset(labels, tmp_path / "whole", options=BuildOptions(follow_links=True))
    assert pl.read_parquet(tmp_path / "whole" / "sessions.parquet").height == 2


def test_a_data_set_looks_at_the_survey_that_is_given(survey: Path, tmp_path: Path) -> None:
    process(survey, tmp_path / "labels")
    move_out(sessions_of(survey)[0] / "wifi.csv", tmp_path / "wifi.csv")
    build_dataset(tmp_path / "labels", tmp_path / "set", options=BuildOptions(surveys=survey))
    assert pl.read_parquet(tmp_path / "set" / "sessions.parquet").height == 1


@pytest.mark.parametrize("linked", ["floor_0", "floor_0/LG"])
def test_a_linked_folder_is_outside_with_all_in_it(survey: Path, tmp_path: Path, linked: str) -> None:
    move_out(survey / linked, tmp_path / "elsewhere")
    process(survey, tmp_path / "labels")
    assert from_outside(tmp_path / "labels") == [True, True]


def test_a_companion_that_is_tied_from_outside_makes_its_session_one_from_outside(survey: Path, tmp_path: Path) -> None:
    first, second = sessions_of(survey)
    shutil.rmtree(second)
    shutil.copytree(first, second)
    move_out(second, tmp_path / "elsewhere")
    assert vislam2tag("attach", first, second).returncode == 0
    process(survey, tmp_path / "labels")
    assert from_outside(tmp_path / "labels") == [True]


def test_links_within_the_survey_are_inside(survey: Path, tmp_path: Path) -> None:
    (survey / "store").mkdir()
    first, second = sessions_of(survey)
    for path in (first, second / "wifi.csv"):
        target = survey / "store" / path.name
        path.rename(target)
        path.symlink_to(os.path.relpath(target, path.parent))
    (tmp_path / "typed").symlink_to(survey)
    process(tmp_path / "typed", tmp_path / "labels")
    assert from_outside(tmp_path / "labels") == [False, False]


def test_a_survey_in_git_annex_is_labelled_and_shared_when_told_to(survey: Path, tmp_path: Path) -> None:
    annex(tmp_path / "repository", survey)
    done = vislam2tag("process", survey, "--out", tmp_path / "labels")
    assert done.returncode == 0, done.stderr
    assert from_outside(tmp_path / "labels") == [True, True]
    for source in (tmp_path / "labels", survey):
        message = the_error_at_the_end(source, tmp_path / "set")
        assert "--follow-links" in message
        assert not (tmp_path / "set").exists()
    done = vislam2tag("dataset", survey, "--out", tmp_path / "set", "--follow-links")
    assert done.returncode == 0, done.stderr
    assert open_dataset(tmp_path / "set").tables["sessions"].collect().height == 2


def the_error_at_the_end(source: Path, out: Path) -> str:
    done = vislam2tag("dataset", source, "--out", out)
    assert done.returncode == 2
    return done.stderr.splitlines()[-1]


@pytest.mark.parametrize("format_name", ["tum", "gia"])
def test_exports_of_labels_leave_out_sessions_from_outside(survey: Path, tmp_path: Path, format_name: str) -> None:
    process(survey, tmp_path / "labels")
    (tmp_path / "secret").write_text("the private key")
    (sessions_of(survey)[0] / "notes.txt").symlink_to(tmp_path / "secret")
    (survey / "floor_0" / "more.txt").symlink_to(tmp_path / "secret")
    process(survey, tmp_path / "labels")
    heard: list[Finding] = []
    given = survey if format_name == "gia" else None
    record = export(tmp_path / "labels", tmp_path / "out", format_name, ExportOptions(survey=given), tell=heard.extend)
    assert sum(finding.count for finding in record.findings if finding.kind == "from_outside") == 1 + (
        given is not None
    )
    assert any("--follow-links" in finding.message for finding in heard)
    assert not any(b"private key" in path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
    export(tmp_path / "labels", tmp_path / "all", format_name, ExportOptions(survey=given, follow_links=True))
    assert len(list((tmp_path / "all").rglob("*"))) > len(list((tmp_path / "out").rglob("*")))


def test_labels_and_data_sets_with_links_outside_are_not_shared(survey: Path, tmp_path: Path) -> None:
    labels, dataset = tmp_path / "labels", tmp_path / "set"
    process(survey, labels)
    build_dataset(labels, dataset)
    for table in sorted((labels / "wifi").iterdir()):
        move_out(table, tmp_path / "moved" / table.name)
    with pytest.raises(DatasetError, match="--follow-links"):
        build_dataset(labels, tmp_path / "again")
    move_out(dataset / "fingerprints.parquet", tmp_path / "moved" / "fingerprints.parquet")
    open_dataset(dataset)
    with pytest.raises(DatasetError, match=r"fingerprints\.parquet.*--follow-links"):
        export(dataset, tmp_path / "out", "parquet")
    with pytest.raises(DatasetError, match="--follow-links"):
        make_dataset_figures(dataset, tmp_path / "figures")
    export(dataset, tmp_path / "out", "parquet", ExportOptions(follow_links=True))


def test_an_import_refuses_links_outside_the_folder(survey: Path, tmp_path: Path) -> None:
    process(survey, tmp_path / "labels")
    export(tmp_path / "labels", tmp_path / "gia", "gia", ExportOptions(survey=survey))
    link_plan(tmp_path / "gia")
    with pytest.raises(DatasetError, match="--follow-links"):
        import_format(tmp_path / "gia", tmp_path / "set")


def test_a_fleet_gets_no_files_from_outside(survey: Path, tmp_path: Path) -> None:
    link_plan(survey)
    first, second = sessions_of(survey)
    move_out(first / "wifi.csv", tmp_path / "wifi.csv")
    heard: list[Finding] = []
    add_surveys(tmp_path / "fleet", survey, tell=heard.extend)
    copied = tmp_path / "fleet" / "surveys" / "survey"
    assert private_pictures(copied) == []
    assert sessions_of(copied) == [copied / second.relative_to(survey)]
    assert "floor_0/floorplan.png" in heard[0].message
    add_surveys(tmp_path / "all", survey, follow_links=True)
    assert private_pictures(tmp_path / "all")
    move_out(second, tmp_path / "elsewhere")
    with pytest.raises(SurveyError, match="--follow-links"):
        add_surveys(tmp_path / "none", survey)


def test_links_to_special_files_end_no_command(survey: Path, tmp_path: Path) -> None:
    first, _ = sessions_of(survey)
    for name, target in {"a": "/dev/zero", "b": "/proc/self/environ", "c": "loop", "loop": "c"}.items():
        (first / name).symlink_to(target)
        (survey / "floor_0" / name).symlink_to(target)
    assert process(survey, tmp_path / "labels").failed == 0
    export(tmp_path / "labels", tmp_path / "out", "gia", ExportOptions(survey=survey))
    names = {path.name for path in (tmp_path / "out").rglob("*")}
    assert names.isdisjoint(("a", "b", "c", "loop"))
    record = json.loads((tmp_path / "out" / "export.json").read_text())
    assert sum(one["count"] for one in record["findings"] if one["kind"] == "from_outside") == 2


def test_the_cure_is_named_in_one_line(survey: Path, tmp_path: Path) -> None:
    process(survey, tmp_path / "labels")
    move_out(tmp_path / "labels" / "run.json", tmp_path / "run.json")
    assert "--follow-links" in the_error(vislam2tag("dataset", tmp_path / "labels", "--out", tmp_path / "set"))
