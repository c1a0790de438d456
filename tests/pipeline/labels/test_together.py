"""Walks of a floor that tell one another where landmarks hang."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.surveys import make_survey
from vislam2tag.common.errors import UsageError
from vislam2tag.diagnosis.references import References
from vislam2tag.labeling.results import Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.session import Outcome
from vislam2tag.pipeline.labels.together import rounded_covariance
from vislam2tag.pipeline.run.store import claim
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate

SURVEYED = ("2", "5", "8")
TOGETHER = ProcessSettings(together=True)


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four walks on a floor of which three landmarks are surveyed."""
    root = make_survey(tmp_path_factory.mktemp("together") / "survey", sessions=2, seconds=120.0, severity="default")
    path = root / "floor_0/marker_dict.csv"
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


def test_what_is_told_can_be_mapped_with_where_landmarks_share_nearly_all_of_their_error() -> None:
    shared_m2, own_m2, heading_rad2 = 0.35**2, 1e-6, 2e-5
    covariance = np.zeros((60, 60))
    covariance[:40, :40] = np.kron(np.full((20, 20), shared_m2), np.eye(2)) + own_m2 * np.eye(40)
    covariance[40:, 40:] = heading_rad2 * np.eye(20)
    rounded = rounded_covariance(covariance)
    np.linalg.cholesky(rounded)
    np.testing.assert_allclose(rounded, covariance, atol=1e-4)
    np.testing.assert_array_equal(rounded_covariance(covariance + 1e-13), rounded)


def test_the_order_and_number_of_processes_do_not_matter(
    survey: Path, together: tuple[Path, Summary], tmp_path: Path
) -> None:
    process(survey, tmp_path / "out", TOGETHER, jobs=2)
    for path in sorted((together[0] / "trajectory").glob("*.parquet")):
        assert path.read_bytes() == (tmp_path / "out/trajectory" / path.name).read_bytes()


def test_the_run_says_that_walks_were_mapped_together(together: tuple[Path, Summary]) -> None:
    assert json.loads((together[0] / "run.json").read_text())["settings"]["together"] is True


def test_other_strategies_map_alone(survey: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="leave --together or --strategy out"):
        process(survey, tmp_path / "out", TOGETHER.model_copy(update={"strategy": "local"}))
    assert not (tmp_path / "out").exists()


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
