"""Gain of walks of a floor from radio constraints between sessions.

Generated floors have 20 landmarks and 8 walks of 3 minutes. Three landmarks are surveyed, well spread or drawn at
random. The walks are mapped alone and with landmark priors from each other (``process --together``), then again with
radio constraints.

With ``--real`` buildings, places and scans are real: WiFine's walks, and those of the Indoor Location Competition 2.0
through all their taps. Only the tracker's drift is drawn. It is zero at landmarks, at fixed distances along the path,
and a random walk between two of them (a Brownian bridge), with its true standard deviation stated. Constraints are used
as in the smoother, by least squares about that drift.

    python benchmarks/radio_ties.py                                  seeds 111 to 118
    python benchmarks/radio_ties.py --severity severe
    python benchmarks/radio_ties.py --doubted 1                      fixes taken to be as good as estimated
    python benchmarks/radio_ties.py --real wifine ilc20              folders of the unpacked archives of ../shared/data
    python benchmarks/radio_ties.py --real wifine ilc20 --walks 8    of each floor so many at a time
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from calibration import cells, points
from data_sets import Walk, walks_of
from landmark_survey import SETTINGS, Site, chosen, generated_floor, site_of, spread
from together import only, together, told_noise

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.settings import DeadReckoningSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.labels.together import scans_of
from vislam2tag.positioning import walk_ties
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.walk_traces import WalkTrace
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.without_poses import inertial_log

LANDMARK_M = 60.0
"""A walk passes a landmark once in so much of the way ..."""
KNOWN_M = 0.05
"""... where it is off by this, per axis."""
DRIFTS = (0.1, 0.2, 0.4)
"""Metres per square root of a metre: midway between landmarks 60 m apart a walk is off by 0.4, 0.8, 1.5 m an axis."""
DRAWS = 4


def main() -> None:
    """Print what generated walks gain, or real ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(111, 119)))
    parser.add_argument("--severity", default="default")
    parser.add_argument("--surveyed", type=int, default=3)
    parser.add_argument("--doubted", type=float, default=walk_ties.DOUBTED, help="factor of the variance of fixes")
    parser.add_argument("--real", type=Path, nargs=2, metavar=("WIFINE", "ILC20"), help="folders of both data sets")
    parser.add_argument("--walks", type=int, default=0, help="real ones: of each floor so many at a time")
    options = parser.parse_args()
    walk_ties.DOUBTED = options.doubted
    if options.real:
        wifine, ilc20 = options.real
        print_real(wifine, ilc20, options.walks)
    else:
        print_generated(options)


def print_generated(options: argparse.Namespace) -> None:
    """Print for each choice of surveyed landmarks the walks without ties and with."""
    floors = [heard_floor(seed, options.severity) for seed in options.seeds]
    print("| surveyed | mapped | walks | mean | inside 68 % | inside 95 % | least | most | ties | gain | worse | fix |")
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


@dataclass(frozen=True)
class Compared:
    """A walk's points (:func:`calibration.points`) without and with ties; what fixes are off, and in their sigmas."""

    without: FloatArray
    tied: FloatArray
    off_m: FloatArray
    square: FloatArray


def heard_floor(seed: int, severity: str) -> tuple[Site, list[RadioScans]]:
    """A floor, whose walks know how noisy their devices' trackers are, and what each of them heard."""
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
    """Map each walk with the constraints from others."""
    strategy = strategy_named("smoother", SETTINGS.mapping)
    return [
        strategy.map(replace(walk.camera, ties=told), walk.log, known)
        for walk, known, told in zip(walks, landmarks, ties, strict=True)
    ]


def gain(found: list[Compared]) -> str:
    """How many walks get constraints, what their mean error falls by, the greatest rise; how good their fixes are."""
    told = [one for one in found if len(one.off_m)]
    if not told:
        return "0 | - | - | -"
    without, tied = (np.array([getattr(one, name)[:, 0].mean() for one in told]) for name in ("without", "tied"))
    everyone = sum(one.without[:, 0].mean() for one in found)
    fell = without - tied
    share = f"{fell.sum() / everyone:.1%} ± {100 * np.sqrt(len(fell)) * fell.std() / everyone:.1f}"
    off_m, square = (np.concatenate([getattr(one, name) for one in told]).mean() for name in ("off_m", "square"))
    return f"{len(told)} | {share} | {-fell.min():+.3f} m | {off_m:.2f} m, {square:.2f}"


