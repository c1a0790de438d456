"""Commands that label whole surveys: ``process``, ``run`` and ``demo``."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

import vislam2tag as package
from tests.cli.command import the_error, vislam2tag
from tests.surveys import bytes_of, make_survey
from vislam2tag.cli.exit_codes import ExitCode
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.settings import Settings


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sessions with a perfect tracker; only read."""
    return make_survey(tmp_path_factory.mktemp("cli") / "survey", seconds=60.0)


def test_version_and_help_with_examples() -> None:
    version = vislam2tag("--version")
    assert (version.returncode, version.stderr) == (0, "")
    assert re.fullmatch(rf"{re.escape(package.__version__)}( \(commit [0-9a-f]{{10,}}(-dirty)?\))?\n", version.stdout)
    overview = vislam2tag("--help")
    assert overview.returncode == 0
    for name in ("process", "inspect", "simulate", "demo"):
        assert name in overview.stdout
    assert "vislam2tag process survey --out labels" in vislam2tag("process", "--help").stdout


def test_all_right_is_0_with_a_summary_on_standard_output_alone(survey: Path, tmp_path: Path) -> None:
    done = vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("2 sessions (0 failed), ")
    assert f"report: {tmp_path / 'out' / 'report.html'}\n" in done.stdout
    other = ("process", survey, "--out", tmp_path / "out", "--jobs", "1", "--strategy", "local")
    assert "use --replace to replace them by labels of local" in the_error(vislam2tag(*other))
    assert vislam2tag(*other, "--replace").returncode == 0


@pytest.mark.skipif(os.cpu_count() == 1, reason="Polars has one thread anyhow")
@pytest.mark.parametrize("jobs", [1, 2])
def test_each_of_several_processes_calculates_in_one_thread(tmp_path: Path, jobs: int) -> None:
    code = (
        "import atexit\n"
        "atexit.register(lambda: print(__import__('polars').thread_pool_size()))\n"
        "from vislam2tag.cli.app import main\n"
        "main()\n"
    )
    command = ["process", str(tmp_path), "--out", str(tmp_path / "out"), "--jobs", str(jobs)]
    environment = {name: value for name, value in os.environ.items() if name != "POLARS_MAX_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", code, *command], check=False, capture_output=True, text=True, env=environment
    )
    assert (int(done.stdout) == 1) is (jobs == 2), done.stderr


