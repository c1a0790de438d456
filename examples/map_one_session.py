"""Read one session and map it with each strategy, without writing files."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from vislam2tag.api import (
    LabelSettings,
    Status,
    label_readings,
    open_survey,
    read_session,
    regular_survey,
    simulate,
    strategies_for_poses,
    strategy_named,
)
from vislam2tag.estimation.settings import MappingSettings


def main() -> None:
    """Print, for each strategy, what became of the frames and of the Wi-Fi readings of the first session."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(regular_survey(seed=2, floors=(0,), devices=("LG",), sessions=1), Path(folder) / "survey")
        survey = open_survey(Path(folder) / "survey")
        session = read_session(survey.sessions[0])
        print(f"{session.key}: {len(session.camera.time_ns)} frames, landmarks {', '.join(session.landmarks.ids)}")
        for name in strategies_for_poses():
            trajectory = strategy_named(name, MappingSettings()).map(
                session.camera, session.landmarks, survey.site.landmarks
            )
            codes, counts = np.unique(trajectory.status, return_counts=True)
            causes = ", ".join(f"{Status(code).label} {count}" for code, count in zip(codes, counts, strict=True))
            wifi = label_readings(session.tables["wifi"], trajectory, LabelSettings())
            print(f"{name}: {causes}; {wifi['x'].count()} of {len(wifi)} Wi-Fi readings labelled")


if __name__ == "__main__":
    main()
