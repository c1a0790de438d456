"""Time and memory of the command line, compared with the unavoidable part; one subcommand for each measurement.

- ``process``: DuckDB (two threads) converts the same raw files to Parquet, one COPY for each table with typed columns.
  ``vislam2tag process`` (two processes) reads, maps, labels and writes everything.
- ``dataset``: ``vislam2tag dataset`` and ``process`` on the same survey, also by processor time, which other work on
  the
  machine disturbs less; then its memory.
- ``import``: a wide table of UJIIndoorLoc's size is parsed by ``polars.read_csv``, and read and written as tables of a
  data set. Then traces of the Indoor Location Competition 2.0, repeated over more and more floors, are imported.
- ``memory``: sessions stream, so that 160 should need at most 1.1 times the memory of 20.

Both programs run in turn; printed are the median ratio, its range and the peak memory of all processes together.

    python benchmarks/speed.py process                     5 floors x 4 devices x 4 sessions of 3 minutes
    python benchmarks/speed.py process --floors 1 --repeats 1
    python benchmarks/speed.py process --least             also what no program with these outputs can leave out
    python benchmarks/speed.py dataset                     the same survey, and a quarter of it
    python benchmarks/speed.py import ../shared/data/ilc20
    python benchmarks/speed.py memory                      20 and 160 sessions of 1 minute
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
import psutil

FLOORS, DEVICES = 5, 4
FEW, MANY, MOST = 1, 4, 8
"""Sessions on each floor with each device: 20, 80 and 160 in all."""
SAMPLING_S = 0.02
UNIQUE_EVERY = 10
"""Unique memory is looked at this much less often: the system has to walk all pages for it."""
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""An installed program has its bytecode; without it every process would compile it again."""

POSE = "tx DOUBLE, ty DOUBLE, tz DOUBLE, qx DOUBLE, qy DOUBLE, qz DOUBLE, qw DOUBLE"
COLUMNS = {
    "sensors": "t BIGINT, sensor VARCHAR, v1 DOUBLE, v2 DOUBLE, v3 DOUBLE, v4 DOUBLE, v5 DOUBLE, v6 DOUBLE",
    "initPoses": f"id VARCHAR, t BIGINT, {POSE}",
    "poses": f"t BIGINT, {POSE}",
    "wifi": "scan INTEGER, t BIGINT, kind VARCHAR, ssid VARCHAR, bssid VARCHAR, rss INTEGER",
}
ROWS, ACCESS_POINTS, HEARD = 20_000, 520, 18
"""The wide table: its rows, its columns of access points, and those that each row hears."""
TRACE_FLOORS = (4, 32)


class Measured(NamedTuple):
    """Memory that a call needed: all child processes together, at its peak."""

    resident_mb: float
    """What several processes share is counted for each."""
    unique_mb: float
    """What each process has to itself."""