def test_a_file_of_settings_is_resolved_beside_the_labels(survey: Path, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("strategy = 'local'\n[labels]\nmax_sigma_m = 0.3\nmax_gap_s = 2.0\n[plan]\nspacing_m = 9.0\n")
    arguments = ("process", survey, "--out", tmp_path / "out", "--jobs", "1", "--config", file)
    assert vislam2tag(*arguments, "--max-sigma-m", "0.4").returncode == 0
    told = json.loads((tmp_path / "out" / "run.json").read_bytes())["settings"]
    assert told == Settings(strategy="local", labels=LabelSettings(max_sigma_m=0.4, max_gap_s=2.0)).of_labels()
    file.write_text("[labels]\nmax_sigma = 0.3\n")
    assert the_error(vislam2tag(*arguments)) == (
        f"error: --config {file}: labels.max_sigma: no such setting; the closest name is labels.max_sigma_m "
        "(`vislam2tag docs reference/settings` lists all)"
    )


def test_a_session_that_cannot_be_mapped_is_1_with_one_line(survey: Path, tmp_path: Path) -> None:
    spoilt = shutil.copytree(survey, tmp_path / "survey")
    next(spoilt.glob("floor_0/LG/*/poses.csv")).unlink()
    done = vislam2tag("process", spoilt, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 1
    assert done.stderr.startswith("failed floor 0 / LG / ")
    assert done.stderr.count("\n") == 1
    assert done.stdout.startswith("2 sessions (1 failed), ")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--strategy", "globe"), "there is no mapping strategy 'globe'; available are: dead-reckoning, floor-plan, "),
        (("--floor", "7"), "--floor 7: the survey has no session with this floor; it has: 0"),
        (("--device", "Nokia"), "--device Nokia: the survey has no session with this device; it has: LG, OnePlus"),
        (("--landmarks", "gone.csv"), "cannot be opened (No such file or directory); expected a landmark file"),
        (("--jobs", "0"), "--jobs"),
        (("--max-gap-s", "nan"), "--max-gap-s"),
        (("--max-sigma-m", "nan"), "--max-sigma-m"),
        (("--max-sigma-m", "0"), "--max-sigma-m"),
        (("--label-rule", "nearest"), "--label-rule"),
        (("--lout",), "--lout"),
    ],
)
def test_impossible_options_are_2_and_named(
    survey: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    done = vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1", *options)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def no_survey(folder: Path) -> dict[str, tuple[Path, str]]:
    (folder / "file").write_text("floor_1")
    (folder / "empty").mkdir()
    (folder / "floors" / "floor_1").mkdir(parents=True)
    return {
        "missing": (folder / "gone", "gone: no such folder; expected a survey folder"),
        "file": (folder / "file", "file: this is not a folder; expected a survey folder"),
        "empty": (folder / "empty", "empty: this is not a survey: it contains no folder named floor_0"),
        "floors only": (
            folder / "floors",
            "floors: this is not a survey: it contains no session (a folder floor_K/DEVICE/SESSION",
        ),
    }


@pytest.mark.parametrize("command", ["process", "inspect"])
@pytest.mark.parametrize("name", ["missing", "file", "empty", "floors only"])
def test_what_is_no_survey_is_2(tmp_path: Path, command: str, name: str) -> None:
    place, message = no_survey(tmp_path)[name]
    before = bytes_of(tmp_path)
    options = ["--out", str(tmp_path / "out")] if command == "process" else []
    assert message in the_error(vislam2tag(command, place, *options))
    assert bytes_of(tmp_path) == before
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[exclude_session]\n", "corrections.toml: the file is not valid TOML: "),
        ('[[exclude_session]]\ndevise = "LG"\n', "corrections.toml: [[exclude_session]] number 1, devise: "),
    ],
)
def test_broken_corrections_are_2_and_name_the_entry(survey: Path, tmp_path: Path, text: str, message: str) -> None:
    spoilt = shutil.copytree(survey, tmp_path / "survey")
    (spoilt / "corrections.toml").write_text(text)
    assert message in the_error(vislam2tag("process", spoilt, "--out", tmp_path / "out", "--jobs", "1"))
    assert not (tmp_path / "out").exists()


