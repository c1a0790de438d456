"""The walks that the benchmarks map: generated ones, real ones and those the published program was run on."""

from __future__ import annotations

import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.quality.evaluation.truth import (
    Residuals,
    Truth,
    errors_at_frames,
    read_truth,
    residuals_at_truth,
)
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.model import position_at
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import simulate, walk_and_track
from vislam2tag.site.model import Survey

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"
TRUTH_FILE = "truth.csv"


@dataclass(frozen=True)
class Walk:
    """What a strategy maps, and the truth where there is one."""

    name: str
    camera: CameraTrack
    log: LandmarkLog
    landmarks: Landmarks
    truth: Truth | None = None
    truth_at_frames: bool = True
    """False where the truth is known at some points only."""
    device: str = ""

    def errors(self, trajectory: Trajectory) -> FloatArray:
        """Label errors at the frames, or at the true points where there are only some; NaN without a label."""
        if self.truth is None:
            return np.full(len(trajectory.time_ns), np.nan)
        if self.truth_at_frames:
            return errors_at_frames(trajectory, self.truth)
        return np.asarray(np.linalg.norm(residuals_at_truth(trajectory, self.truth).error_m, axis=1))

    def residuals(self, trajectory: Trajectory) -> Residuals:
        """Errors as vectors with the covariances stated, at the same points (usable frames inside the truth)."""
        if self.truth is None:
            return Residuals(np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, 2)))
        truth = self._truth_at_frames if self.truth_at_frames else self.truth
        return residuals_at_truth(trajectory, truth)

    @cached_property
    def _truth_at_frames(self) -> Truth:
        assert self.truth is not None
        known, time_ns = self.truth.time_ns, self.camera.time_ns[self.camera.usable]
        time_ns = time_ns[(time_ns >= known[0]) & (time_ns <= known[-1])]
        x, y = (np.interp(time_ns - known[0], known - known[0], axis) for axis in self.truth.position_bcs.T)
        return Truth(time_ns, np.column_stack((x, y)))


def landmarks_on(survey: Survey, floor: int) -> Landmarks:
    """Landmarks of one floor."""
    everywhere = survey.site.landmarks
    return everywhere.on_floor(floor)


def walks_of(root: Path, *, truth_at_frames: bool) -> Iterator[Walk]:
    """Read the walks of a survey folder one after the other."""
    survey = open_survey(root)
    for ref in survey.sessions:
        session = read_session(ref)
        landmarks = landmarks_on(survey, ref.key.floor)
        file = ref.folder / TRUTH_FILE
        truth = read_truth(file) if file.is_file() else None
        yield Walk(ref.slug, session.camera, session.landmarks, landmarks, truth, truth_at_frames, ref.key.device)


def generated(
    seeds: list[int], severity: str = "default", building: BuildingSettings | None = None, sessions: int = 3
) -> Iterator[Walk]:
    """Walks of 3 minutes at this severity: for each seed 2 floors x 2 phones x ``sessions``, written and read back."""
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "survey"
            simulate(regular_survey(seed, severity, sessions=sessions, building=building), root)
            yield from walks_of(root, truth_at_frames=True)


TRACKER_NOISE = (
    "pose_noise_m",
    "sighting_bias_m",
    "sighting_noise_m",
    "sighting_heading_sigma_rad",
    "heading_drift_rad",
    "turning_drift",
    "scale_sigma",
    "position_drift_m",
)
"""Of the simulator's tracker, what is noise rather than fault."""


def with_tracker(
    seeds: Iterable[int], times: float, severity: str = "default", landmarks: int = 12, sessions: int = 1
) -> Iterator[Walk]:
    """Walks of 3 minutes, 2 phones x ``sessions`` a seed, whose tracker is so many ``times`` as noisy as usual; its
    faults stay.
    """
    for seed in seeds:
        building = BuildingSettings(landmarks=landmarks)
        scenario = regular_survey(seed, severity, (0,), ("LG", "OnePlus"), sessions, building=building)
        floor = scenario.building.floor(0)
        survey_sigma_m = 0.02
        off_m = np.random.default_rng(seed).normal(0, survey_sigma_m, (landmarks, 2))
        surveyed = surveyed_at(floor.landmark_ids, floor.landmark_position[:, :2] + off_m, survey_sigma_m)
        for planned in scenario.sessions:
            noise = {name: times * getattr(planned.tracker, name) for name in TRACKER_NOISE}
            tracker = planned.tracker.model_copy(update={**noise, "frame_rate_hz": 20.0})
            walk, log = walk_and_track(scenario, replace(planned, tracker=tracker))
            camera = CameraTrack(
                log.time_ns, log.position_acs, log.orientation_acs, np.zeros(len(log.time_ns), dtype=np.int8)
            )
            truth = Truth(log.time_ns, position_at(walk, log.time_ns)[:, :2])
            device = f"{seed} {planned.key.device}"
            yield Walk(f"{device} {planned.key.session}", camera, log.landmarks, surveyed, truth, device=device)


def surveyed_at(ids: tuple[str, ...], position_m: FloatArray, sigma_m: float) -> Landmarks:
    """Landmarks of floor 0 at positions (m, 2), BCS, without heights and headings."""
    unknown = np.full(len(ids), np.nan)
    return Landmarks(
        ids=ids,
        floor=np.zeros(len(ids), dtype=np.int64),
        position_bcs=position_m,
        covariance_bcs=np.tile(np.eye(2) * sigma_m**2, (len(ids), 1, 1)),
        z_m=unknown,
        heading_rad=unknown,
        heading_sigma_rad=unknown,
    )


def every_kth(walks: Iterable[Walk], k: int) -> Iterator[Walk]:
    """Each walk k times, with every k-th landmark, starting with each of the first k; the others are not logged."""
    for walk in walks:
        for first in range(k):
            kept = walk.landmarks.select(list(range(first, len(walk.landmarks.ids), k)))
            logged = [i for i, name in enumerate(walk.log.ids) if name in kept.index]
            yield replace(walk, name=f"{walk.name} {first}", landmarks=kept, log=walk.log.select(logged))


def real_walks() -> Iterator[Walk]:
    """The three real walks; none where the data are not beside the checkout."""
    folder = SHARED / "real-walks"
    if folder.is_dir():
        yield from walks_of(folder, truth_at_frames=False)


def extract_agreement(into: Path) -> Path | None:
    """Unpack the sessions that the published program was run on, and its output; None where they are not at hand."""
    archive = SHARED / "agreement" / "agreement.tar.xz"
    if not archive.is_file():
        return None
    with tarfile.open(archive) as packed:
        packed.extraction_filter = getattr(tarfile, "data_filter", None)  # Python 3.11.2 has none
        packed.extractall(into)
    return into