def main() -> None:
    """Measure what the subcommand asks for, in a folder that is deleted afterwards."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    one = what.add_parser("process", help="against DuckDB")
    one.add_argument("--floors", type=int, default=FLOORS)
    one.add_argument("--sessions", type=int, default=MANY)
    one.add_argument("--repeats", type=int, default=3)
    one.add_argument("--strategy", action="append", help="of process, repeatable (default: smoother)")
    one.add_argument("--least", action="store_true", help="also parsing, hashing and writing alone")
    one.add_argument("--long", action="store_true", help="also one session of 15 minutes against five of 3")
    one.set_defaults(measure=measure_process)
    one = what.add_parser("dataset", help="against process")
    one.add_argument("--repeats", type=int, default=5, help="pairs of runs, and runs for the highest peak")
    one.set_defaults(measure=measure_dataset)
    one = what.add_parser("import", help="against Polars")
    one.add_argument("ilc20", type=Path, nargs="?", help="folder of the archives of traces")
    one.add_argument("--repeats", type=int, default=7)
    one.set_defaults(measure=measure_import)
    one = what.add_parser("memory", help="of process, for few and for many sessions")
    one.add_argument("--minutes", type=float, default=1.0, help="length of each session")
    one.add_argument("--repeats", type=int, default=3, help="runs of each; the highest peak counts")
    one.set_defaults(measure=measure_memory)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        options.measure(options, Path(folder))


def measure_process(options: argparse.Namespace, folder: Path) -> None:
    """Print how much longer ``process`` takes than DuckDB."""
    survey = simulated(folder / "survey", options.floors, DEVICES, options.sessions)
    sessions, raw_mb = sum(1 for _ in survey.glob("floor_*/*/*/poses.csv")), _megabytes(survey)
    for strategy in options.strategy or ["smoother"]:

        def label(strategy: str = strategy) -> None:
            process(survey, folder / "labels", strategy=strategy)

        ratio, _ = compared(label, lambda: _duckdb(survey, folder / "duckdb"), options.repeats)
        peak_mb = watched(label).resident_mb
        print(f"survey: {sessions} sessions, {raw_mb:.0f} MB raw")
        print(f"  process ({strategy}) / DuckDB = {ratio}; peak memory of all processes {peak_mb:.0f} MB")
    if options.least:
        ratio, _ = compared(
            lambda: _least(survey, folder / "least"), lambda: _duckdb(survey, folder / "duckdb"), options.repeats
        )
        print(f"parsing, SHA-256 and writing alone, in two processes / DuckDB = {ratio}")
    if options.long:
        five, long = simulated(folder / "five", 1, 1, 5), simulated(folder / "one", 1, 1, 1, minutes=15.0)
        labels = folder / "labels"
        ratio, _ = compared(lambda: process(long, labels, 1), lambda: process(five, labels, 1), options.repeats)
        raw = _megabytes(long) / _megabytes(five)
        print(f"one session of 15 minutes / five of 3 minutes = {ratio}; raw data {raw:.2f}")


def measure_dataset(options: argparse.Namespace, folder: Path) -> None:
    """Print how much longer ``dataset`` takes than ``process``, and its memory."""
    few, many = (simulated(folder / f"survey{sessions}", sessions=sessions) for sessions in (FEW, MANY))

    def label(survey: Path) -> None:
        process(survey, survey.with_name(f"{survey.name}-labels"))

    def build(survey: Path) -> None:
        shutil.rmtree(folder / "set", ignore_errors=True)
        labels = survey.with_name(f"{survey.name}-labels")
        vislam2tag("dataset", str(labels), "--out", str(folder / "set"), "--jobs", "2")

    ratios = compared(lambda: build(many), lambda: label(many), options.repeats)
    for name, ratio in zip(("time", "processor's time"), ratios, strict=True):
        print(f"dataset / process, {name}: {ratio}")
    label(few)
    _print_peaks({20: lambda: build(few), 80: lambda: build(many)}, options.repeats)


def measure_import(options: argparse.Namespace, folder: Path) -> None:
    """Print how much longer importing takes than parsing, and its memory."""
    from vislam2tag.common.files.archives import folder_of
    from vislam2tag.common.files.folder import Folder
    from vislam2tag.datasets.folder import write_dataset
    from vislam2tag.datasets.format_registry import ImportContext, import_format_of

    wide = _wide_table(folder / "UTS_training.csv")

    def imported() -> None:
        with tempfile.TemporaryDirectory() as scratch:
            context = ImportContext(Folder.at(Path(scratch)))
            write_dataset(import_format_of(wide).read(wide, context), folder / "tables")

    def parsed_here() -> None:
        pl.read_csv(wide)

    def parsed() -> None:
        subprocess.run([sys.executable, "-c", f"import polars; polars.read_csv({str(wide)!r})"], check=True)

    ratio, _ = compared(imported, parsed_here, options.repeats)
    print(f"{ROWS} x {ACCESS_POINTS}: importing / polars.read_csv of the same file = {ratio}")
    importing = watched(lambda: vislam2tag("import", str(wide), "--out", str(folder / "set"))).resident_mb
    print(f"peak memory: polars.read_csv {watched(parsed).resident_mb:.0f} MB, vislam2tag import {importing:.0f} MB")
    if options.ilc20 is not None:
        floor = folder_of(options.ilc20, Folder.at(folder)) / "site2" / "F4"
        few, many = (_import_floors_mb(floor, folder, count) for count in TRACE_FLOORS)
        print(f"peak memory: {few:.0f} MB for {TRACE_FLOORS[0]} floors, {many:.0f} MB for {TRACE_FLOORS[1]} of traces")


def measure_memory(options: argparse.Namespace, folder: Path) -> None:
    """Print the peaks of ``process`` for few and for many sessions, and their ratio."""
    few, many = (
        simulated(folder / f"survey{sessions}", sessions=sessions, minutes=options.minutes, locale="mixed")
        for sessions in (FEW, MOST)
    )
    labels = folder / "labels"
    _print_peaks({20: lambda: process(few, labels), 160: lambda: process(many, labels)}, options.repeats)


def vislam2tag(*arguments: str) -> None:
    """Run the command line in a process of its own; raises CalledProcessError where it fails.

    Short walks may pass too few landmarks to be mapped, which is exit code 1 and no failure here.
    """
    command = [sys.executable, "-m", "vislam2tag", *arguments]
    done = subprocess.run(command, check=False, capture_output=True, env=ENVIRONMENT)
    if done.returncode not in (0, 1):
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)


def process(survey: Path, out: Path, jobs: int = 2, strategy: str = "smoother") -> None:
    """Process a survey into a new folder."""
    shutil.rmtree(out, ignore_errors=True)
    vislam2tag("process", str(survey), "--out", str(out), "--jobs", str(jobs), "--strategy", strategy)


def simulated(
    survey: Path,
    floors: int = FLOORS,
    devices: int = DEVICES,
    sessions: int = MANY,
    minutes: float = 3.0,
    locale: str = "de",
) -> Path:
    """Simulate a survey of so many sessions on each floor with each device."""
    size = ["--floors", str(floors), "--devices", str(devices), "--sessions", str(sessions)]
    vislam2tag("simulate", str(survey), *size, "--minutes", str(minutes), "--locale", locale, "--seed", "1")
    return survey


def compared(work: Callable[[], None], reference: Callable[[], None], repeats: int) -> tuple[str, str]:
    """Time of ``work`` over that of ``reference``, in turn, by the clock and by the processor: median and range."""
    pairs = []
    for _ in range(repeats):
        reference_s = _both_clocks(reference)
        pairs.append(tuple(ours / theirs for ours, theirs in zip(_both_clocks(work), reference_s, strict=True)))
    clock, processor = (
        f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}, {repeats} pairs)"
        for ratios in zip(*pairs, strict=True)
    )
    return clock, processor


def watched(work: Callable[[], None]) -> Measured:
    """Peak memory of a call that runs subprocesses (watching costs time, so its time means nothing)."""
    peak = [0.0, 0.0]
    stop = threading.Event()

    def watch() -> None:
        sample = 0
        while not stop.wait(SAMPLING_S):
            children = psutil.Process().children(recursive=True)
            peak[0] = max(peak[0], sum(map(_resident, children)) / 1e6)
            if sample % UNIQUE_EVERY == 0:
                peak[1] = max(peak[1], sum(map(_unique, children)) / 1e6)
            sample += 1

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        work()
    finally:
        stop.set()
        thread.join()
    return Measured(*peak)


def convert(survey: str, out: str) -> None:
    """Turn the raw files of a survey into four Parquet files with DuckDB on two threads."""
    import duckdb

    connection = duckdb.connect()
    connection.execute("SET threads = 2")
    for table, columns in COLUMNS.items():
        types = ", ".join(f"'{name}': '{kind}'" for name, kind in (column.split() for column in columns.split(", ")))
        connection.execute(
            f"COPY (SELECT * FROM read_csv('{survey}/floor_*/*/*/{table}.csv', delim='; ', header=false, quote='', "
            f"decimal_separator=',', columns={{{types}}})) TO '{out}/{table}.parquet' (FORMAT parquet)"
        )


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


def _duckdb(survey: Path, out: Path) -> None:
    """Convert the survey's files in a process of its own, as ``process`` runs in its own."""
    out.mkdir(exist_ok=True)
    subprocess.run([sys.executable, __file__, "convert", str(survey), str(out)], check=True)


