"""What walks of a floor gain by telling one another where they felt the same magnetic field, and where they heard.

Generated floors with 20 landmarks and 8 walks of 3 minutes, of which 3 landmarks are surveyed, well spread or drawn at
random, mapped alone and with what the walks tell one another of the sheets (``process --together``), each told how
noisy its device's tracker is; then each again with where the others' scans put it, where their magnetic fields do, and
with both.

    python benchmarks/magnetic_ties.py                                  seeds 111 to 118
    python benchmarks/magnetic_ties.py --severity severe
    python benchmarks/magnetic_ties.py --doubted 1                      magnetic fixes taken to be as good as estimated
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from calibration import cells, points
from data_sets import Walk, walks_of
from further_ties import true_at
from radio_ties import Compared, gain, mapped
from together import only, together, told_noise

from landmark_survey import Site, chosen, generated_floor, site_of, spread
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.tracks import Landmarks
from vislam2tag.pipeline.labels.joining.heard_walks import scans_of
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.smoother.landmark_priors import LandmarkPriors
from vislam2tag.walk_ties import magnetic
from vislam2tag.walk_ties.felt_ways import FeltField, FeltWay
from vislam2tag.walk_ties.radio import radio_ties
from vislam2tag.walk_ties.told import told_together
from vislam2tag.walk_ties.traces import WalkTrace

KINDS = ("radio", "magnetic", "both")
NOTHING = np.empty(0)

Choice = Callable[[Landmarks, int], IntArray]


@dataclass(frozen=True)
class SensedFloor:
    """A floor, and what each walk heard and felt."""

    site: Site
    heard: list[RadioScans]
    felt: list[FeltField | None]

    @classmethod
    def generated(cls, seed: int, severity: str) -> SensedFloor:
        """Walks that are told how noisy their devices' trackers are."""
        with generated_floor(seed, severity) as root:
            site = site_of(list(walks_of(root, truth_at_frames=True)))
            tables = [read_session(ref).tables for ref in open_survey(root).sessions]
        walks = [
            replace(walk, camera=replace(walk.camera, tracker=noise))
            for walk, noise in zip(site.walks, told_noise(site), strict=True)
        ]
        heard = [scans_of(walk.device, one["wifi"]) for walk, one in zip(walks, tables, strict=True)]
        return cls(replace(site, walks=walks), heard, [FeltField.of(one["sensors"]) for one in tables])


def main() -> None:
    """Print for each choice of surveyed landmarks the walks without ties and with each kind."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(111, 119)))
    parser.add_argument("--severity", default="default")
    parser.add_argument("--surveyed", type=int, default=3)
    parser.add_argument("--doubted", type=float, default=magnetic.DOUBTED, help="factor of the variance of fixes")
    options = parser.parse_args()
    magnetic.DOUBTED = options.doubted
    floors = [SensedFloor.generated(seed, options.severity) for seed in options.seeds]
    print("| surveyed | mapped | walks | mean | inside 68 % | inside 95 % | least | most | told | gain | worse | fix |")
    print("| --- " * 12 + "|")
    choices: tuple[tuple[str, Choice], ...] = (
        ("spread", spread),
        ("at random", lambda marks, count: chosen(marks, count, 0)),
    )
    for name, choose in choices:
        for way in ("alone", "together"):
            found: dict[str, list[Compared]] = {kind: [] for kind in KINDS}
            for floor in floors:
                surveyed = choose(floor.site.landmarks, options.surveyed)
                alone = [only(floor.site.landmarks, surveyed)] * len(floor.site.walks)
                for kind, each in compared(floor, alone if way == "alone" else together(floor.site, surveyed)).items():
                    found[kind] += each
            start = f"| {options.surveyed}, {name} | {way}"
            print(f"{start} | {cells(one.without for one in found['both'])} | | | | |")
            for kind, each in found.items():
                print(f"{start}, {kind} | {cells(one.tied for one in each)} | {gain(each)} |", flush=True)


def compared(floor: SensedFloor, landmarks: list[Landmarks]) -> dict[str, list[Compared]]:
    """Map the walks of a floor with these landmarks, then with each kind of ties."""
    walks = floor.site.walks
    first = mapped(walks, landmarks, [None] * len(walks))
    priors = [LandmarkPriors.of(walk.log.ids, known) for walk, known in zip(walks, landmarks, strict=True)]
    traces = [WalkTrace.of(path, 0, known) for path, known in zip(first, priors, strict=True)]
    ways = [
        None if trace is None or felt is None else FeltWay.of(trace, felt)
        for trace, felt in zip(traces, floor.felt, strict=True)
    ]
    radio, felt = radio_ties(traces, floor.heard), magnetic.magnetic_ties(ways)
    both = [told_together(pair) for pair in zip(radio, felt, strict=True)]
    found = {}
    for kind, ties in zip(KINDS, (radio, felt, both), strict=True):
        tied = mapped(walks, landmarks, ties)
        found[kind] = [
            Compared(points(walk, before), points(walk, after), *off(walk, told))
            for walk, before, after, told in zip(walks, first, tied, ties, strict=True)
            if np.isfinite(before.sigma_m).any()
        ]
    return found


def off(walk: Walk, ties: PlaceTies | None) -> tuple[FloatArray, FloatArray]:
    """How far each tie is off (k,), metres, in the direction that is known best, and its square in its variance."""
    if ties is None:
        return NOTHING, NOTHING
    error = ties.position_bcs - true_at(walk, np.asarray(ties.time_ns * 1e-9))
    return best_known(error, ties.covariance_m2)


def best_known(error: FloatArray, covariance_m2: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors (k, 2) with a covariance (2k, 2k), each in the direction in which it is smallest: metres, and squared in
    units of it.
    """
    column = np.arange(2 * len(error)).reshape(-1, 2)
    variance, vectors = np.linalg.eigh(covariance_m2[column[:, :, None], column[:, None, :]])
    along = np.einsum("ki,ki->k", error, vectors[:, :, 0])
    return np.abs(along), along**2 / variance[:, 0]


if __name__ == "__main__":
    main()
