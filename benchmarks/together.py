"""Gain of walks of a floor from each other: mapped alone, and together (``process --together``).

Generated floors have 20 landmarks and 8 walks of 3 minutes. Of the landmarks 3, 5 or 8 are surveyed, well spread or
drawn at random; the places of the others are unknown. "Landmarks" are walks together that share only landmark priors,
and not the noise of their device's tracker.

    python benchmarks/together.py                                  seeds 1 to 4, default severity
    python benchmarks/together.py --seeds 11 12 --severity severe
    python benchmarks/together.py --real                           the real walks, taken for one floor
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from calibration import cells, points
from data_sets import Walk
from landmark_survey import SETTINGS, SIGMA_M, Site, chosen, complete, generated_sites, real_site, spread

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import TrackerNoise
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.comparison import OtherWalks, ToldPlaces
from vislam2tag.estimation.landmark_survey.landmark_map import join
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.estimation.tracker_errors import noise_of_other_walks

LONG_M = 40.0
"""Walks with a stretch between surveyed landmarks longer than this are distinguished."""


def main() -> None:
    """Print for each number of surveyed landmarks the walks alone, with completed landmarks, and together."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--severity", default="default")
    parser.add_argument("--real", action="store_true")
    options = parser.parse_args()
    sites = [real_site()] if options.real else list(generated_sites(options.seeds, options.severity))
    print("| surveyed | mapped | walks | mean | inside 68 % | inside 95 % | least | most | long | others | worse |")
    print("| --- " * 11 + "|")
    for count in (3, 5, 8):
        for name, choose in (("spread", spread), ("at random", lambda marks, count: chosen(marks, count, 0))):
            choices = [choose(site.landmarks, count) for site in sites]
            for line in lines(sites, choices):
                print(f"| {count}, {name} | {line} |", flush=True)


def lines(sites: list[Site], choices: list[IntArray]) -> list[str]:
    """Figures of all walks that can be mapped alone: alone, with completed landmarks, landmark priors, together."""
    found: dict[str, list[FloatArray]] = {"alone": [], "completed": [], "landmarks": [], "together": []}
    long = []
    for site, surveyed in zip(sites, choices, strict=True):
        known = only(site.landmarks, surveyed)
        completed = complete(site, surveyed)[0]
        told, noise = together(site, surveyed), told_noise(site)
        for number, walk in enumerate(site.walks):
            long.append(longest_stretch_m(walk, known) > LONG_M)
            for name, landmarks, tracker in (
                ("alone", known, None),
                ("completed", completed, None),
                ("landmarks", told[number], None),
                ("together", told[number], noise[number]),
            ):
                camera = replace(walk.camera, tracker=tracker)
                trajectory = strategy_named("smoother", SETTINGS.mapping).map(camera, walk.log, landmarks)
                found[name].append(points(walk, trajectory))
    rows = [i for i, one in enumerate(found["alone"]) if len(one)]
    means = {name: np.array([one[i][:, 0].mean() for i in rows]) for name, one in found.items()}
    far = np.array(long)[rows]
    result = []
    for name, one in found.items():
        figures = cells(one[i] for i in rows)
        gains = " | ".join(gain(means["alone"][those], means[name][those]) for those in (far, ~far))
        worse = (means[name] - means["alone"]).max()
        result.append(f"{name} | {figures} | {gains} | {worse:.3f} m")
    return result


def gain(alone_m: FloatArray, other_m: FloatArray) -> str:
    """How many walks there are, and by how much their mean errors (w,), metres, fall together."""
    return f"{len(alone_m)}: {1 - other_m.mean() / alone_m.mean():.0%}" if len(alone_m) else "-"


def only(landmarks: Landmarks, surveyed: IntArray) -> Landmarks:
    """The landmarks that are surveyed."""
    return landmarks.select(surveyed.tolist())


def together(site: Site, surveyed: IntArray) -> list[Landmarks]:
    """For each walk what survey and other walks say of the landmarks."""
    priors = LandmarkPriors.nothing(len(site.landmarks.ids))
    priors.position[surveyed] = as_complex(site.landmarks.position_bcs[surveyed])
    priors.covariance[surveyed] = np.eye(2) * SIGMA_M**2
    others = OtherWalks(join(site.maps, priors))
    return [as_landmarks(site.landmarks, others.seen(number)) for number in range(len(site.walks))]


def told_noise(site: Site) -> list[TrackerNoise | None]:
    """For each walk what the others show about its tracker."""
    return noise_of_other_walks([walk.device for walk in site.walks], [noise.evidence for noise in site.noise])


def as_landmarks(landmarks: Landmarks, told: ToldPlaces) -> Landmarks:
    """Landmarks at the given places."""
    k = len(told.landmark)
    column = np.arange(2 * k).reshape(-1, 2)
    headed = np.isfinite(told.heading_rad)
    return replace(
        landmarks.select(told.landmark.tolist()),
        position_bcs=as_points(told.position),
        covariance_bcs=told.covariance[column[:, :, None], column[:, None, :]],
        heading_rad=told.heading_rad,
        heading_sigma_rad=np.where(headed, np.sqrt(np.diag(told.covariance)[2 * k :]), np.nan),
        joint_covariance=told.covariance,
    )


def longest_stretch_m(walk: Walk, landmarks: Landmarks) -> float:
    """Longest way between places near surveyed landmarks, by the truth or, where that is sparse, by the tracker."""
    camera = walk.camera.plane_acs[walk.camera.usable]
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(camera, axis=0).T))))
    frame = np.full(len(walk.camera.time_ns), -1)
    frame[walk.camera.usable] = np.arange(len(way))
    known = [i for i, name in enumerate(walk.log.ids) if name in landmarks.index]
    rows = np.isin(walk.log.landmark, known) & (frame[walk.log.frame] >= 0)
    near = np.hypot(*(walk.log.plane_acs - walk.camera.plane_acs[walk.log.frame]).T) < 3.0
    at = np.unique(way[frame[walk.log.frame[rows & near]]])
    return float(np.diff(np.concatenate(([0.0], at, way[-1:]))).max())


if __name__ == "__main__":
    main()