def _least(survey: Path, out: Path) -> None:
    """Two processes that only parse, hash and write the sessions' tables."""
    command = [sys.executable, __file__, "least", str(survey), str(out)]
    one_thread = {**os.environ, "POLARS_MAX_THREADS": "1"}
    halves = [subprocess.Popen([*command, half], env=one_thread) for half in "01"]
    if sum(half.wait() for half in halves):
        raise SystemExit("a half failed")


def _wide_table(path: Path) -> Path:
    random = np.random.default_rng(0)
    levels = np.full((ROWS, ACCESS_POINTS), 100, dtype=np.int64)
    column = np.argsort(random.random((ROWS, ACCESS_POINTS)), axis=1)[:, :HEARD]
    np.put_along_axis(levels, column, random.integers(-100, -30, column.shape), axis=1)
    table = pl.DataFrame(levels, schema=[f"WAP{number:03d}" for number in range(1, ACCESS_POINTS + 1)])
    place = pl.DataFrame(random.uniform(0, 100, (ROWS, 2)).round(3), schema=["Pos_x", "Pos_y"])
    floor = pl.DataFrame({"Floor_ID": random.integers(0, 5, ROWS)})
    pl.concat([table, place, floor], how="horizontal").write_csv(path)
    return path


def _import_floors_mb(floor: Path, folder: Path, count: int) -> float:
    """Peak memory of importing a floor's traces so many times."""
    site = folder / f"{count}" / "mall"
    for number in range(1, count + 1):
        shutil.copytree(floor, site / f"F{number}")
    return watched(lambda: vislam2tag("import", str(site), "--out", str(folder / "mall"))).resident_mb


def _print_peaks(works: dict[int, Callable[[], None]], repeats: int) -> None:
    """Print the highest peaks of some runs with few and with many sessions."""
    few, many = works
    runs = [[watched(work) for work in works.values()] for _ in range(repeats)]
    for unit in Measured._fields:
        low, high = (max(getattr(run, unit) for run in column) for column in zip(*runs, strict=True))
        print(f"{unit}: {low:.0f} for {few} sessions, {high:.0f} for {many}: {high / low:.2f} times")


def _both_clocks(work: Callable[[], None]) -> tuple[float, float]:
    """Seconds that a call takes, unwatched, by the clock, and those that this process and its children calculate."""
    before_s, start = _processor_s(), time.perf_counter()
    work()
    return time.perf_counter() - start, _processor_s() - before_s


def _processor_s() -> float:
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def _megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*.csv")) / 1e6


def _resident(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:
        return 0


def _unique(process: psutil.Process) -> int:
    try:
        return int(process.memory_full_info().uss)
    except psutil.Error:
        return 0


OWN_PROCESSES: dict[str, Callable[..., None]] = {"convert": convert, "least": least}
"""The script calls itself for what runs in processes of its own."""

if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in OWN_PROCESSES:
        OWN_PROCESSES[sys.argv[1]](*sys.argv[2:])
    else:
        main()
