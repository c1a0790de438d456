"""Errors of landmarks that walks place without a survey, and of labels from such landmarks.

Generated floors have 20 landmarks and 8 walks of 3 minutes. Of these landmarks 3, 5 or 8 keep their position, well
spread or drawn at random. ``survey-landmarks`` places the others, and the walks are mapped with the completed file.

    python benchmarks/landmark_survey.py                                  seeds 1 to 8, default severity
    python benchmarks/landmark_survey.py --seeds 1 2 --severity severe    other floors and faults
    python benchmarks/landmark_survey.py --real                           the real walks, taken for one floor
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from data_sets import Walk, real_walks, walks_of

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.landmark_map import join
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.smoother import solve_in_own_frame
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.estimation.tracker_errors import NoiseLevels
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import simulate
from vislam2tag.site.landmark_file import SharedErrors

SETTINGS = Settings()
SIGMA_M = 0.02
GREATEST_SIGMA_M = 5.0
REGIONS = {68: 2.279, 95: 5.991}
"""Squared Mahalanobis distance in the plane that holds this percentage."""


@dataclass(frozen=True)
class Site:
    """A floor: its walks, their local maps and noise, and where its landmarks truly are."""

    walks: list[Walk]
    maps: list[LocalMap]
    noise: list[NoiseLevels]
    landmarks: Landmarks


@dataclass(frozen=True)
class Labels:
    """Label errors of one walk: mean and 95th percentile, metres; shares of them inside the stated regions."""

    mean_m: float
    p95_m: float
    inside: tuple[float, ...]


def main() -> None:
    """Print one row for each number and choice of surveyed landmarks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 9)))
    parser.add_argument("--severity", default="default")
    parser.add_argument("--draws", type=int, default=2, help="random choices of surveyed landmarks on each floor")
    parser.add_argument("--real", action="store_true")
    options = parser.parse_args()
    sites = [real_site()] if options.real else list(generated_sites(options.seeds, options.severity))
    print(
        "| surveyed | landmarks placed | mean | p95 | in 68 % | in 95 % | label mean | label p95 | in 68 % | in 95 % |"
    )
    print("| --- " * 10 + "|")
    full = [labels for site in sites for labels in mapped(site, site.landmarks)]
    print(f"| all | | | | | | {cells(full)} |")
    for count in (3, 5, 8):
        print(f"| {count}, spread | {row(sites, [[spread(site.landmarks, count)] for site in sites])} |", flush=True)
        drawn = [[chosen(site.landmarks, count, draw) for draw in range(options.draws)] for site in sites]
        print(f"| {count}, at random | {row(sites, drawn)} |", flush=True)


def generated_sites(seeds: list[int], severity: str) -> Iterator[Site]:
    """One floor for each seed, written and read back."""
    for seed in seeds:
        with generated_floor(seed, severity) as root:
            yield site_of(list(walks_of(root, truth_at_frames=True)))


@contextmanager
def generated_floor(seed: int, severity: str) -> Iterator[Path]:
    """Yield the survey of one floor, written."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(regular_survey(seed, severity, floors=(0,), sessions=4, building=BuildingSettings(landmarks=20)), root)
        yield root


def real_site() -> Site:
    """The real walks with the landmarks of all their files, which share one building frame."""
    return site_of(list(real_walks()))


def site_of(walks: list[Walk]) -> Site:
    """Reduce each walk to its local map; landmarks are those that any walk's file has."""
    row = {name: (walk, i) for walk in walks for i, name in enumerate(walk.landmarks.ids)}
    first = next(iter(walks)).landmarks
    landmarks = Landmarks(
        ids=tuple(row),
        floor=np.zeros(len(row), dtype=np.int64),
        position_bcs=np.array([walk.landmarks.position_bcs[i] for walk, i in row.values()]),
        covariance_bcs=np.tile(np.eye(2) * SIGMA_M**2, (len(row), 1, 1)),
        z_m=np.full(len(row), np.nan),
        heading_rad=np.full(len(row), np.nan),
        heading_sigma_rad=np.full(len(row), np.nan),
        storeys=first.storeys,
    )
    maps, noise = [], []
    for walk in walks:
        logged = walk.log.select([i for i, name in enumerate(walk.log.ids) if name in row])
        observations = WalkObservations.of(walk.camera, logged, SETTINGS.mapping.smoother.sighting_range_m)
        index = np.array([landmarks.index[name] for name in logged.ids], dtype=np.int64)
        smoothed = solve_in_own_frame(observations)
        local = LocalMap.of(smoothed)
        noise.append(smoothed.noise)
        maps.append(replace(local, landmark=index[local.landmark]))
    return Site(walks, maps, noise, landmarks)


def spread(landmarks: Landmarks, count: int) -> IntArray:
    """Landmarks far from one another: first the one farthest out, then each time the one farthest from the others."""
    place = landmarks.position_bcs
    taken = [int(np.linalg.norm(place - place.mean(axis=0), axis=1).argmax())]
    while len(taken) < count:
        taken.append(int(np.linalg.norm(place[:, None] - place[taken], axis=2).min(axis=1).argmax()))
    return np.array(sorted(taken), dtype=np.int64)


