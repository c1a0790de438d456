"""Speed of ``vislam2tag process`` against DuckDB, which only turns the same raw files into Parquet.

DuckDB (two threads) converts sensors, initPoses, poses and wifi files of the whole survey, one COPY a table with typed
columns; ``process`` (two processes) reads the same files, maps, labels and writes everything. Both run in turn; the
median ratio and the peak memory of all processes are printed.

    python benchmarks/process_speed.py                     5 floors x 4 devices x 4 sessions of 3 minutes
    python benchmarks/process_speed.py --floors 1 --repeats 1
    python benchmarks/process_speed.py --least            also what no program with these outputs can leave out
"""

from __future__ import annotations

import argparse
import hashlib
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import duckdb
import polars as pl
from measure import process, seconds, vislam2tag, watched

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
        for strategy in options.strategy or ["smoother"]:
            _compare(survey, Path(folder), strategy, options.repeats)
        if options.least:
            _least(survey, Path(folder), options.repeats)
        if options.long:
            _long_session(Path(folder), options.repeats)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--floors", type=int, default=5)
    parser.add_argument("--sessions", type=int, default=4)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--strategy", action="append", help="of process, repeatable (default: smoother)")
    parser.add_argument("--least", action="store_true", help="also parsing, hashing and writing alone")
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


def _compare(survey: Path, folder: Path, strategy: str, repeats: int) -> None:
    def convert() -> None:
        _duckdb(survey, folder / "duckdb")

    def label() -> None:
        process(survey, folder / "labels", strategy=strategy)

    ratio = _ratio(label, convert, repeats)
    memory = watched(label)
    print(f"survey: {sum(1 for _ in survey.glob('floor_*/*/*/poses.csv'))} sessions, {_megabytes(survey):.0f} MB raw")
    print(f"  process ({strategy}) / DuckDB = {ratio}; peak memory of all processes {memory.resident_mb:.0f} MB")


def _least(survey: Path, folder: Path, repeats: int) -> None:
    """Two processes that only parse, hash and write the sessions' tables, against DuckDB."""
    out, one_thread = folder / "least", {**os.environ, "POLARS_MAX_THREADS": "1"}

    def least() -> None:
        command = [sys.executable, __file__, "least", str(survey), str(out)]
        halves = [subprocess.Popen([*command, half], env=one_thread) for half in "01"]
        if sum(half.wait() for half in halves):
            raise SystemExit("a half failed")

    ratio = _ratio(least, lambda: _duckdb(survey, folder / "duckdb"), repeats)
    print(f"parsing, SHA-256 and writing alone, in two processes / DuckDB = {ratio}")


def least(survey: str, out: str, half: str) -> None:
    """Parse and hash every second session's files with Polars; write sensors, Wi-Fi and poses with columns for labels.

    No line is checked, nothing mapped: the labels are other columns' values.
    """
    types = {"BIGINT": pl.Int64, "DOUBLE": pl.Float64, "VARCHAR": pl.String, "INTEGER": pl.Int32}
    schemas = {
        table: {name: types[kind] for name, kind in (column.split() for column in columns.split(", "))}
        for table, columns in COLUMNS.items()
    }
    labels = {"sensors": ("v1", "v2", "v3"), "poses": ("tx", "ty", "tz"), "wifi": ("t", "t", "t")}
    for table in labels:
        Path(out, table).mkdir(parents=True, exist_ok=True)
    for session in sorted(Path(survey).glob("floor_*/*/*"))[int(half) :: 2]:
        for table, schema in schemas.items():
            data = (session / f"{table}.csv").read_bytes()
            hashlib.sha256(data).hexdigest()
            rows = pl.read_csv(
                data, separator=";", has_header=False, schema=schema, quote_char=None, decimal_comma=b"," in data
            )
            if table in labels:
                x, y, sigma = (pl.col(name).cast(pl.Float64) for name in labels[table])
                rows = rows.with_columns(x.alias("x"), y.alias("y"), sigma.alias("sigma"), status=pl.lit("ok"))
                name = f"{session.parent.parent.name}_{session.parent.name}_{session.name}.parquet"
                rows.write_parquet(Path(out, table, name), compression="snappy")


def _long_session(folder: Path, repeats: int) -> None:
    """One session of 15 minutes against five of 3 minutes, each processed by one process."""
    for name, sessions, minutes in (("five", 5, 3.0), ("one", 1, 15.0)):
        vislam2tag("simulate", str(folder / name), *_simulation(1, 1, sessions, minutes))

    def label(name: str) -> Callable[[], None]:
        return lambda: process(folder / name, folder / "labels", 1)

    ratio = _ratio(label("one"), label("five"), repeats)
    raw = _megabytes(folder / "one") / _megabytes(folder / "five")
    print(f"one session of 15 minutes / five of 3 minutes = {ratio}; raw data {raw:.2f}")


def _ratio(work: Callable[[], None], reference: Callable[[], None], repeats: int) -> str:
    """Time of ``work`` over that of ``reference``, run in turn: median of the pairs' ratios, and their range."""
    ratios = []
    for _ in range(repeats):
        reference_s = seconds(reference)
        ratios.append(seconds(work) / reference_s)
    return f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}, {repeats} pairs)"


def _megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*.csv")) / 1e6


def dispatch(arguments: Sequence[str]) -> None:
    """Dispatch: the script calls itself for what runs in processes of its own."""
    if arguments[:1] == ["convert"]:
        convert(*arguments[1:])
    elif arguments[:1] == ["least"]:
        least(*arguments[1:])
    else:
        main()


if __name__ == "__main__":
    dispatch(sys.argv[1:])
