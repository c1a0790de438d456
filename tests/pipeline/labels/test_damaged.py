"""Whatever happens to its files, a survey gives tables of the same shape, an account of every line, and no crash."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.mutations import exaggerate, mutate
from tests.pipeline.labels.test_process_tables import RAW, SCHEMAS, results
from tests.sessions.raw import count_lines
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.process import process

some_or_many = pytest.mark.parametrize("rounds", [5, pytest.param(100, marks=pytest.mark.campaign)])
FILES = ("poses.csv", "initPoses.csv", "wifi.csv", "sensors.csv")
UNREADABLE = ("malformed_lines", "partial_last_line", "rounded_times")


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("damage") / "survey", seconds=60.0, severity="mild")


@pytest.fixture(scope="module")
def whole(survey: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    out = tmp_path_factory.mktemp("whole") / "out"
    process(survey, out)
    return bytes_of(out)


@pytest.fixture
def damaged(survey: Path, tmp_path: Path) -> Path:
    """A copy whose session of the LG is to be damaged."""
    return shutil.copytree(survey, tmp_path / "survey")


def check_account(result: SessionResult, folder: Path, out: Path) -> None:
    """Every line of every file is a row or counted as unreadable; every row is in the table."""
    rows = {file.role: file.rows for file in result.files}
    for file in result.files:
        counted = sum(f.count for f in result.findings if f.file == file.name and f.kind in UNREADABLE)
        assert file.lines == count_lines((folder / file.name).read_bytes()) == file.rows + counted
    for table, schema in SCHEMAS.items():
        read = pl.read_parquet(out / table / f"{result.slug}.parquet")
        assert dict(read.schema) == schema
        assert len(read) == rows[RAW[table]]


@pytest.mark.slow
@some_or_many
@pytest.mark.parametrize("damage", [mutate, exaggerate])
def test_damaged_files_are_findings_of_their_session_alone(
    damage: Callable[[bytes, np.random.Generator], bytes],
    damaged: Path,
    whole: dict[str, str],
    tmp_path: Path,
    rounds: int,
) -> None:
    rng = np.random.default_rng(2)
    session = next(damaged.glob("floor_*/LG/*"))
    clean = {name: (session / name).read_bytes() for name in FILES}
    for number in range(rounds):
        hurt = rng.choice(FILES, size=rng.integers(1, 3), replace=False)
        for name in FILES:
            (session / name).write_bytes(damage(clean[name], rng) if name in hurt else clean[name])
        raw = bytes_of(damaged)
        out = tmp_path / f"out{number}"
        process(damaged, out)
        assert bytes_of(damaged) == raw
        for result in results(out):
            assert "unexpected" not in (result.error or ""), (number, result.error)
            check_account(result, damaged / f"floor_{result.floor}" / result.device / result.session, out)
        here = bytes_of(out)
        assert here.keys() == whole.keys()
        assert [name for name in here if "OnePlus" in name and here[name] != whole[name]] == []
        shutil.rmtree(out)


@pytest.mark.slow
@some_or_many
@pytest.mark.parametrize("name", ["floor_dimensions.csv", "floor_0/marker_dict.csv", "corrections.toml"])
def test_damaged_site_files_are_findings_or_our_errors(damaged: Path, tmp_path: Path, name: str, rounds: int) -> None:
    rng = np.random.default_rng(3)
    path = damaged / name
    corrections = b'[[exclude_landmark]]\nid = "2"\n\n[[shift_clock]]\ntable = "wifi"\noffset_s = -0.25\n'
    clean = path.read_bytes() if path.exists() else corrections
    done = 0
    for number in range(rounds):
        path.write_bytes(mutate(clean, rng))
        try:
            summary = process(damaged, tmp_path / "out")
        except Vislam2tagError:
            assert name == "corrections.toml"
            continue
        done += 1
        assert not any("unexpected" in error for error in summary.failures.values()), (number, summary.failures)
        for result in results(tmp_path / "out"):
            check_account(result, damaged / f"floor_{result.floor}" / result.device / result.session, tmp_path / "out")
    assert done > 0
