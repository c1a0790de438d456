"""How often ``evaluate`` names a control point that is not where its file says.

Surveys like the paper's (24 walks of two phones on two floors, which press at control points). Without a fault,
whatever is named is a false alarm; then each point that was pressed at is moved, one at a time, in a direction drawn
at random: what its presses are off by changes by that. "Possible" is what the best test names whose false alarms are
2 % of floors, were errors normal with the sigma stated, and were they as large as those of points without a fault are.

    python benchmarks/odd_control_points.py --seeds 41 42
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from odd_one_out import drawn, power

from vislam2tag.core.arrays import FloatArray
from vislam2tag.evaluation.control_points.odd_points import (
    FEWEST_SESSIONS,
    PooledOffset,
    PressOffset,
    odd_points,
    pooled_offsets,
)
from vislam2tag.pipeline.labels.evaluating.evaluate import evaluate
from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import simulate

SIZES_M = (1.0, 0.5)
Presses = list[tuple[int, Sequence[PressOffset]]]
"""Of each session its floor and what its presses are off by."""


def main() -> None:
    """Print false alarms, and for each size how often the point that was moved is named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[41, 42])
    parser.add_argument("--severity", default="default")
    options = parser.parse_args()
    surveys = [pressed(seed, options.severity) for seed in options.seeds]
    alarms = [odd.summary for presses in surveys for odd in odd_points(presses)]
    clean = [compared_points(presses) for presses in surveys]
    squares = [abs(one.offset / one.sigma_m) ** 2 / 2 for found in clean for one in found.values()]
    times = float(np.sqrt(np.mean(squares)))
    print(f"no fault: {len(alarms)} of {len(squares)} points named; off by {times:.2f} times sigma", *alarms, sep="\n")
    print("| fault | injected | named | possible | possible, as far off as they are | others named too |")
    print("| --- " * 6 + "|")
    rng = np.random.default_rng(0)
    for size_m in SIZES_M:
        named: list[bool] = []
        others: list[int] = []
        best: list[FloatArray] = []
        for presses, found in zip(surveys, clean, strict=True):
            for place, one in found.items():
                odd = {(one.floor, one.point) for one in odd_points(moved(presses, place, drawn(size_m, rng)))}
                named.append(place in odd)
                others.append(len(odd - {place}))
                compared = sum(floor == place[0] for floor, _ in found)
                best.append(power(size_m / one.sigma_m / np.array([1.0, times]), compared))
        shares = " | ".join(f"{share:.0%}" for share in (np.mean(named), *np.mean(best, axis=0)))
        print(f"| control point, {size_m} m | {len(named)} | {shares} | {np.mean(others):.2f} |", flush=True)


def pressed(seed: int, severity: str) -> Presses:
    """Simulate a survey, evaluate it, and return what its presses are off by."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        simulate(paper_evaluation(seed, severity), root)
        found = evaluate(root, Path(folder) / "evaluation", strategies=("smoother",))
    return [(session.floor, session.presses) for session in found.sessions if session.presses]


def compared_points(presses: Presses) -> dict[tuple[int, str], PooledOffset]:
    """What the presses at each point are off by, of points at which enough sessions pressed."""
    return {place: one for place, one in pooled_offsets(presses).items() if one.sessions >= FEWEST_SESSIONS}


def moved(presses: Presses, place: tuple[int, str], shift: complex) -> Presses:
    """The same had the file put one point elsewhere."""
    return [
        (
            floor,
            [
                one.model_copy(update={"x_m": one.x_m - shift.real, "y_m": one.y_m - shift.imag})
                if (floor, one.point) == place
                else one
                for one in made
            ],
        )
        for floor, made in presses
    ]


if __name__ == "__main__":
    main()
