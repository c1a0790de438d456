"""Coverage of the smoother's stated regions on walks of two generators and on real ones, and its convergence.

Errors of all points of a row are pooled; "least" and "most" are the fifths of them with the smallest and the largest
stated sigma. Wanted: 58 to 80 % inside 68 % and 90 to 99 % inside 95 %. A row fails only if the interval of a share
(95 %, bootstrap over walks) misses that band. With five walks or more each share has its standard error, in points.
"Below 75 %" counts the walks with less than that inside their 95 % regions, and "tenth" is the share that a tenth of
the walks do not reach. A walk of a row "together" knows the noise of the survey's other walks.

With ``--convergence`` each walk is also solved without any acceleration, from the same start, until 0.0003 standard
deviations remain. Counted are walks where no frame moves by 0.1 of its sigma, and no sigma changes by 5 %.

    python benchmarks/calibration.py                        100 walks a row
    python benchmarks/calibration.py --seeds 200 --count 12
    python benchmarks/calibration.py --rows mild "twice better"
    python benchmarks/calibration.py --convergence          200 walks
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from data_sets import Walk, every_kth, real_walks, with_tracker
from second_generator import survey_walks

from vislam2tag.common.error_statistics import FEWEST_WALKS, draws, interval, multiplicities
from vislam2tag.core import robust
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import TrackerNoise
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation import smoother
from vislam2tag.estimation.factors import LinearWalk
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.estimation.tracker_errors import noise_of_other_walks
from vislam2tag.quality.evaluation.reliability import region_probability
from vislam2tag.settings import Settings

LANDMARKS = 12
SESSIONS = 6
"""Walks of each device in a row "together"."""
BANDS = ((0.58, 0.80), (0.90, 0.99))
"""Of what 68 % and 95 % regions should hold."""
LEAST_INSIDE = 0.75
ROUNDS = 200
"""Of the bootstrap."""
SETTINGS = Settings().mapping

Rows = dict[str, Callable[[range], Iterable[list[Walk]]]]
"""Surveys by the seeds."""


def main() -> None:
    """Print one row for each kind of walk."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=300, help="the first")
    parser.add_argument("--count", type=int, default=50, help="how many; two walks each")
    parser.add_argument("--rows", nargs="+", default=[""], help="only rows whose names hold one of these")
    parser.add_argument("--convergence", action="store_true", help="compare with solutions without acceleration")
    options = parser.parse_args()
    seeds = range(options.seeds, options.seeds + options.count)
    if options.convergence:
        print_convergence(seeds)
        return
    print("| walks | number | mean | inside 68 % | inside 95 % | least | most | in band | below 75 % | tenth |")
    print("| --- " * 10 + "|")
    for name, walks in ROWS.items():
        if any(part in name for part in options.rows):
            found = [one for survey in walks(seeds) for one in mapped(survey, together="together" in name)]
            print(f"| {name} | {row([one for one in found if len(one)])} |", flush=True)


def row(found: list[FloatArray]) -> str:
    """All figures of the points (n, 3) of each walk that has any."""
    if not found:
        return " | ".join("-" * 9)
    whole, drawn = scattered(found)
    band = in_band(drawn) if len(found) >= FEWEST_WALKS else "-"
    return " | ".join((described(found, whole, drawn), band, *by_walk(found)))


def simulated(times: float, severity: str) -> Callable[[range], Iterator[list[Walk]]]:
    """Simulated walks at a severity with a tracker so many times as noisy."""
    return lambda seeds: ([walk] for walk in with_tracker(seeds, times, severity, LANDMARKS))


