"""What landmarks lack is said in the strategy's own terms, and only where it mattered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.surveys import make_survey
from tests.walks import corridor_walk, log_of, to_acs
from vislam2tag.common.findings import Finding
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.estimation import smoother
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.results import SessionResult
from vislam2tag.pipeline.labels.findings import landmark_findings
from vislam2tag.pipeline.labels.process import process

IN_LINE = {"a": (5.0, 0.5), "b": (15.0, 0.5), "c": (25.0, 0.5)}


def findings(strategy: str, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> list[Finding]:
    chosen = strategy_named(strategy, MappingSettings())
    trajectory = chosen.map(camera, log, landmarks)
    return landmark_findings(camera, log, landmarks, trajectory, 1.0, chosen.needs)


def test_an_affine_map_needs_three_landmarks_off_a_line() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), IN_LINE)
    (finding,) = findings("global-affine", camera, log, landmarks)
    assert finding.kind == "too_few_landmarks"
    assert (
        "three surveyed landmarks seen that are not on one line; visited within the radius: a, b, c" in finding.message
    )
    assert findings("global", camera, log, landmarks) == []


def test_a_mapped_walk_lacks_nothing_however_few_it_visited() -> None:
    camera, _, landmarks, truth = corridor_walk(Similarity2.identity(), {"a": (5.0, 0.5), "far": (15.0, 2.5)})
    seen = {
        name: to_acs(np.tile(landmarks.position_bcs[i], (len(truth), 1)), 1.4) for i, name in enumerate(landmarks.ids)
    }
    log = log_of(camera, {name: np.where(truth[:, :1] > 3, position, np.nan) for name, position in seen.items()})
    assert findings("global", camera, log, landmarks) == []
    assert [finding.kind for finding in findings("local", camera, log, landmarks)] == ["too_few_landmarks"]


def test_the_smoother_tells_what_a_walk_lacks_and_minds_no_height() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), IN_LINE)
    assert findings("smoother", camera, log, landmarks) == []
    log.position_acs[:, 1] += 3
    assert findings("smoother", camera, log, landmarks) == []
    for known in ([], [1]):
        (finding,) = findings("smoother", camera, log, landmarks.select(known))
        assert finding.kind == "too_few_landmarks"
        assert "two surveyed landmarks seen half a metre apart, or one whose heading is surveyed" in finding.message


def test_a_walk_whose_reweighting_does_not_converge_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=60)
    process(survey, tmp_path / "sure")
    monkeypatch.setattr(smoother, "MOST_ROUNDS", 1)
    monkeypatch.setattr(smoother, "SETTLED_SIGMAS", 1e-9)
    process(survey, tmp_path / "unsure")
    kinds = [
        {finding.kind for finding in SessionResult.model_validate_json(path.read_bytes()).findings}
        for name in ("sure", "unsure")
        for path in (tmp_path / name / "sessions").glob("*.json")
    ]
    assert ["not_converged" in found for found in kinds] == [False, True]
