"""Speed of ``vislam2tag process`` against DuckDB, which only turns the same raw files into Parquet.

DuckDB (two threads) converts sensors, initPoses, poses and wifi files of the whole survey, one COPY a table with typed
columns; ``process`` (two processes) reads the same files, maps, labels and writes everything. Both run in turn; the
ratio of the median times and the peak memory of all processes are printed.

    python benchmarks/process_speed.py                     5 floors x 4 devices x 4 sessions of 3 minutes
    python benchmarks/process_speed.py --floors 1 --repeats 1
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import duckdb
from measure import process, timed, vislam2tag

POSE = "tx DOUBLE, ty DOUBLE, tz DOUBLE, qx DOUBLE, qy DOUBLE, qz DOUBLE, qw DOUBLE"
COLUMNS = {
    "sensors": "t BIGINT, sensor VARCHAR, v1 DOUBLE, v2 DOUBLE, v3 DOUBLE, v4 DOUBLE, v5 DOUBLE, v6 DOUBLE",
    "initPoses": f"id VARCHAR, t BIGINT, {POSE}",
    "poses": f"t BIGINT, {POSE}",
    "wifi": "scan INTEGER, t BIGINT, kind VARCHAR, ssid VARCHAR, bssid VARCHAR, rss INTEGER",
}


def main() -> None:
    """Simulate the survey, run both programs in turn, print the ratio."""
    options = _options()
    with tempfile.TemporaryDirectory() as folder:
        survey = Path(folder) / "survey"
        vislam2tag("simulate", str(survey), *_simulation(options.floors, 4, options.sessions, 3.0))
        _compare("survey", survey, Path(folder), options.repeats)
        if options.long:
            _long_session(Path(folder), options.repeats)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--floors", type=int, default=5)
    parser.add_argument("--sessions", type=int, default=4)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--long", action="store_true", help="also one session of 15 minutes against five of 3")
    return parser.parse_args()


def _simulation(floors: int, devices: int, sessions: int, minutes: float) -> list[str]:
    size = ["--floors", str(floors), "--devices", str(devices), "--sessions", str(sessions)]
    return [*size, "--minutes", str(minutes), "--locale", "de", "--seed", "1"]


def _duckdb(survey: Path, out: Path) -> None:
    """Convert the survey's files in a process of its own, as ``process`` runs in its own."""
    out.mkdir(exist_ok=True)
    subprocess.run([sys.executable, __file__, "convert", str(survey), str(out)], check=True)


def convert(survey: str, out: str) -> None:
    """Turn the raw files of a survey into four Parquet files with DuckDB on two threads."""
    connection = duckdb.connect()
    connection.execute("SET threads = 2")
    for table, columns in COLUMNS.items():
        types = ", ".join(f"'{name}': '{kind}'" for name, kind in (column.split() for column in columns.split(", ")))
        connection.execute(
            f"COPY (SELECT * FROM read_csv('{survey}/floor_*/*/*/{table}.csv', delim='; ', header=false, quote='', "
            f"decimal_separator=',', columns={{{types}}})) TO '{out}/{table}.parquet' (FORMAT parquet)"
        )


def _compare(name: str, survey: Path, folder: Path, repeats: int) -> None:
    convert_s, process_s, peaks = [], [], []
    for _ in range(repeats):
        convert_s.append(timed(_duckdb, survey, folder / "duckdb").seconds)
        run = timed(process, survey, folder / "labels")
        process_s.append(run.seconds)
        peaks.append(run.resident_mb)
    ratio = statistics.median(process_s) / statistics.median(convert_s)
    print(f"{name}: {sum(1 for _ in survey.glob('floor_*/*/*/poses.csv'))} sessions, {_megabytes(survey):.0f} MB raw")
    print(f"  process / DuckDB = {ratio:.2f} (median of {repeats}); peak memory of all processes {max(peaks):.0f} MB")


def _long_session(folder: Path, repeats: int) -> None:
    """One session of 15 minutes against five of 3 minutes, each processed by one process."""
    times = {}
    for name, sessions, minutes in (("five", 5, 3.0), ("one", 1, 15.0)):
        vislam2tag("simulate", str(folder / name), *_simulation(1, 1, sessions, minutes))
        runs = [timed(process, folder / name, folder / "labels", 1).seconds for _ in range(repeats)]
        times[name] = statistics.median(runs)
    print(f"one session of 15 minutes / five of 3 minutes = {times['one'] / times['five']:.2f}")


def _megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*.csv")) / 1e6


def dispatch(arguments: Sequence[str]) -> None:
    """Dispatch: the script calls itself for DuckDB's part."""
    if arguments[:1] == ["convert"]:
        convert(*arguments[1:])
    else:
        main()


if __name__ == "__main__":
    dispatch(sys.argv[1:])
