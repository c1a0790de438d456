"""Peak memory of ``vislam2tag process --jobs 2``, all processes together, for few and for many sessions.

Sessions stream, so that 160 of them should need no more memory than 20 (at most 1.1 times).

    python benchmarks/memory.py                            20 and 160 sessions of 1 minute
    python benchmarks/memory.py --minutes 3 --repeats 1
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from measure import process, vislam2tag, watched

FLOORS = 5
DEVICES = 4
SESSIONS = (1, 8)
"""Sessions on each floor with each device: 20 and 160 in all."""


def main() -> None:
    """Simulate both surveys, process them in turn, print peaks and their ratio."""
    options = _options()
    with tempfile.TemporaryDirectory() as folder:
        surveys = [_simulate(Path(folder), sessions, options.minutes) for sessions in SESSIONS]
        runs = [
            [watched(process, survey, Path(folder) / "labels") for survey in surveys] for _ in range(options.repeats)
        ]
    for name in ("resident_mb", "unique_mb"):
        few, many = (max(getattr(run, name) for run in survey) for survey in zip(*runs, strict=True))
        print(f"{name}: {few:.0f} for 20 sessions, {many:.0f} for 160: {many / few:.2f} times")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="length of each session")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each; the highest peak counts")
    return parser.parse_args()


def _simulate(folder: Path, sessions: int, minutes: float) -> Path:
    survey = folder / f"survey{sessions}"
    size = ["--floors", str(FLOORS), "--devices", str(DEVICES), "--sessions", str(sessions)]
    vislam2tag("simulate", str(survey), *size, "--minutes", str(minutes), "--seed", "1")
    return survey


if __name__ == "__main__":
    main()
