"""How well truth is made of raw material: presses identified, leads and the total station's clock found.

The generated copies of the paper's evaluation know at which point each press was made, how early the hand presses and
how late poses are stamped, and what the station's clock is. Presses are identified from each strategy's labels in turn,
to show what bad labels do; an evaluation uses the smoother's for all.

    python benchmarks/truth_made.py                      seeds 1 to 5
    python benchmarks/truth_made.py --seeds 11 12 13
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from functools import reduce
from itertools import combinations
from pathlib import Path

import numpy as np

from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.control_points.press_truth import nearest_point_errors, press_errors, press_truth, walk_error
from vislam2tag.evaluation.reliability import added, coverage_curve, reduce_errors, verdict
from vislam2tag.evaluation.total_station.alignment import StationWalk, align_device
from vislam2tag.evaluation.total_station.frame import StationFrame, fit_frame, shot_points
from vislam2tag.evaluation.total_station.station_file import TRACK_FILE, read_station_track
from vislam2tag.evaluation.truth import read_truth, residuals_at_presses, residuals_at_truth
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.labeling.settings import TruthSettings
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.simulation.choices import Locale
from vislam2tag.simulation.scenario import PlannedSession, Scenario, paper_evaluation
from vislam2tag.simulation.sensors.devices import make_device
from vislam2tag.simulation.survey import simulate, walk_and_track
from vislam2tag.survey.model import SessionRef, Survey

STRATEGIES = ("smoother", "local-corrected", "local", "global-affine")
FEW_WALKS = (1, 2, 3, 5)
EXACT = TruthSettings(press_sigma_s=0.0, press_sigma_m=0.0)
Counts = dict[str, list[tuple[int, int, int, int, int, float, float]]]
Pairs = list[tuple[float, float]]


def main() -> None:
    """Simulate one copy a seed, and print what is found beside what is true."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    options = parser.parse_args()
    counts: Counts = defaultdict(list)
    leads: Pairs = []
    clocks: dict[int, Pairs] = defaultdict(list)
    regions: dict[str, list[ErrorRecord]] = defaultdict(list)
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            scenario = paper_evaluation(seed)
            simulate(scenario, Path(folder) / "survey")
            survey = open_survey(Path(folder) / "survey")
            look_at_presses(scenario, survey, counts, leads)
            look_at_regions(survey, regions)
            look_at_clocks(scenario, survey, clocks)
    print_presses(counts)
    print_regions(regions)
    print_pairs("Leads (s)", {"": leads})
    print_pairs("The station's clock (s), by walks of a device", clocks)


def mapped(ref: SessionRef, session: Session, survey: Survey, strategy: str) -> Trajectory:
    """Map a session with the landmarks of its floor."""
    landmarks = survey.site.landmarks.on_floor(ref.key.floor)
    return strategy_named(strategy, MappingSettings()).map(session.camera, session.landmarks, landmarks)


def look_at_presses(scenario: Scenario, survey: Survey, counts: Counts, leads: Pairs) -> None:
    """Identify the presses of every walk over control points by each strategy's labels."""
    for ref, planned in zip(survey.sessions, planned_as(survey.sessions, scenario), strict=True):
        if not planned.presses:
            continue
        everything = walk_and_track(scenario, planned)[0].pressed_point
        session, floor = read_session(ref), survey.site.floor(ref.key.floor)
        for strategy in STRATEGIES:
            trajectory = mapped(ref, session, survey, strategy)
            truth = press_truth(trajectory, session.presses_ns, floor)
            if strategy == STRATEGIES[0]:
                shared = truth
                device = make_device(ref.key.device, Locale.MIXED, scenario.seed)
                early_s = device.hand.lead_s + planned.tracker.pose_lag_s
                leads.append((truth.lead.lead_s + early_s, truth.lead.sigma_s))
            point = truth.identities.point
            # Presses outside the frames are none of the truth's, and two at a time count once.
            pressed = everything[np.searchsorted(session.presses_ns, truth.time_ns)]
            nearest = nearest_point_errors(trajectory, session.presses_ns, floor)
            places = floor.control_points.position_bcs[everything[np.searchsorted(session.presses_ns, nearest.time_ns)]]
            off = (nearest.truth_bcs != places).any(axis=1) & nearest.labelled
            counts[strategy].append(
                (
                    len(pressed),
                    int((point == pressed).sum()),
                    int(((point >= 0) & (point != pressed)).sum()),
                    int(nearest.labelled.sum()),
                    int(off.sum()),
                    walk_error(press_errors(trajectory, shared).error_m),
                    walk_error(nearest.error_m),
                )
            )


