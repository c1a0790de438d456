"""Generated surveys with one fault each: no label is both `ok` and wrong without a finding that names the fault."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.intake.faults import FAULTS, change_poses
from tests.surveys import make_survey
from vislam2tag.common.findings import Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.inspection import inspect_survey

SIGMAS, MARGIN_M = 5.0, 0.5
NAMES = sorted(FAULTS)
SEVERITIES = ("none", "default", "severe")
KINDS = {
    *("pose_convention", "implausible_poses", "far_landmarks", "time_unit", "contradicting_fixes"),
    *("lost_sign", "absurd_levels", "masked_addresses"),
    *("other_ids", "shifted_ids", "perhaps_planned", "planned_landmarks"),
}


def survey_of(folder: Path, seed: int) -> Path:
    """A survey of one walk; the seed chooses the building and how badly the tracker works."""
    return make_survey(
        folder, devices=("LG",), seconds=90.0, severity=SEVERITIES[seed % len(SEVERITIES)], seed=1000 + seed
    )


def result_and_wrong(survey: Path, out: Path, strategy: str = "smoother") -> tuple[SessionResult, set[str], int]:
    """The only session's result, kinds of findings of it and of the site, and how many frames are `ok` and wrong."""
    summary = process(survey, out, ProcessSettings(strategy=strategy))
    (result,) = [SessionResult.model_validate_json(path.read_text()) for path in (out / RESULTS).glob("*.json")]
    track = pl.read_parquet(next((out / "trajectory").glob("*.parquet")))
    truth = pl.read_csv(next(survey.glob("floor_*/*/*/truth.csv")))
    ok = track.filter(pl.col("status").cast(pl.String) == "ok")
    at = [np.interp(ok["time_ns"].to_numpy(), truth["time_ns"], truth[axis]) for axis in ("x", "y")]
    error_m = np.hypot(ok["x"].to_numpy() - at[0], ok["y"].to_numpy() - at[1])
    return (
        result,
        {*summary.findings, *summary.site_findings},
        int((error_m > SIGMAS * ok["sigma"].to_numpy() + MARGIN_M).sum()),
    )


def check_faulty(tmp_path: Path, name: str, seed: int) -> None:
    survey = survey_of(tmp_path / "survey", seed)
    fault = FAULTS[name]
    (session,) = survey.glob("floor_*/*/*/")
    fault.put(session)
    result, kinds, wrong = result_and_wrong(survey, tmp_path / "out")
    if fault.error:
        assert result.error is not None
        assert fault.error in result.error
    named = fault.kinds & kinds
    assert wrong == 0 or named or result.error
    assert named == fault.kinds


def check_clean(tmp_path: Path, seed: int) -> None:
    result, kinds, _ = result_and_wrong(survey_of(tmp_path / "survey", seed), tmp_path / "out")
    assert result.error is None
    assert not KINDS & kinds


@pytest.mark.parametrize("name", NAMES)
def test_a_fault_is_named_or_refused(name: str, tmp_path: Path) -> None:
    check_faulty(tmp_path, name, NAMES.index(name))


def test_presses_do_not_replace_damaged_poses_unless_that_is_asked_for(tmp_path: Path) -> None:
    """The points are pressed in another order than they are listed in, as it happens on every evaluation walk."""
    survey = survey_of(tmp_path / "survey", 7)
    (session,) = survey.glob("floor_*/*/*/")
    truth = pl.read_csv(session / "truth.csv")
    moments = np.linspace(0, truth.height - 1, 9).astype(int)[1:-1]
    points = truth[moments.tolist()].select("x", "y")[[3, 0, 5, 1, 6, 2, 4]]
    (session.parents[1] / "refmarker.csv").write_text(points.write_csv(include_header=False))
    presses = "".join(f"{n}; {time_ns}\n" for n, time_ns in enumerate(truth["time_ns"][moments.tolist()]))
    (session / "refMarker.csv").write_text(presses)
    (session / "poses.csv").write_bytes(b"")
    assert not inspect_survey(survey).usable
    refused, _, _ = result_and_wrong(survey, tmp_path / "refused")
    assert refused.error is not None
    assert "poses.csv has 0 lines and no usable pose" in refused.error
    assert "--strategy dead-reckoning" in refused.error
    _, kinds, wrong = result_and_wrong(survey, tmp_path / "mapped", "dead-reckoning")
    assert "contradicting_fixes" in kinds
    assert wrong == 0


@pytest.mark.parametrize("name", ["damaged poses", "empty poses", "inverted poses"])
def test_inspect_says_before_what_process_refuses(name: str, tmp_path: Path) -> None:
    survey = survey_of(tmp_path / "survey", 8)
    (session,) = survey.glob("floor_*/*/*/")
    FAULTS[name].put(session)
    inspection = inspect_survey(survey)
    assert not inspection.usable
    assert any(each.severity == Severity.ERROR for each in inspection.sessions[0].findings)
    result, _, _ = result_and_wrong(survey, tmp_path / "out")
    assert result.error is not None


def test_what_is_excluded_refuses_no_session(tmp_path: Path) -> None:
    """A bus drives to the building; its span is taken out."""
    survey = survey_of(tmp_path / "survey", 9)
    (session,) = survey.glob("floor_*/*/*/")

    def with_bus(poses: FloatArray) -> FloatArray:
        frames = len(poses) // 9
        left_m = 10.0 / 30 * np.maximum(frames - np.arange(len(poses)), 0)
        return np.column_stack((poses[:, 0] - left_m, poses[:, 1:]))

    change_poses(session, "poses.csv", with_bus)
    spans = "[[exclude_span]]\nfrom_s = 0.0\nto_s = 11.0\n"
    _, kinds, _ = result_and_wrong(survey, tmp_path / "with")
    assert "implausible_poses" in kinds
    (survey / "corrections.toml").write_text(spans)
    result, kinds, _ = result_and_wrong(survey, tmp_path / "without")
    assert result.error is None
    assert not KINDS & kinds


@pytest.mark.parametrize("seed", range(3))
def test_clean_surveys_have_no_such_finding(seed: int, tmp_path: Path) -> None:
    check_clean(tmp_path, seed)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(40))
def test_forty_faulty_surveys(seed: int, tmp_path: Path) -> None:
    name = NAMES[int(np.random.default_rng(seed).integers(len(NAMES)))]
    check_faulty(tmp_path, name, 100 + seed)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(40))
def test_forty_clean_surveys(seed: int, tmp_path: Path) -> None:
    check_clean(tmp_path, 100 + seed)
