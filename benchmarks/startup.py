"""Start-up: processor time of help, version and imports, beside Python itself and the libraries, in the same run.

python benchmarks/startup.py
python benchmarks/startup.py --repeats 11
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys

from measure import ENVIRONMENT

from vislam2tag.cli.app import COMMANDS

NOTHING = ("-c", "pass")
LIBRARIES = ("-c", "import polars, numpy, pydantic")
OF_LABELS = ("process", "check", "evaluate", "build_dataset")
"""Names of the interface whose import is timed: what each of them loads, it needs."""


def main() -> None:
    """Run everything in turn, several times, and print medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    commands = [name for group in COMMANDS.values() for name in group]
    helps = [
        ("-m", "vislam2tag", *words) for words in (("--version",), ("--help",), *((n, "--help") for n in commands))
    ]
    imports = [("-c", "import vislam2tag.api"), *(("-c", f"from vislam2tag.api import {name}") for name in OF_LABELS)]
    runs = [NOTHING, LIBRARIES, *helps, *imports]
    times: dict[tuple[str, ...], list[float]] = {run: [] for run in runs}
    for _ in range(repeats):
        for run in runs:
            times[run].append(processor_seconds(run))
    median_s = {run: statistics.median(of_run) for run, of_run in times.items()}
    print(f"{'processor time, medians':<52}{'s':>7}{'of Python':>12}{'of libraries':>14}")
    for run in runs:
        text = " ".join(run[1:])
        print(f"{text:<52}{median_s[run]:7.3f}{median_s[run] / median_s[NOTHING]:12.1f}", end="")
        print(f"{median_s[run] / median_s[LIBRARIES]:14.2f}")


def processor_seconds(arguments: tuple[str, ...]) -> float:
    """Processor seconds, user's and system's, of Python with these arguments."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=ENVIRONMENT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
