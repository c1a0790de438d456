"""A mapping strategy of one's own: one class, one registered name, and ``process`` knows it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from vislam2tag.api import CameraTrack, LandmarkLog, Landmarks, Settings, Trajectory, process, regular_survey, simulate
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.status import Status
from vislam2tag.mapping.registry import register
from vislam2tag.mapping.trajectory_builder import Sheet, surveyed_part


class FirstSighting:
    """One similarity for the walk, from where each landmark was logged first (a poor idea, but a short one)."""

    needs = "two landmarks seen"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map all frames, or none where fewer than two landmarks were seen."""
        known = surveyed_part(log, landmarks)
        first = known.plane_acs[known.offsets[:-1]]
        surveyed = landmarks.position_bcs[[landmarks.index[name] for name in known.ids]].reshape(-1, 2)
        sheet = Sheet.blank(camera, Status.NO_MAPPING)
        if len(np.unique(first, axis=0)) >= 2:
            sheet.map_stretch(camera, 0, len(camera.time_ns), Similarity2.fit(first, surveyed))
        return sheet.finish(camera, (), ())


def main() -> None:
    """Register the strategy and run the whole pipeline with it."""
    register("first-sighting", lambda settings: FirstSighting())  # noqa: ARG005 - it has no settings
    with tempfile.TemporaryDirectory() as folder:
        survey, out = Path(folder) / "survey", Path(folder) / "labels"
        simulate(regular_survey(seed=5, floors=(0,), devices=("LG",), sessions=2, duration_s=60.0), survey)
        summary = process(survey, out, Settings(strategy="first-sighting"))
        print(f"frames by status: {summary.frames}")


if __name__ == "__main__":
    main()