def test_what_makes_readings_useless_and_unknown_landmarks_are_told(survey: Path, tmp_path: Path) -> None:
    spoilt = shutil.copytree(survey, tmp_path / "survey")
    (spoilt / "corrections.toml").write_text('[[exclude_landmark]]\nid = "no such"\n')
    for path in spoilt.glob("floor_*/*/*/*"):
        if path.name.lower() == "wifi.csv":
            path.write_text(re.sub(r"(;\s*)[0-9a-f:]{17}(\s*;)", r"\g<1>02:00:00:00:00:00\2", path.read_text()))
    done = vislam2tag("process", spoilt, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 1
    assert "[[exclude_landmark]] number 1 has no effect" in done.stderr
    assert "warning: masked_addresses" in done.stdout
    assert "Grant the recording app the location permission" in done.stdout
    assert "next: vislam2tag inspect" in done.stdout


@pytest.mark.parametrize("command", ["process", "run"])
def test_readings_on_another_clock_are_the_last_word(survey: Path, tmp_path: Path, command: str) -> None:
    spoilt = shutil.copytree(survey, tmp_path / "survey")
    rows = 0
    for path in spoilt.glob("floor_*/*/*/wifi.csv"):
        cells = [line.split(";") for line in path.read_text().splitlines()]
        shifted = [";".join([scan, f"{int(time) + 10**13}", *rest]) for scan, time, *rest in cells]
        path.write_text("\n".join(shifted) + "\n")
        rows += len(cells)
    done = vislam2tag(command, spoilt, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 0  # the frames are labelled
    lines = done.stdout.splitlines()
    assert [line for line in lines if "wifi.csv: the times begin" in line and "another clock" in line]
    last = lines.index(f"warning: none of {rows} rows of wifi is labelled: see the warnings above")
    assert not any("nothing is wrong" in line for line in lines[last:])
    assert lines[-1].startswith("next: vislam2tag inspect")


def test_places_that_are_not_ours_are_2_and_untouched(survey: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_text("mine")
    mine, raw = bytes_of(tmp_path), bytes_of(survey)
    for place, message in (
        (tmp_path / "file", "file: cannot be used as the output folder (a file, not a folder); choose another --out"),
        (tmp_path / "thesis", "thesis: the folder is not empty and vislam2tag did not create it "),
        (survey, "survey: the folder is not empty and vislam2tag did not create it "),
        (survey / "floor_0" / "labels", "labels: this folder is among the survey's sessions"),
    ):
        assert message in the_error(vislam2tag("process", survey, "--out", place))
    assert bytes_of(tmp_path) == mine
    assert bytes_of(survey) == raw


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_place_that_cannot_be_written_is_2(survey: Path, tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    done = vislam2tag("process", survey, "--out", tmp_path / "locked" / "out")
    assert "cannot be used as the output folder (Permission denied); choose another --out" in the_error(done)


def test_two_runs_at_once_into_one_folder_may_be_tried_later(survey: Path, tmp_path: Path) -> None:
    with claim(tmp_path / "out", {}):
        error = the_error(vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1"), ExitCode.RETRY)
    assert "another run is writing to this folder; wait for it or choose another --out" in error
    assert vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1").returncode == 0


@pytest.mark.parametrize("limit", ["0.3", "inf"])
def test_the_limit_of_uncertainty_is_recorded_as_json(survey: Path, tmp_path: Path, limit: str) -> None:
    assert (
        vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1", "--max-sigma-m", limit).returncode == 0
    )
    for path in ("run.json", "summary.json"):
        json.loads((tmp_path / "out" / path).read_text(), parse_constant=pytest.fail)
    run = json.loads((tmp_path / "out/run.json").read_text())
    assert Settings.model_validate(run["settings"]).labels.max_sigma_m == float(limit)


def test_completed_landmarks_replace_those_of_the_floors_and_are_recorded(survey: Path, tmp_path: Path) -> None:
    file = tmp_path / "completed.csv"
    rows = (survey / "floor_0/marker_dict.csv").read_text().splitlines()
    file.write_text("\n".join([f"{rows[0]},floor", *(f"{row},0" for row in rows[1:])]) + "\n")
    (bare := shutil.copytree(survey, tmp_path / "survey") / "floor_0/marker_dict.csv").write_text("id,x,y\n")
    plain = vislam2tag("process", survey, "--out", tmp_path / "plain", "--jobs", "1")
    done = vislam2tag("process", bare.parents[1], "--out", tmp_path / "out", "--jobs", "1", "--landmarks", file)
    assert (done.returncode, done.stdout.splitlines()[:3]) == (0, plain.stdout.splitlines()[:3])
    run = json.loads((tmp_path / "out/run.json").read_text())
    assert run["landmark_file"] == {"name": "completed.csv", "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    assert json.loads((tmp_path / "plain/run.json").read_text())["landmark_file"] is None
    again = vislam2tag("process", bare.parents[1], "--out", tmp_path / "out", "--jobs", "1")
    assert again.returncode == 3
    assert "of the walk has no position, because" in (tmp_path / "out/report.html").read_text()


def test_what_is_uncertain_is_counted_and_keeps_its_position(survey: Path, tmp_path: Path) -> None:
    options = ["--strategy", "smoother", "--max-sigma-m", "0.001"]
    done = vislam2tag("process", survey, "--out", tmp_path / "out", "--jobs", "1", *options)
    assert (done.returncode, done.stderr) == (0, "")
    frames = pl.read_parquet(tmp_path / "out/trajectory/*.parquet")
    uncertain = frames.filter(pl.col("status") == "uncertain")
    assert len(uncertain) > 0.9 * len(frames)
    assert uncertain["x"].null_count() == uncertain["sigma"].null_count() == 0
    assert f"frames labelled: 0.0 % ({len(uncertain)} uncertain)" in done.stdout
    assert "an uncertain one" in (tmp_path / "out/report.html").read_text()


def test_a_survey_becomes_a_data_set_and_what_is_unchanged_is_kept(tmp_path: Path) -> None:
    survey, out = make_survey(tmp_path / "campus"), tmp_path / "out"
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "2 sessions (0 failed); frames labelled: " in done.stdout
    assert "floor 0: expected mean error 0." in done.stdout
    assert "kept" not in done.stdout
    assert done.stdout.splitlines()[-2:] == [
        f"page: {out / 'index.html'}",
        f"next: vislam2tag train {out / 'dataset'} --out building.v2t",
    ]
    assert open_dataset(out / "dataset").info.name == "campus"
    links = re.findall(r'href="([^"]+\.html)"', (out / "index.html").read_text())
    assert links == ["labels/report.html", "conflicts.html", "check/check.html", "dataset/report.html"]
    assert all((out / link).is_file() for link in links)
    before = bytes_of(out)
    made = (out / "dataset" / "dataset.json").stat().st_mtime_ns, (out / "check" / "check.json").stat().st_mtime_ns
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: diagnosis, check, dataset" in done.stdout
    assert bytes_of(out) == before
    assert made == (
        (out / "dataset" / "dataset.json").stat().st_mtime_ns,
        (out / "check" / "check.json").stat().st_mtime_ns,
    )
    (out / "check" / "check.html").unlink()
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: diagnosis, dataset" in done.stdout
    assert bytes_of(out) == before
    (out / "diagnosis.json").write_text('{"faults": ""}')
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: check, dataset" in done.stdout
    assert bytes_of(out) == before
    (survey / "corrections.toml").write_text('[[exclude_session]]\ndevice = "LG"\nreason = "dropped"\n')
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert done.returncode == 0
    assert "kept" not in done.stdout
    assert len(open_dataset(out / "dataset").info.sources) == 1
    assert "Changes since the last run" in (out / "index.html").read_text()
    assert "1 session (0 failed); frames labelled: " in done.stdout


@pytest.mark.parametrize("own", [True, False])
def test_what_is_wrong_is_told_first(tmp_path: Path, own: bool) -> None:
    """Of the floors' own landmark files, and of one that is given in their place."""
    survey = make_survey(tmp_path / "campus", seconds=100.0)
    marks = survey / "floor_0" / "marker_dict.csv"
    head, *rows = marks.read_text().splitlines()
    feet = [",".join([name, *(f"{float(cell) / 0.3048:.4f}" for cell in cells)]) for name, *cells in csv.reader(rows)]
    given = tmp_path / "feet.csv"
    given.write_text("\n".join([f"{head},floor", *(f"{row},0" for row in feet)]) + "\n")
    if own:
        marks.write_text("\n".join([head, *feet]) + "\n")
    words = () if own else ("--landmarks", given)
    done = vislam2tag("run", survey, "--out", tmp_path / "out", "--jobs", "1", *words)
    faults = [line for line in done.stdout.splitlines() if line.startswith("wrong: ")]
    assert faults
    assert f"next: vislam2tag diagnose {survey} --apply" in done.stdout
    assert "Correct a fault" in (tmp_path / "out" / "index.html").read_text()
