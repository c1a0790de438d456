"""Time that the smoother takes against DuckDB, which only turns the same session's raw files into Parquet.

The session is generated: 15 minutes at 30 Hz (27,000 frames) past 15 landmarks. DuckDB (two threads) reads and writes
the files; the smoother maps the session that was read from them: noise estimation, re-weighting, covariances of all
frames, heights and contradictions, with its linear algebra in one thread as ``process`` has it. Both run in turn in one
process; the median of the pairs' ratios is printed, then the time a frame for sessions of 5 to 40 minutes.

    python benchmarks/smoother_speed.py
    python benchmarks/smoother_speed.py --repeats 3 --minutes 5 10
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median

from data_sets import Walk, walks_of
from measure import seconds
from process_speed import convert
from threadpoolctl import threadpool_limits

from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.simulation.choices import Locale
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import WritingOptions, simulate

COMPARED_MINUTES = 15
LANDMARKS = 15


def main() -> None:
    """Simulate the sessions, time them, print ratio and growth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--minutes", type=float, nargs="+", default=[5, 10, 20, 40])
    options = parser.parse_args()
    with threadpool_limits(limits=1), tempfile.TemporaryDirectory() as folder:
        compare(Path(folder), options.repeats)
        print("\n| minutes | frames | landmark rows | passes | mapping, s | microseconds a frame |")
        print("| --- " * 6 + "|")
        for minutes in options.minutes:
            grow(Path(folder), minutes, options.repeats)


def simulated(folder: Path, minutes: float) -> tuple[Path, Walk]:
    """Write one session of this length, and read it back."""
    root = folder / f"{minutes:g}"
    building = BuildingSettings(landmarks=LANDMARKS)
    scenario = regular_survey(
        1, floors=(0,), devices=("LG",), sessions=1, duration_s=60 * minutes + 1, building=building
    )
    simulate(scenario, root, WritingOptions(locale=Locale.DE))
    (walk,) = walks_of(root, truth_at_frames=True)
    return root, walk


def mapping(walk: Walk) -> Callable[[], None]:
    """What is timed: the strategy alone."""
    strategy = strategy_named("smoother", MappingSettings())

    def work() -> None:
        strategy.map(walk.camera, walk.log, walk.landmarks)

    return work


def compare(folder: Path, repeats: int) -> None:
    """Print the ratio of the smoother's time to DuckDB's, with the range of the pairs."""
    root, walk = simulated(folder, COMPARED_MINUTES)
    (folder / "parquet").mkdir()
    work = mapping(walk)
    work()
    convert(str(root), str(folder / "parquet"))
    pairs = [(seconds(convert, str(root), str(folder / "parquet")), seconds(work)) for _ in range(repeats)]
    ratios = [ours / theirs for theirs, ours in pairs]
    print(f"{len(walk.camera.time_ns)} frames, {len(walk.log.ids)} landmarks, {len(walk.log.frame)} landmark rows")
    print(f"DuckDB {median(t for t, _ in pairs):.3f} s, smoother {median(t for _, t in pairs):.3f} s (medians)")
    print(f"smoother / DuckDB = {median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}, {repeats} pairs)")


def grow(folder: Path, minutes: float, repeats: int) -> None:
    """Print one row of the table of growth."""
    _, walk = simulated(folder, minutes)
    work = mapping(walk)
    least = min(seconds(work) for _ in range(repeats))
    frames = len(walk.camera.time_ns)
    visits = len(strategy_named("smoother", MappingSettings()).map(walk.camera, walk.log, walk.landmarks).visits)
    cells = f"{minutes:g} | {frames} | {len(walk.log.frame)} | {visits} | {least:.3f} | {1e6 * least / frames:.1f}"
    print(f"| {cells} |")


if __name__ == "__main__":
    main()