def print_real(wifine: Path, ilc20: Path, at_a_time: int) -> None:
    """Print a row for each floor and drift."""
    print("| floor | walks | drift | mean | inside 68 % | inside 95 % | ties | gain | worse | fix |")
    print("| --- " * 10 + "|")
    for name, walks in floors(wifine, ilc20):
        count = at_a_time or len(walks)
        groups = [walks[first : first + count] for first in range(0, len(walks) - count + 1, count)]
        for drift in DRIFTS if groups else ():
            print(f"| {name} | {count} | {drift} | {row(groups, drift)} |", flush=True)


@dataclass(frozen=True)
class RealWalk:
    """A walk at ``n`` moments a metre apart: times (n,), ns, true places (n, 2) and way (n,), metres; its scans."""

    time_ns: IntArray
    place: FloatArray
    way_m: FloatArray
    scans: RadioScans

    @classmethod
    def of(cls, time_ns: IntArray, place: FloatArray, scans: RadioScans) -> RealWalk | None:
        """Thin a path (n, 2); None where it is short."""
        way_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))))
        if way_m[-1] < LANDMARK_M / 2 or len(scans) < walk_ties.FEWEST_FIXES:
            return None
        at_m = np.arange(0.0, way_m[-1], 1.0)
        axes = [np.interp(at_m, way_m, axis) for axis in place.T]
        later_ns = np.interp(at_m, way_m, (time_ns - time_ns[0]).astype(np.float64))
        return cls(time_ns[0] + later_ns.astype(np.int64), np.column_stack(axes), at_m, scans)


def floors(wifine: Path, ilc20: Path) -> Iterator[tuple[str, list[RealWalk]]]:
    """The walks of each floor."""
    for number in (4, 5, 6):
        files = sorted((wifine / "train").glob(f"train_{number}_*.csv"))
        found = [walk for file in files if (walk := wifine_walk(file)) is not None]
        yield f"WiFine {number}", found
    for place in ("site1/F1", "site2/F4"):
        files = sorted((ilc20 / place / "path_data_files").glob("*.txt"))
        yield place, [walk for file in files if (walk := ilc20_walk(file)) is not None]


def wifine_walk(file: Path) -> RealWalk | None:
    """A trajectory: a scan at each place."""
    table = pl.read_csv(file)
    levels = table.select(column for column in table.columns if column.isdecimal()).to_numpy().astype(np.float64)
    time_ns = (table["timestamp"].to_numpy() * 1e9).astype(np.int64)
    scan, column = np.nonzero(levels > -100)
    names = np.array([f"ap{number}" for number in range(levels.shape[1])])
    scans = scans_from_readings(scan, names[column], levels[scan, column], len(levels), time_ns=time_ns)
    return RealWalk.of(time_ns, table.select("x", "y").to_numpy().astype(np.float64), scans)


def ilc20_walk(file: Path) -> RealWalk | None:
    """A walk without a tracker, through all its taps."""
    trace = parse_trace(file.read_bytes(), file.name)
    log = inertial_log(trace.sensors)
    sensed = None if log is None else SensedWalk.of(log)
    if sensed is None or len(trace.taps.time_ns) < 2:
        return None
    usable = np.flatnonzero(sensed.usable(trace.taps))
    taps = replace(
        trace.taps,
        time_ns=trace.taps.time_ns[usable],
        position_bcs=trace.taps.position_bcs[usable],
        name=tuple(trace.taps.name[i] for i in usable.tolist()),
        sigma_m=None,
    )
    if len(usable) < 2:
        return None
    time_s = sensed.signals.time_s
    place = sensed.path(taps, speed_model(), DeadReckoningSettings()).at(time_s)[0]
    time_ns = sensed.signals.start_ns + (time_s * 1e9).astype(np.int64)
    return RealWalk.of(time_ns, place, scans_of(trace.header.get("Model", file.stem), trace.wifi))


