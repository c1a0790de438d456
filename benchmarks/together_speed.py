"""What ``process --together`` costs: processor time of walks together over that of walks alone, in one run.

python benchmarks/together_speed.py                 8 walks of 3 minutes past 20 landmarks, 5 surveyed
python benchmarks/together_speed.py --sessions 8    twice as many
python benchmarks/together_speed.py --far           past 4 landmarks, all surveyed: others' scans place walks
"""

from __future__ import annotations

import argparse
import csv
import tempfile
import time
from pathlib import Path

from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import simulate

SURVEYED = 5
ROUNDS = 6


def main() -> None:
    """Print processor seconds of both, the least of some rounds taken in turn, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=4, help="walks of each of two phones")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--far", action="store_true", help="4 landmarks, so far apart that scans are asked")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "survey"
        building = BuildingSettings(landmarks=4 if options.far else 20)
        simulate(regular_survey(options.seed, "default", (0,), sessions=options.sessions, building=building), root)
        if not options.far:
            survey_few(root / "floor_0/marker_dict.csv")
        seconds: dict[bool, list[float]] = {False: [], True: []}
        for number in range(ROUNDS):
            for together in seconds:
                start = time.process_time()
                process(root, Path(folder) / f"{together}{number}", ProcessSettings(together=together))
                seconds[together].append(time.process_time() - start)
    alone, together_s = min(seconds[False]), min(seconds[True])
    ratio = together_s / alone
    print(f"{2 * options.sessions} walks: alone {alone:.2f} s, together {together_s:.2f} s, {ratio:.2f} times")


def survey_few(path: Path) -> None:
    """Leave a position to every few landmarks only, so that all walks are mapped alike."""
    head, *rows = csv.reader(path.read_text().splitlines())
    every = len(rows) // SURVEYED
    kept = [row if number % every == 0 else [row[0], "", "", *row[3:]] for number, row in enumerate(rows)]
    path.write_text("\n".join(",".join(row) for row in [head, *kept]) + "\n")


if __name__ == "__main__":
    main()