def look_at_regions(survey: Survey, regions: dict[str, list[ErrorRecord]]) -> None:
    """Count the smoother's errors by stated region at the presses of each walk, by what is taken for their sigma, and
    at the walk's true positions.
    """
    for ref in survey.sessions:
        session = read_session(ref)
        if not len(session.presses_ns):
            continue
        points = survey.site.floor(ref.key.floor).control_points.position_bcs
        trajectory = mapped(ref, session, survey, STRATEGIES[0])
        found = {
            "presses, taken for exact": residuals_at_presses(trajectory, session.presses_ns, points, EXACT),
            "presses, with their sigma": residuals_at_presses(trajectory, session.presses_ns, points),
            "true positions": residuals_at_truth(trajectory, read_truth(ref.folder / "truth.csv")),
        }
        for truth, one in found.items():
            regions[truth].append(reduce_errors(truth, one.error_m, one.covariance_m2, one.truth_covariance_m2))


def print_regions(regions: dict[str, list[ErrorRecord]]) -> None:
    """Print one row a truth: the shares of errors inside the regions, and what the report says of them."""
    print("\nRegions that the smoother states, by several truths\n")
    print("| truth | walks | points | mean error | inside 68 % | inside 95 % | truth's part | verdict |")
    print("| --- " * 8 + "|")
    for truth, records in regions.items():
        whole = reduce(added, records)
        points = sum(whole.inside)
        upto, curve = np.cumsum(whole.inside) / points, coverage_curve(whole)
        assert curve is not None
        print(
            f"| {truth} | {len(records)} | {points} | {curve.mean_m[-1]:.2f} m | {upto[67]:.1%} | {upto[94]:.1%} | "
            f"{whole.truth_part / points:.0%} | {verdict(whole) or 'none: cannot tell'} |"
        )


def look_at_clocks(scenario: Scenario, survey: Survey, clocks: dict[int, Pairs]) -> None:
    """Align the walks of each device, all of them and a few at a time."""
    frame = fit_frame(shot_points(survey.root / "floor_4", 4, survey.site.landmarks))
    walks: dict[str, list[StationWalk]] = defaultdict(list)
    truth_ns: dict[str, int] = {}
    for ref, planned in zip(survey.sessions, planned_as(survey.sessions, scenario), strict=True):
        if planned.total_station:
            walks[ref.key.device].append(station_walk(ref, survey, frame))
            station_ns = make_device(ref.key.device, Locale.MIXED, scenario.seed).station_clock_ns
            truth_ns[ref.key.device] = planned.boot_unix_ns + station_ns - round(planned.tracker.pose_lag_s * 1e9)
    for device, all_walks in walks.items():
        for count in FEW_WALKS:
            for some in list(combinations(all_walks, count))[:2]:
                found = align_device(some)
                off_s = (found.adjustment.clock_ns - truth_ns[device]) * 1e-9
                clocks[count].append((off_s, found.clock_sigma_s))


def station_walk(ref: SessionRef, survey: Survey, frame: StationFrame) -> StationWalk:
    """Read a session before the station and map it."""
    reference = mapped(ref, read_session(ref), survey, STRATEGIES[0])
    return StationWalk(reference, read_station_track(ref.folder / TRACK_FILE), frame)


def planned_as(refs: Sequence[SessionRef], scenario: Scenario) -> list[PlannedSession]:
    """The plan of each session."""
    plans = {planned.key: planned for planned in scenario.sessions}
    return [plans[ref.key] for ref in refs]


def print_presses(counts: Counts) -> None:
    """Print one row a strategy: presses by what became of them, and the mean of the walks' errors by both rules."""
    print("\nPresses identified from the labels of each strategy alone, and by the nearest point\n")
    print("| labels of | right | wrong | not clear | nearest wrong | mean error | by the nearest point |")
    print("| --- " * 7 + "|")
    for strategy, rows in counts.items():
        presses, right, wrong, labelled, off = np.array([row[:5] for row in rows]).sum(axis=0)
        error_m, nearest_m = np.nanmean([row[5:] for row in rows], axis=0)
        unclear = presses - right - wrong
        told = f"{right} | {wrong} | {unclear} | {off} of {labelled}"
        print(f"| {strategy} | {told} | {error_m:.2f} m | {nearest_m:.2f} m |")


def print_pairs(title: str, groups: dict[int, Pairs] | dict[str, Pairs]) -> None:
    """Print errors of an estimate beside the sigma that it states."""
    print(f"\n{title}\n\n| | estimates | mean error | RMS error | RMS stated sigma | within 2 sigma |")
    print("| --- " * 6 + "|")
    for name, pairs in groups.items():
        error, sigma = np.array(pairs).T
        rms = [float(np.sqrt(np.mean(one**2))) for one in (error, sigma)]
        within = float(np.mean(np.abs(error) <= 2 * sigma))
        print(f"| {name} | {len(pairs)} | {error.mean():+.3f} | {rms[0]:.3f} | {rms[1]:.3f} | {within:.0%} |")


if __name__ == "__main__":
    main()