def drift_covariance(way_m: FloatArray, drift: float) -> FloatArray:
    """(n, n) of each axis: random walks between landmarks, at which a walk is known."""
    number = np.floor(way_m / LANDMARK_M)
    since_m = way_m - number * LANDMARK_M
    last = number == number[-1]
    whole_m = np.where(last, max(way_m[-1] % LANDMARK_M, 1.0), LANDMARK_M)
    bridge = np.minimum(since_m[:, None], since_m) - np.outer(since_m, since_m) / whole_m
    same = number[:, None] == number
    return np.asarray(drift**2 * np.where(same, np.maximum(bridge, 0.0), 0.0) + KNOWN_M**2 * np.eye(len(way_m)))


def row(groups: list[list[RealWalk]], drift: float) -> str:
    """Figures of all groups of walks with constraints between each other, over some draws of the drift."""
    before, after, inside, told, off_m, square = [], [], [], 0, [], []
    for number, walks in enumerate(groups):
        for draw in range(DRAWS):
            rng = np.random.default_rng((number, draw))
            covariances = [drift_covariance(walk.way_m, drift) for walk in walks]
            errors = [np.linalg.cholesky(one) @ rng.normal(size=(len(one), 2)) for one in covariances]
            traces = [traced(walk, *known) for walk, *known in zip(walks, errors, covariances, strict=True)]
            ties = walk_ties.radio_ties(traces, [walk.scans for walk in walks])
            for walk, error, covariance, one in zip(walks, errors, covariances, ties, strict=True):
                left, known = (error, covariance) if one is None else updated(walk, error, covariance, one)
                before.append(np.hypot(*error.T).mean())
                after.append(np.hypot(*left.T).mean())
                if one is not None:
                    told += 1
                    inside.append((left**2).sum(axis=1) / np.diag(known))
                    fix = one.position_bcs - at(walk, one.time_ns)
                    off_m.append(np.hypot(*fix.T))
                    square.append((fix**2).sum(axis=1) / np.diag(one.covariance_m2).reshape(-1, 2).sum(axis=1))
    gained = np.subtract(before, after)
    share = f"{gained.mean() / np.mean(before):.1%} ± {100 * gained.std() / np.sqrt(len(gained)) / np.mean(before):.1f}"
    if not told:
        return f"{np.mean(before):.2f} m | - | - | 0 % | - | - | -"
    squares = np.concatenate(inside)
    return (
        f"{np.mean(before):.2f} m | {np.mean(squares < 2.279):.0%} | {np.mean(squares < 5.991):.0%} "
        f"| {told / len(before):.0%} | {share} | {-gained.min():+.2f} m "
        f"| {np.concatenate(off_m).mean():.1f} m, {np.concatenate(square).mean():.2f}"
    )


def traced(walk: RealWalk, error: FloatArray, covariance: FloatArray) -> WalkTrace:
    """The constraints that others get from a walk that is off by (n, 2)."""
    place = walk.place + error
    own = np.diag(covariance)[:, None, None] * np.eye(2)
    return WalkTrace(walk.time_ns, place, own, walk.way_m, np.ones(len(place), dtype=np.bool_))


def at(walk: RealWalk, time_ns: IntArray) -> FloatArray:
    """True places (k, 2) at some moments."""
    known, asked = (times - walk.time_ns[0] for times in (walk.time_ns, time_ns))
    return np.column_stack([np.interp(asked, known, axis) for axis in walk.place.T])


def updated(
    walk: RealWalk, error: FloatArray, covariance: FloatArray, ties: PlaceTies
) -> tuple[FloatArray, FloatArray]:
    """Errors (n, 2) and covariance (n, n) of each axis, once ties are used."""
    rows = np.searchsorted(walk.time_ns, ties.time_ns).clip(0, len(error) - 1)
    gain = np.linalg.solve(covariance[np.ix_(rows, rows)] + ties.covariance_m2[::2, ::2], covariance[rows]).T
    seen = ties.position_bcs - at(walk, ties.time_ns)
    return error + gain @ (seen - error[rows]), covariance - gain @ covariance[rows]


if __name__ == "__main__":
    main()
