"""Speed and memory of ``vislam2tag dataset`` beside ``vislam2tag process`` on the survey of process_speed.py.

Both run with two processes, in turn, each into a new folder; the median ratio of their times is printed, and that of
the processor's times, which other work on the machine disturbs less. Then the peak memory of all processes of
``dataset`` together for 20 and for 80 of such sessions.

    python benchmarks/dataset_speed.py                     5 floors x 4 devices x 4 sessions of 3 minutes, and a quarter
    python benchmarks/dataset_speed.py --repeats 1
"""

from __future__ import annotations

import argparse
import resource
import shutil
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path

from measure import process, seconds, vislam2tag, watched

FLOORS, DEVICES, MINUTES = 5, 4, 3.0
SESSIONS = (1, 4)
"""Sessions on each floor with each device: 20 and 80 in all."""


def main() -> None:
    """Simulate both surveys, label and build them, print ratios and peaks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5, help="pairs of runs, and runs for the highest peak")
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as folder:
        few, many = (_survey(Path(folder), sessions) for sessions in SESSIONS)
        pairs = [_pair(many, Path(folder)) for _ in range(repeats)]
        for name, ratios in zip(("time", "processor's time"), zip(*pairs, strict=True), strict=True):
            median = statistics.median(ratios)
            print(f"dataset / process, {name}: {median:.2f} ({min(ratios):.2f} to {max(ratios):.2f}, {repeats} pairs)")
        process(few, _labels(few))
        peaks = [[watched(_build, survey, Path(folder)) for survey in (few, many)] for _ in range(repeats)]
    for unit in ("resident_mb", "unique_mb"):
        low, high = (max(getattr(run, unit) for run in runs) for runs in zip(*peaks, strict=True))
        print(f"{unit}: {low:.0f} for 20 sessions, {high:.0f} for 80: {high / low:.2f} times")


def _survey(folder: Path, sessions: int) -> Path:
    survey = folder / f"survey{sessions}"
    size = ["--floors", str(FLOORS), "--devices", str(DEVICES), "--sessions", str(sessions)]
    vislam2tag("simulate", str(survey), *size, "--minutes", str(MINUTES), "--locale", "de", "--seed", "1")
    return survey


def _labels(survey: Path) -> Path:
    return survey.with_name(f"{survey.name}-labels")


def _build(survey: Path, folder: Path) -> None:
    """Build the data set of a labelled survey into a new folder."""
    shutil.rmtree(folder / "set", ignore_errors=True)
    vislam2tag("dataset", str(_labels(survey)), "--out", str(folder / "set"), "--jobs", "2")


def _pair(survey: Path, folder: Path) -> tuple[float, float]:
    """Label, then build: times of the second over the first, by the clock and by the processor."""
    labelling = _both_clocks(lambda: process(survey, _labels(survey)))
    building = _both_clocks(lambda: _build(survey, folder))
    return building[0] / labelling[0], building[1] / labelling[1]


def _both_clocks(work: Callable[[], None]) -> tuple[float, float]:
    before = _processor_s()
    elapsed_s = seconds(work)
    return elapsed_s, _processor_s() - before


def _processor_s() -> float:
    """Seconds that all ended child processes have calculated."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
