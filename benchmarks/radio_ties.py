"""What walks of a floor gain by telling one another where their radio scans say that they were.

Generated floors with 20 landmarks and 8 walks of 3 minutes, of which 3 landmarks are surveyed, well spread or drawn at
random, mapped alone and with what the walks tell one another of the sheets (``process --together``); then each again
with where the others' scans put it.

    python benchmarks/radio_ties.py                                  seeds 111 to 118
    python benchmarks/radio_ties.py --severity severe
    python benchmarks/radio_ties.py --doubted 1                      fixes taken to be as good as estimated
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calibration import cells, points
from data_sets import Walk, walks_of
from landmark_survey import SETTINGS, Site, chosen, generated_floor, site_of, spread
from together import only, together, told_noise

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.labels.together import scans_of
from vislam2tag.positioning import walk_ties
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.walk_traces import WalkTrace
from vislam2tag.sessions.registry import open_survey, read_session


@dataclass(frozen=True)
class Compared:
    """A walk's points (:func:`calibration.points`) without and with ties; what fixes are off, and in their sigmas."""

    without: FloatArray
    tied: FloatArray
    off_m: FloatArray
    square: FloatArray


def main() -> None:
    """Print for each choice of surveyed landmarks the walks without ties and with."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(111, 119)))
    parser.add_argument("--severity", default="default")
    parser.add_argument("--surveyed", type=int, default=3)
    parser.add_argument("--doubted", type=float, default=walk_ties.DOUBTED, help="factor of the variance of fixes")
    options = parser.parse_args()
    walk_ties.DOUBTED = options.doubted
    floors = [heard_floor(seed, options.severity) for seed in options.seeds]
    print("| surveyed | mapped | walks | mean | inside 68 % | inside 95 % | least | most | told | gain | worse | fix |")
    print("| --- " * 12 + "|")
    for name, choose in (("spread", spread), ("at random", lambda marks, count: chosen(marks, count, 0))):
        for way in ("alone", "together"):
            found = list[Compared]()
            for site, heard in floors:
                surveyed = choose(site.landmarks, options.surveyed)
                alone = [only(site.landmarks, surveyed)] * len(site.walks)
                found += compared(site.walks, heard, alone if way == "alone" else together(site, surveyed))
            print(f"| {options.surveyed}, {name} | {way} | {cells(one.without for one in found)} | | | | |")
            print(
                f"| {options.surveyed}, {name} | {way}, radio | {cells(one.tied for one in found)} | {gain(found)} |",
                flush=True,
            )


def heard_floor(seed: int, severity: str) -> tuple[Site, list[RadioScans]]:
    """A floor, whose walks are told how noisy their devices' trackers are, and what each of them heard."""
    with generated_floor(seed, severity) as root:
        site = site_of(list(walks_of(root, truth_at_frames=True)))
        heard = [read_session(ref).tables["wifi"] for ref in open_survey(root).sessions]
    told = zip(site.walks, told_noise(site), strict=True)
    site = replace(site, walks=[replace(walk, camera=replace(walk.camera, tracker=noise)) for walk, noise in told])
    return site, [scans_of(walk.device, table) for walk, table in zip(site.walks, heard, strict=True)]


def compared(walks: list[Walk], heard: list[RadioScans], landmarks: list[Landmarks]) -> Iterator[Compared]:
    """Map the walks of a floor with these landmarks, then with where the others' scans put them."""
    first = mapped(walks, landmarks, [None] * len(walks))
    priors = [LandmarkPriors.of(walk.log.ids, known) for walk, known in zip(walks, landmarks, strict=True)]
    traces = [WalkTrace.of(path, 0, known) for path, known in zip(first, priors, strict=True)]
    ties = walk_ties.radio_ties(traces, heard)
    for walk, before, after, told in zip(walks, first, mapped(walks, landmarks, ties), ties, strict=True):
        if not np.isfinite(before.sigma_m).any():
            continue
        off, variance = np.empty((0, 2)), np.empty(0)
        if told is not None:
            off = np.asarray(told.position_bcs - true_at(walk, np.asarray(told.time_ns * 1e-9)))
            variance = np.diag(told.covariance_m2)[::2]
        square = (off**2).sum(axis=1) / (2 * variance)
        yield Compared(points(walk, before), points(walk, after), np.hypot(*off.T), square)


def true_at(walk: Walk, time_s: FloatArray) -> FloatArray:
    """True places (n, 2) at some moments."""
    assert walk.truth is not None
    return np.column_stack([np.interp(time_s, walk.truth.time_ns * 1e-9, axis) for axis in walk.truth.position_bcs.T])


def mapped(walks: list[Walk], landmarks: list[Landmarks], ties: Sequence[PlaceTies | None]) -> list[Trajectory]:
    """Map each walk with what it is told."""
    strategy = strategy_named("smoother", SETTINGS.mapping)
    return [
        strategy.map(replace(walk.camera, ties=told), walk.log, known)
        for walk, known, told in zip(walks, landmarks, ties, strict=True)
    ]


def gain(found: list[Compared]) -> str:
    """How many walks are told, what their mean error falls by, the greatest rise; how good their fixes are."""
    told = [one for one in found if len(one.off_m)]
    if not told:
        return "0 | - | - | -"
    without, tied = (np.array([getattr(one, name)[:, 0].mean() for one in told]) for name in ("without", "tied"))
    everyone = sum(one.without[:, 0].mean() for one in found)
    fell = without - tied
    share = f"{fell.sum() / everyone:.1%} ± {100 * np.sqrt(len(fell)) * fell.std() / everyone:.1f}"
    off_m, square = (np.concatenate([getattr(one, name) for one in told]).mean() for name in ("off_m", "square"))
    return f"{len(told)} | {share} | {-fell.min():+.3f} m | {off_m:.2f} m, {square:.2f}"


if __name__ == "__main__":
    main()