def simulated_surveys(times: float, severity: str) -> Callable[[range], Iterator[list[Walk]]]:
    """The same by survey, with several walks of each device."""
    return lambda seeds: (
        list(with_tracker([seed], times, severity, LANDMARKS, SESSIONS)) for seed in seeds[: -(-len(seeds) // SESSIONS)]
    )


def of_second(phone: str, *, few: bool = False, survey_m: float = 0.02) -> Callable[[range], Iterator[list[Walk]]]:
    """Surveys of the second generator, also with ``few`` landmarks and short walks."""
    landmarks, seconds = (5, 90.0) if few else (12, 180.0)
    return lambda seeds: (
        list(survey_walks(seed, phone, SESSIONS, landmarks, survey_m, seconds))
        for seed in seeds[: -(-len(seeds) // (SESSIONS // 2))]
    )


ROWS: Rows = {
    "simulator, mild": simulated(1.0, "mild"),
    "simulator, default": simulated(1.0, "default"),
    "simulator, severe": simulated(1.0, "severe"),
    "simulator, tracker twice better": simulated(0.5, "default"),
    "simulator, tracker twice worse": simulated(2.0, "default"),
    "simulator, default, together": simulated_surveys(1.0, "default"),
    "simulator, severe, together": simulated_surveys(1.0, "severe"),
    "simulator, tracker twice better, together": simulated_surveys(0.5, "default"),
    **{f"second generator, {phone}": of_second(phone) for phone in ("good", "default", "severe")},
    **{f"second generator, {phone}, together": of_second(phone) for phone in ("good", "default", "severe")},
    "second generator, good, few landmarks": of_second("good", few=True),
    "second generator, good, few landmarks, together": of_second("good", few=True),
    "second generator, good, few exact landmarks, together": of_second("good", few=True, survey_m=0.0),
    "real": lambda _: ([walk] for walk in real_walks()),
    "real, every 3rd landmark": lambda _: ([walk] for walk in every_kth(real_walks(), 3)),
    "real, every 5th landmark": lambda _: ([walk] for walk in every_kth(real_walks(), 5)),
}


def mapped(survey: list[Walk], *, together: bool) -> Iterator[FloatArray]:
    """Points of each walk of a survey."""
    strategy = strategy_named("smoother", SETTINGS)
    for walk, tracker in zip(survey, shared_noise(survey) if together else [None] * len(survey), strict=True):
        yield points(walk, strategy.map(replace(walk.camera, tracker=tracker), walk.log, walk.landmarks))


def shared_noise(survey: list[Walk]) -> list[TrackerNoise | None]:
    """For each walk what the others show, each in its own frame, as ``process --together`` does."""
    noise = [smoother.solve_in_own_frame(observed(walk)).noise.evidence for walk in survey]
    return noise_of_other_walks([walk.device for walk in survey], noise)


def observed(walk: Walk) -> WalkObservations:
    """What the smoother takes from a walk."""
    return WalkObservations.of(
        walk.camera, walk.log, SETTINGS.smoother.sighting_range_m, surveyed=walk.landmarks.surveyed_ids
    )


def points(walk: Walk, trajectory: Trajectory) -> FloatArray:
    """Of each labelled point (n, 3): error and sigma, metres, and the probability of the region that just holds it."""
    residuals = walk.residuals(trajectory)
    error = np.linalg.norm(residuals.error_m, axis=1)
    sigma = np.sqrt(np.trace(residuals.covariance_m2, axis1=1, axis2=2) / 2)
    inside = region_probability(residuals.error_m, residuals.covariance_m2 + residuals.truth_covariance_m2)
    every = np.column_stack((error, sigma, inside))
    return np.asarray(every[np.isfinite(every).all(axis=1)])


def cells(walks: Iterable[FloatArray]) -> str:
    """Figures of the points (n, 3) of each walk as :func:`points` gives them."""
    found = [one for one in walks if len(one)]
    if not found:
        return "- | - | - | - | - | -"
    return described(found, *scattered(found))


def described(found: list[FloatArray], whole: list[float], drawn: FloatArray) -> str:
    """Number of walks, mean error, and shares of the ``whole`` with their standard errors."""
    spread = [f" ± {100 * one:.0f}" if len(found) >= FEWEST_WALKS else "" for one in np.std(drawn, axis=0)]
    texts = [f"{share:.{digits}%}{off}" for share, digits, off in zip(whole, (1, 1, 0, 0), spread, strict=True)]
    return f"{len(found)} | {np.concatenate(found)[:, 0].mean():.3f} m | {' | '.join(texts)}"


def scattered(found: list[FloatArray]) -> tuple[list[float], FloatArray]:
    """:func:`shares` of the points of all walks, and of walks drawn with replacement (r, 4)."""
    every, walk = np.concatenate(found), np.repeat(np.arange(len(found)), [len(one) for one in found])
    order = np.argsort(every[:, 1], kind="stable")
    inside, walk = every[order, 2], walk[order]
    drawn = [shares(inside, times[walk]) for times in multiplicities(draws(len(found)))[:ROUNDS]]
    return shares(inside, np.ones(len(inside))), np.array(drawn)


def in_band(drawn: FloatArray) -> str:
    """Whether the intervals of both shares, by draws (r, 4), touch their bands."""
    bounds = [interval(column) for column in drawn[:, :2].T]
    inside = [
        bound is not None and bound[0] <= high and bound[1] >= low
        for bound, (low, high) in zip(bounds, BANDS, strict=True)
    ]
    return "yes" if all(inside) else "no"


def by_walk(found: list[FloatArray]) -> tuple[str, str]:
    """How many walks hold too little in their 95 % regions, and the share that a tenth of the walks do not reach."""
    held = np.array([np.mean(one[:, 2] < 0.95) for one in found])
    return f"{(held < LEAST_INSIDE).sum()} of {len(held)}", f"{np.quantile(held, 0.1):.0%}"


def shares(inside: FloatArray, times: FloatArray) -> list[float]:
    """Inside 68 % and 95 % of all points (n,), ascending by sigma, each counted so many ``times`` (n,); inside 68 % of
    the first and the last fifth."""
    rank = (np.cumsum(times) - times / 2) / times.sum()
    of_all, least, most = times, times * (rank < 0.2), times * (rank > 0.8)
    wanted = ((0.68, of_all), (0.95, of_all), (0.68, least), (0.68, most))
    return [float(np.average(inside < share, weights=weight)) for share, weight in wanted]


def print_convergence(seeds: range) -> None:
    """Print how many walks end close to the limit, and after how many rounds."""
    logging.disable(logging.WARNING)
    print("| walks | number | close | converged | rounds: median | 90 % | most | without: median | 90 % | most |")
    print("| --- " * 10 + "|")
    for name, walks in {
        "simulator, default": with_tracker(seeds, 1.0, "default", LANDMARKS),
        "simulator, severe": with_tracker(seeds, 1.0, "severe", LANDMARKS),
    }.items():
        found = [one for walk in walks if (one := convergence(walk)) is not None]
        close, converged, ours, reference = np.array(found, dtype=np.float64).T
        rounds = [f"{np.quantile(count, share):.0f}" for count in (ours, reference) for share in (0.5, 0.9, 1.0)]
        shares = f"{close.mean():.1%} | {converged.mean():.1%}"
        print(f"| {name} | {len(found)} | {shares} | {' | '.join(rounds)} |", flush=True)


def convergence(walk: Walk) -> tuple[bool, bool, int, int] | None:
    """Whether a walk is close to its limit, and is said to be; the solutions it took, and those of the reference."""
    observations = observed(walk)
    start = smoother.first_problem(observations, LandmarkPriors.of(observations.ids, walk.landmarks))
    if start is None:
        return None
    ours, rounds = counted(start)
    limit, more = without_acceleration(start)
    moved, changed = apart(ours, limit)
    return moved < 0.1 and changed < 0.05, ours.unreached_sigmas == 0, rounds, more


def without_acceleration(start: LinearWalk) -> tuple[smoother.SolvedWalk, int]:
    """:func:`counted` with steps as re-weighting says, much closer to the limit."""
    short_steps = patch.multiple(smoother, LONGER=1.0, MOST_ROUNDS=2000, CONVERGED_SIGMAS=3e-4)
    with patch.object(robust, "LONGEST", 1.0), short_steps:
        return counted(start)


def apart(ours: smoother.SolvedWalk, limit: smoother.SolvedWalk) -> tuple[float, float]:
    """Largest distance of a frame from where it is in the limit, in sigmas, and largest relative change of a sigma."""
    (path, covariance, _), (limit_path, limit_covariance, _) = smoother.mapped_path(ours), smoother.mapped_path(limit)
    sigma, limit_sigma = (np.sqrt(np.trace(each, axis1=1, axis2=2) / 2) for each in (covariance, limit_covariance))
    moved = np.linalg.norm(path - limit_path, axis=1) / limit_sigma
    return float(moved.max()), float(np.abs(sigma / limit_sigma - 1).max())


def counted(start: LinearWalk) -> tuple[smoother.SolvedWalk, int]:
    """A walk's solution, and how many linear problems were solved for it."""
    with patch.object(smoother, "solve", wraps=solve) as solved:
        return smoother.relinearise_until_converged(start), solved.call_count


if __name__ == "__main__":
    main()
