"""Errors of height and floor on generated walks over three floors, by what the survey gives.

Each walk counts once: a figure is the average of the walks' figures.

    python benchmarks/height_errors.py                          seeds 1 to 4, stairs and lift: 48 walks
    python benchmarks/height_errors.py --seeds 7 --severity severe
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.estimation.heights import estimate_heights
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb, SiteColumn
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.corrections.file import Corrections

COLUMNS = frozenset({SiteColumn.ELEVATION, SiteColumn.Z})
GIVEN = {
    "elevations, landmarks' z, pressure": (True, True, True),
    "elevations, landmarks' z": (True, True, False),
    "elevations": (True, False, False),
    "nothing": (False, False, False),
}
"""Elevations, surveyed heights of the landmarks, air pressure."""


def main() -> None:
    """Simulate, estimate and print one row for each way to climb and each kind of survey."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--severity", default="default")
    parser.add_argument("--minutes", type=float, default=3.0)
    arguments = parser.parse_args()
    print("| way | survey gives | walks | mean error of z, m | 95 % | on the true floor |")
    print("| --- | --- | --- | --- | --- | --- |")
    for climb in (Climb.STAIRS, Climb.LIFT):
        figures: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
        for seed in arguments.seeds:
            for name, figure in _errors(seed, climb, arguments.severity, 60 * arguments.minutes):
                figures[name].append(figure)
        for name, walks in figures.items():
            mean, p95, share = np.mean(walks, axis=0)
            heights = "- | -" if np.isnan(mean) else f"{mean:.2f} | {p95:.2f}"
            print(f"| {climb} | {name} | {len(walks)} | {heights} | {100 * share:.1f} % |")


def _errors(
    seed: int, climb: Climb, severity: str, duration_s: float
) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """Mean and 95th percentile of the error of z, and the share of frames on the true floor, of each walk."""
    scenario = regular_survey(seed, severity, (0, 1, 2), ("LG",), 2, duration_s, climb=climb, pressure=True)
    with tempfile.TemporaryDirectory() as folder:
        simulate(scenario, Path(folder), WritingOptions(columns=COLUMNS))
        survey = open_survey(Path(folder))
        for ref in survey.sessions:
            prepared = prepared_session(SessionTask(ref, survey.site, Corrections()))
            session, mine = prepared.session, prepared.landmarks
            truth = pl.read_csv(ref.folder / "truth.csv")
            for name, given in GIVEN.items():
                camera, landmarks = _given(session.camera, mine, *given)
                yield name, _figure(camera, session.landmarks, landmarks, truth)


def _given(
    camera: CameraTrack, landmarks: Landmarks, elevations: bool, heights: bool, pressure: bool
) -> tuple[CameraTrack, Landmarks]:
    """Leave out what a poorer survey would not give."""
    storeys = landmarks.storeys
    if storeys is not None and not elevations:
        storeys = replace(storeys, elevation_m=np.full(len(storeys.number), np.nan))
    z_m = landmarks.z_m if heights else np.full(len(landmarks.ids), np.nan)
    return replace(camera, pressure=camera.pressure if pressure else None), replace(landmarks, z_m=z_m, storeys=storeys)


def _figure(
    camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, truth: pl.DataFrame
) -> tuple[float, float, float]:
    heights = estimate_heights(camera, log, landmarks)
    error = np.abs(heights.z_m - truth["z"].to_numpy())
    share = float(np.mean(heights.floor == truth["floor"].to_numpy()))
    return float(error.mean()), float(np.quantile(error, 0.95)), share


if __name__ == "__main__":
    main()
