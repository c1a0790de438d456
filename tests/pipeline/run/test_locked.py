"""What the operating system does not let us read costs only itself."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from tests.locks import lock
from tests.surveys import make_survey
from vislam2tag.pipeline.labels.process import process


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey of two short sessions, each of a device of its own."""
    return make_survey(tmp_path_factory.mktemp("locked") / "survey", seconds=60.0)


def test_a_locked_session_fails_alone(survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock(monkeypatch, next(survey.glob("floor_*/LG/*")))
    summary = process(survey, tmp_path / "out")
    assert (summary.sessions, summary.failed) == (2, 1)
    (error,) = summary.failures.values()
    assert error.endswith("the folder cannot be opened; check its permissions")
    assert len(pl.read_parquet(tmp_path / "out/wifi/*.parquet")) > 0


def test_a_locked_wifi_file_costs_only_the_wifi_labels(
    survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock(monkeypatch, next(survey.glob("floor_*/LG/*")) / "wifi.csv")
    summary = process(survey, tmp_path / "out")
    assert (summary.sessions, summary.failed) == (2, 0)
    assert summary.findings["unreadable_file"] == 1
    assert 0 in [len(pl.read_parquet(path)) for path in (tmp_path / "out/wifi").glob("*.parquet")]


def test_a_locked_device_is_left_out(survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lock(monkeypatch, next(survey.glob("floor_*/LG")))
    summary = process(survey, tmp_path / "out")
    assert (summary.sessions, summary.failed) == (1, 0)
    assert "the folder cannot be opened (Permission denied)" in (tmp_path / "out/report.html").read_text(
        encoding="utf-8"
    )