def chosen(landmarks: Landmarks, count: int, draw: int) -> IntArray:
    """Landmarks drawn at random."""
    return np.random.default_rng(draw).permutation(len(landmarks.ids))[:count]


def row(sites: list[Site], choices: list[list[IntArray]]) -> str:
    """Place the other landmarks of each site for each choice, map its walks with them, and describe both."""
    found: dict[str, list[FloatArray]] = defaultdict(list)
    labels: list[Labels] = []
    number = 0
    for site, drawn in zip(sites, choices, strict=True):
        for surveyed in drawn:
            completed, error_m, square = complete(site, surveyed)
            number += len(site.landmarks.ids) - len(surveyed)
            found["error"].append(error_m)
            found["square"].append(square)
            labels += mapped(site, completed)
    error, square = (np.concatenate(found[name]) for name in ("error", "square"))
    shares = " | ".join(f"{np.mean(square < limit):.0%}" for limit in REGIONS.values())
    placed = f"{len(error) / number:.0%} | {error.mean():.2f} | {np.quantile(error, 0.95):.2f}"
    return f"{placed} | {shares} | {cells(labels)}"


def complete(site: Site, surveyed: IntArray) -> tuple[Landmarks, FloatArray, FloatArray]:
    """Landmarks as ``survey-landmarks`` completes them; error and squared Mahalanobis distance of those it placed."""
    truth = site.landmarks
    priors = LandmarkPriors.nothing(len(truth.ids))
    priors.position[surveyed] = as_complex(truth.position_bcs[surveyed])
    priors.covariance[surveyed] = truth.covariance_bcs[surveyed]
    joined = join(site.maps, priors)
    covariance = joined.position_covariance
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    others = np.setdiff1d(np.flatnonzero(sigma_m < GREATEST_SIGMA_M), surveyed)
    position, variance = np.full_like(truth.position_bcs, np.nan), np.full(len(truth.ids), np.inf)
    position[surveyed], variance[surveyed] = truth.position_bcs[surveyed], SIGMA_M**2
    position[others], variance[others] = as_points(joined.position[others]), sigma_m[others] ** 2
    headed = joined.heading_sigma_rad < 0.5
    completed = Landmarks(
        ids=truth.ids,
        floor=truth.floor,
        position_bcs=position,
        covariance_bcs=np.where(np.eye(2) > 0, variance[:, None, None], 0.0),
        z_m=truth.z_m,
        heading_rad=np.where(headed, joined.heading_rad, np.nan),
        heading_sigma_rad=np.where(headed, joined.heading_sigma_rad, np.nan),
        storeys=truth.storeys,
    )
    sharing = np.concatenate((surveyed[joined.agreed[surveyed]], others)).astype(np.int64)
    ids = tuple(truth.ids[row] for row in sharing.tolist())
    shared = SharedErrors(truth.floor[sharing], ids, position[sharing], joined.shared_covariance(sharing))
    completed = shared.onto(completed)
    miss = position[others] - truth.position_bcs[others]
    return completed, np.hypot(*miss.T), squares(miss, covariance[others])


def squares(miss: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared Mahalanobis distances of errors (n, 2)."""
    return np.asarray(np.einsum("ni,nij,nj->n", miss, np.linalg.inv(covariance), miss))


def mapped(site: Site, landmarks: Landmarks) -> list[Labels]:
    """Map each walk of a site with these landmarks."""
    strategy = strategy_named("smoother", SETTINGS.mapping)
    return [labels_of(walk, strategy.map(walk.camera, walk.log, landmarks)) for walk in site.walks]


def labels_of(walk: Walk, trajectory: Trajectory) -> Labels:
    """Label errors of a walk against the truth at frames, or at its true points."""
    error = walk.errors(trajectory)
    error = error[np.isfinite(error)]
    if not len(error):
        return Labels(np.nan, np.nan, (np.nan,) * len(REGIONS))
    inside: tuple[float, ...] = (np.nan,) * len(REGIONS)
    if walk.truth is not None and walk.truth_at_frames:
        true = np.column_stack(
            [np.interp(trajectory.time_ns, walk.truth.time_ns, walk.truth.position_bcs[:, axis]) for axis in (0, 1)]
        )
        rows = np.flatnonzero(np.isfinite(trajectory.sigma_m))
        distance = squares((trajectory.position_bcs[:, :2] - true)[rows], trajectory.covariance_bcs[rows])
        inside = tuple(float(np.mean(distance < limit)) for limit in REGIONS.values())
    return Labels(float(error.mean()), float(np.quantile(error, 0.95)), inside)


def cells(labels: list[Labels]) -> str:
    """Averages over walks."""
    metres = " | ".join(f"{np.nanmean([getattr(one, name) for one in labels]):.2f}" for name in ("mean_m", "p95_m"))
    shares = [np.mean([one.inside[i] for one in labels]) for i in range(len(REGIONS))]
    return f"{metres} | " + " | ".join("-" if np.isnan(share) else f"{share:.0%}" for share in shares)


if __name__ == "__main__":
    main()
