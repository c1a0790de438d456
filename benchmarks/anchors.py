"""What the phone app's anchors and sightings gain: errors of the smoother with them and without, on the same walks.

Each seed gives six walks of three minutes with two phones on one floor. Each walk counts once.

    python benchmarks/anchors.py --landmarks 5 --updates 4 --seeds 100 101 102 103 104 105 106 107 108 109 110 111
    python benchmarks/anchors.py --seeds 100 101 102 103
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl

from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.choices import SessionLayout
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import WritingOptions, simulate

Walk = tuple[CameraTrack, LandmarkLog, Landmarks, pl.DataFrame]
WHOLE, UNANCHORED, UNTOLD = "all", "without anchors", "without anchors and sightings"


def main() -> None:
    """Map every walk three times and print a line for each way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[100, 101])
    parser.add_argument("--landmarks", type=int, default=12, help="on the floor")
    parser.add_argument("--updates", type=float, default=0.7, help="map updates a minute")
    options = parser.parse_args()
    errors: dict[str, list[tuple[float, float]]] = {WHOLE: [], UNANCHORED: [], UNTOLD: []}
    for camera, log, landmarks, truth in _walks(options.seeds, options.landmarks, options.updates):
        bare, untold = replace(camera, anchors=None), replace(log, seen=None)
        for name, tracks in ((WHOLE, (camera, log)), (UNANCHORED, (bare, log)), (UNTOLD, (bare, untold))):
            errors[name].append(_errors(*tracks, landmarks, truth))
    _tell(errors)


def _walks(seeds: list[int], landmarks: int, updates: float) -> Iterator[Walk]:
    for seed in seeds:
        building = BuildingSettings(landmarks=landmarks)
        scenario = regular_survey(seed, "default", (0,), ("LG", "OnePlus"), 3, 180.0, building)
        changed = {"map_updates_per_minute": updates}
        planned = tuple(replace(p, tracker=p.tracker.model_copy(update=changed)) for p in scenario.sessions)
        with TemporaryDirectory() as folder:
            simulate(replace(scenario, sessions=planned), Path(folder), WritingOptions(layout=SessionLayout.PHONE))
            survey = open_survey(Path(folder))
            for ref in survey.sessions:
                session = read_session(ref)
                truth = pl.read_csv(ref.folder / "truth.csv")
                yield session.camera, session.landmarks, survey.site.landmarks.on_floor(0), truth


def _errors(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, truth: pl.DataFrame) -> tuple[float, float]:
    """Mean and 95th percentile of a walk's errors, metres; NaN where it cannot be mapped."""
    mapped = strategy_named("smoother", MappingSettings()).map(camera, log, landmarks)
    known = has_position(mapped.status)
    if not known.any():
        return np.nan, np.nan
    true = np.column_stack([np.interp(mapped.time_ns[known], truth["time_ns"], truth[axis]) for axis in ("x", "y")])
    error_m = np.linalg.norm(mapped.position_bcs[known, :2] - true, axis=1)
    return float(error_m.mean()), float(np.quantile(error_m, 0.95))


def _tell(errors: dict[str, list[tuple[float, float]]]) -> None:
    table = {name: np.array(rows) for name, rows in errors.items()}
    whole = table[WHOLE][:, 0]
    mapped = np.isfinite(whole)
    print(f"{mapped.sum()} of {len(mapped)} walks mapped")
    for name, rows in table.items():
        mean_m, p95_m = rows[mapped].mean(axis=0)
        gain_mm = 1000 * (rows[mapped, 0] - whole[mapped])
        spread_mm = gain_mm.std() / np.sqrt(len(gain_mm))
        better, worse = int((gain_mm > 0.1).sum()), int((gain_mm < -0.1).sum())
        print(f"{name}: mean {mean_m:.4f} m, 95 % {p95_m:.4f} m; {gain_mm.mean():+.1f} ± {spread_mm:.1f} mm to all")
        print(f"    all is better on {better} walks, worse on {worse}")


if __name__ == "__main__":
    main()
