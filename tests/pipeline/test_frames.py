"""A reader who steps from ``process`` to the odometry meets few functions of ours."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

import pytest

import vislam2tag
from tests.surveys import make_survey
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.pipeline.labels.process import process

MAX_FRAMES = 10
SOURCE = str(Path(vislam2tag.__file__).parent)


def test_few_frames_lead_from_process_to_the_odometry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[list[str]] = []

    def noted(camera: CameraTrack, log: LandmarkLog, *, turned_as_camera: bool = False) -> Odometry:
        frames = (frame for frame in traceback.extract_stack() if frame.filename.startswith(SOURCE))
        found.append([f"{Path(frame.filename).name}: {frame.name}" for frame in frames])
        return continuous_odometry(camera, log, turned_as_camera=turned_as_camera)

    for module in list(sys.modules.values()):
        if getattr(module, "continuous_odometry", None) is continuous_odometry and module.__name__ != __name__:
            monkeypatch.setattr(module, "continuous_odometry", noted)
    process(make_survey(tmp_path / "survey", devices=("LG",), seconds=20.0), tmp_path / "labels")
    mapping = [frames for frames in found if any("bridged_observations" in frame for frame in frames)]
    assert mapping
    assert mapping[0][0] == "process.py: process"
    assert len(mapping[0]) <= MAX_FRAMES, mapping[0]
