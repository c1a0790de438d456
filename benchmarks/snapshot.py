"""What the program makes of the demo, real data and generated surveys, as one file that a diff can read.

    python benchmarks/snapshot.py OUT.json                some ten minutes on one core
    python benchmarks/snapshot.py --compare A.json B.json  the differences by table and column; exit code 1 if any
    python benchmarks/snapshot.py OUT.json --only demo --only site

Each command runs as users run it, in an empty folder. Of every table that it writes the digest contains the rows, the
type of each column, its nulls, a hash of its exact content, and sum, smallest and greatest value to nine digits. JSON,
printed or written, is taken by its first keys. Times, paths, versions, durations and hashes of files are left out, see
VOLATILE. Hashes are exact, so make both files on one machine with the same libraries.

Runs on `../shared/data` are private: their names and texts are masked. Sets that are missing are left out.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.metadata
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import polars as pl

HERE = Path(__file__).resolve().parents[1]
SHARED = HERE.parent / "shared" / "data"
CORPUS = HERE / "tests" / "corpus"

Json: TypeAlias = Any
Digest: TypeAlias = dict[str, Any]

VOLATILE = re.compile(
    r"(^|_)(seconds|elapsed|took|wall|versions?|commit|fingerprint|sha256|created|contentSize|dateCreated|size_bytes|fit|predict)(_s|_ns)?$"
)
"""Keys of JSON, and columns, whose values follow from when, where or by which version a command ran."""
VOLATILE_FILES = ("log.txt", "times.csv", "series.parquet")
"""Tracebacks, durations, and the studio's curves, whose last digits differ between two runs."""
UNLIKE = (
    (re.compile(r"\b[0-9a-f]{64}\b"), "SHA256"),
    (re.compile(r"(?<=[.-])([0-9a-f]{12}|[0-9a-f]{8})\b"), "HASH"),
    (re.compile(r"\b\d+\.\d+\.\d+( \(commit [0-9a-f]+(-dirty)?\))?"), "VERSION"),
    (re.compile(r"\b\d+(\.\d+)? (s|ms|min|seconds?|minutes?)\b"), "TIME"),
)
"""What differs in texts from run to run: hashes of files that contain a version, and durations."""
DETERMINED = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "POLARS_MAX_THREADS"), "1")
"""One thread: sums of several threads depend on their order."""
MAX_SHOWN = 4
"""So many values of one leaf are written out, of private runs one; of more, their digest."""
PRINTED_DEPTH, WRITTEN_DEPTH = 3, 2
"""Leaves of JSON whose first keys are the same, so many, are taken together; of written files fewer: they are many."""
OWN_FILES = ".vislam2tag-files"
WIDTH = 118


@dataclass(frozen=True)
class Run:
    """One command of the program and what it writes."""

    name: str
    arguments: str
    """As typed; ``{data}`` is the folder of real data, ``{corpus}`` that of the tests."""
    out: str = ""
    """What of the work folder it writes."""
    before: Callable[[Path], None] | None = None
    """Makes what it reads."""


@dataclass(frozen=True)
class Part:
    """Runs in their order, one reading what another wrote."""

    name: str
    runs: tuple[Run, ...]
    needs: str = ""
    """Folder of real data, or an archive, which is unpacked into the folder `raw`; then the part is private."""


# What is run


def _second_phone(work: Path) -> None:
    """A table of the gyroscope of a walk, by a clock that is ahead."""
    path = next(iter(sorted((work / "labels" / "sensors").glob("*.parquet"))))
    gyro = pl.read_parquet(path).filter(pl.col("sensor").str.to_lowercase().str.contains("gyro"))
    times = (gyro["time_ns"] - gyro["time_ns"][0]) * 1e-9 + 1.7e9
    pl.DataFrame({"unix_time": times, "gyro_x": gyro["v1"], "gyro_y": gyro["v2"], "gyro_z": gyro["v3"]}).write_csv(
        work / "second.csv"
    )
    (work / "walk").symlink_to(next(iter(sorted((work / "survey").glob("floor_*/*/*/")))), target_is_directory=True)


def _readings(work: Path) -> None:
    """A table of somebody's sensor by the phone's clock."""
    times = pl.read_parquet(work / "labels" / "wifi" / "*.parquet")["time_ns"][::7]
    pl.DataFrame({"time_ns": times, "co2": np.arange(len(times)) * 0.5}).write_csv(work / "co2.csv")


def _wide(path: Path, levels: pl.DataFrame, places: Mapping[str, pl.Series | int]) -> None:
    """A table as UJIIndoorLoc's of levels and places."""
    columns = [
        series.cast(pl.Float64).fill_null(100).round(0).alias(f"WAP{i:03}") for i, series in enumerate(levels, 1)
    ]
    named = {"SPACEID": 0, "RELATIVEPOSITION": 0, "USERID": 1, "PHONEID": 1, "BUILDINGID": 0, "FLOOR": 0} | dict(places)
    order = (
        "LONGITUDE",
        "LATITUDE",
        "FLOOR",
        "BUILDINGID",
        "SPACEID",
        "RELATIVEPOSITION",
        "USERID",
        "PHONEID",
        "TIMESTAMP",
    )
    rest = [
        value.alias(name) if isinstance(value := named[name], pl.Series) else pl.lit(value).alias(name)
        for name in order
    ]
    path.mkdir(exist_ok=True)
    pl.DataFrame(columns).with_columns(rest).write_csv(path / "trainingData.csv")


def _dungeon(work: Path) -> None:
    table = pl.read_csv(work / "raw" / "dataset.csv", infer_schema_length=None)
    times = table["write_time"].str.to_datetime(time_zone="UTC").dt.epoch("s")
    levels = table.drop("1", "2", "3", "write_time")
    _wide(work / "wide", levels, {"LONGITUDE": table["1"], "LATITUDE": table["2"], "TIMESTAMP": times})


def _sod(work: Path) -> None:
    table = pl.read_csv(work / "raw" / "Training_CETC331.csv", infer_schema_length=None)
    levels = table.select(pl.col("^MAC.*$"))
    places = {"LONGITUDE": table["ECoord"], "LATITUDE": table["NCoord"], "FLOOR": table["FloorID"]}
    _wide(work / "wide", levels, {**places, "PHONEID": table["PhoneID"], "TIMESTAMP": pl.Series(range(table.height))})


def _months(work: Path) -> None:
    """The first months alone."""
    for folder in (work / "raw" / "db").iterdir():
        if folder.is_dir() and folder.name not in {"01", "02"}:
            shutil.rmtree(folder)


def _some_walks(work: Path) -> None:
    """Every third walk of the mall."""
    for number, path in enumerate(sorted((work / "raw" / "site2" / "F4" / "path_data_files").iterdir())):
        if number % 3:
            path.unlink()


def _key(work: Path) -> None:
    (work / "key.txt").write_text("a secret of sixteen bytes and more", encoding="utf-8")


def _planned(work: Path) -> None:
    """A copy of the survey that `fleet` and `--apply` may change."""
    shutil.copytree(work / "survey", work / "copy")


SURVEY = (
    Run("process", "process survey --out labels --json --jobs 1", "labels"),
    Run("dataset", "dataset labels --survey survey --out set --json --jobs 1", "set"),
)
PARTS = (
    Part("demo", (Run("demo", "demo out --json --jobs 1", "out"),)),
    Part(
        "storeys",
        (
            Run(
                "simulate",
                "simulate survey --floors 3 --devices 1 --sessions 2 --minutes 2 --seed 5 --severity severe"
                " --climb mixed --pressure --ble --column elevation --column z --column sigma --trap stale_wifi"
                " --trap frame_gap --json",
                "survey",
            ),
            Run("inspect", "inspect survey --json"),
            *SURVEY,
            Run("process together", "process survey --out together --together --json --jobs 1", "together"),
            Run(
                "next frame",
                "process survey --out next --strategy local --label-rule next-frame --json --jobs 1",
                "next",
            ),
            Run("dry run", "process survey --out labels --dry-run --json --jobs 1"),
            Run("evaluate", "evaluate survey --out evaluated --json --jobs 1", "evaluated"),
            Run("check", "check survey --out checked --json --jobs 1", "checked"),
            Run("diagnose", "diagnose survey --json --jobs 1"),
            Run(
                "survey-landmarks", "survey-landmarks survey --out done.csv --report done.json --json --jobs 1", "done*"
            ),
            Run("verify", "verify labels together --json"),
            Run("label", "label co2.csv --labels labels --out co2.parquet --json", "co2.parquet", _readings),
            Run("attach", "attach walk second.csv --json", "walk/companions", _second_phone),
            Run("process attached", "process survey --out attached --json --jobs 1", "attached/sensors"),
            Run("sightings", "sightings survey --tags apriltag-36h11 --tag-side-m 0.16 --json"),
            Run("paper", "paper survey --out paper --json", "paper"),
            Run(
                "studio",
                "studio survey --labels labels --export page --hash-bssid key.txt --json --jobs 1",
                "page",
                _key,
            ),
        ),
    ),
    Part(
        "phones",
        (
            Run(
                "simulate",
                "simulate survey --floors 1 --devices 3 --sessions 2 --minutes 2 --seed 8 --severity default"
                " --format phone --rtt --ble --json",
                "survey/simulation.json",
            ),
            Run("inspect", "inspect survey --json"),
            Run("run", "run survey --out ran --json --jobs 1", "ran/check"),
            *SURVEY,
            Run(
                "dataset windows",
                "dataset labels --out windows --window 1s --radios --no-ssid --json --jobs 1",
                "windows/[fr]*.parquet",
            ),
            Run("split", "split set --by block --block-m 8 --guard-m 3 --seed 1 --name blocks --json", "set/splits"),
            Run("splits", "split set --json"),
            *(
                Run(f"export {name}", f"export set --format {name} --out as-{name} --json --jobs 1", f"as-{name}")
                for name in ("parquet", "uji", "comford", "geojson", "hdf5")
            ),
            *(
                Run(f"export {name}", f"export labels --format {name} --out as-{name} --json --jobs 1", f"as-{name}")
                for name in ("gia", "tum", "mcap")
            ),
            *(
                Run(f"import {name}", f"import as-{name} --out from-{name} --json", f"from-{name}/*.parquet")
                for name in ("parquet", "uji", "comford", "gia")
            ),
            Run(
                "simulate later",
                "simulate later --floors 1 --devices 1 --sessions 2 --minutes 2 --seed 8 --severity mild"
                " --later 2022-06-01 --json",
                "later",
            ),
            Run("dataset later", "dataset later --out later-set --json --jobs 1", "later-set"),
            Run("join", "join set later-set --out joined --json", "joined"),
            Run("figures", "figures set --out figures --json", "figures"),
            Run("radio-maps", "radio-maps set --out maps --cell 2m --most 5 --json", "maps"),
            Run("train", "train set --model weighted-knn --out knn.v2t --split random --json"),
            Run("train kriging", "train set --model local-kriging --out kriging.v2t --json"),
            Run("train update", "train later-set --update kriging.v2t --out updated.v2t --json"),
            Run("locate", "locate knn.v2t later-set --out places.csv --json", "places.csv"),
            Run("locate kriging", "locate updated.v2t set --sequence smoother --out walks.jsonl --json", "walks.jsonl"),
            Run(
                "benchmark",
                "benchmark set --model weighted-knn --model local-kriging --model multi-cel --model regression-net"
                " --split random --split device --seeds 1 --out compared --json",
                "compared",
            ),
            Run("fleet add", "fleet add fleet survey later --json", "fleet/fleet.json"),
            Run("fleet process", "fleet process fleet --json --jobs 1", "fleet/tables"),
            Run("fleet list", "fleet list fleet --json"),
            Run("fleet status", "fleet status fleet --json"),
            Run("fleet report", "fleet report fleet --json"),
            Run("receive", "receive copy none.zip --json", "", _planned),
        ),
    ),
    Part(
        "without-poses",
        (
            Run(
                "simulate",
                "simulate survey --floors 1 --devices 2 --sessions 1 --minutes 3 --seed 9 --severity mild"
                " --format phone --without-poses --json",
                "survey",
            ),
            *SURVEY,
            Run("reckoned", "process survey --out reckoned --strategy dead-reckoning --json --jobs 1", "reckoned"),
        ),
    ),
    Part(
        "site",
        (
            Run("simulate", "simulate survey --floors 1 --devices 1 --sessions 1 --minutes 1 --seed 3 --json"),
            Run("show", "site show survey --json"),
            Run("write", "site write survey --out written --json", "written"),
            Run("init", "site init survey --json", "survey/site.toml"),
            Run("walkable", "site walkable survey --out walkable --json", "walkable"),
            Run("process", "process survey --out labels --json --jobs 1", "labels"),
            Run("rebase", "site rebase labels --from survey --to written --out rebased --json", "rebased"),
            Run("plan", "plan survey --ignore-existing --out plan --json", "plan"),
            Run("sheets", "sheets --ids 1-3 --seed 7 --out sheets --json", "sheets"),
            Run(
                "register",
                "register {corpus}/register/site --station {corpus}/register/S1.csv --control"
                " {corpus}/register/control.csv --landmark-names LM* --control-points XX* --out registered --json",
                "registered",
            ),
            Run(
                "register tape",
                "register {corpus}/register/site --tape {corpus}/register/tape.csv --targets"
                " {corpus}/register/targets.csv --out taped --json",
                "taped",
            ),
        ),
    ),
    Part(
        "real-walks",
        (
            Run("process", "process {data}/real-walks --out labels --json --jobs 1", "labels"),
            Run("together", "process {data}/real-walks --out together --together --json --jobs 1", "together"),
            Run("evaluate", "evaluate {data}/real-walks --out evaluated --json --jobs 1", "evaluated"),
            Run("check", "check {data}/real-walks --json --jobs 1"),
            Run("diagnose", "diagnose {data}/real-walks --json --jobs 1"),
            Run("survey-landmarks", "survey-landmarks {data}/real-walks --out done.csv --json --jobs 1", "done*"),
        ),
        needs="real-walks",
    ),
    Part(
        "agreement",
        (
            Run("process", "process raw/raw --out labels --json --jobs 1", "labels"),
            Run(
                "published",
                "process raw/raw --out paper --strategy local --label-rule next-frame --json --jobs 1",
                "paper",
            ),
            Run("export", "export paper --format gia --out gia --json --jobs 1", "gia"),
            Run("verify", "verify raw/published-output gia --json"),
            Run("evaluate", "evaluate raw/raw --out evaluated --strategy smoother --json --jobs 1", "evaluated"),
        ),
        needs="agreement/agreement.tar.xz",
    ),
    Part(
        "ilc20",
        (
            Run("import", "import raw --format ilc20 --out set --json", "set", _some_walks),
            Run("init", "site init mall --plan raw/site2/F4 --json", "mall/site.toml"),
            Run("walkable", "site walkable mall --out walkable --json", "walkable"),
            Run("train", "train set --model weighted-knn --split random --out model.v2t --json"),
        ),
        needs="ilc20/site2-F4.tar.xz",
    ),
    Part(
        "tampere",
        (
            Run("import", "import raw --out set --json", "set"),
            Run("train", "train set --model weighted-knn --split official --out model.v2t --json"),
            Run("locate", "locate model.v2t set --out places.csv --json", "places.csv"),
        ),
        needs="tampere/tampere-2017-08-21.tar.xz",
    ),
    Part("uji", (Run("import", "import raw --out set --json", "set"),), needs="uji/ujiindoorloc-training.tar.xz"),
    Part("wifine", (Run("import", "import raw --out set --json", "set"),), needs="wifine/wifine-train-val.tar.xz"),
    Part(
        "long-term",
        (Run("import", "import raw/db --format uji-library --out set --json", "set", _months),),
        needs="long-term/long-term-months-01-04.tar.xz",
    ),
    Part(
        "sodindoorloc",
        (
            Run("import", "import wide --out set --json", "set", _sod),
            Run("train", "train set --model local-kriging --split random --out model.v2t --json"),
        ),
        needs="sodindoorloc/sodindoorloc-cetc331-hcxy.tar.xz",
    ),
    Part(
        "dungeon-assistant",
        (Run("import", "import wide --out set --json", "set", _dungeon),),
        needs="dungeon-assistant/dungeon-assistant.tar.xz",
    ),
)


# Digests


class Writer:
    """Digests of what one part makes; texts lose what differs from run to run, and are masked if private."""

    def __init__(self, work: Path, *, private: bool) -> None:
        self.work, self.private = work, private

    def text(self, text: str) -> str:
        """A text without what differs from run to run, and masked if private."""
        text = self._plain(text)
        return f"{re.sub(r'[^ ]*[^a-z .,;:()]+[^ ]*', '~', text)[:80]} #{_hash(text)}" if self.private else text

    def _plain(self, text: str) -> str:
        for folder, name in ((self.work, "WORK"), (SHARED, "DATA"), (HERE, "REPOSITORY")):
            text = text.replace(str(folder), name)
        for pattern, name in UNLIKE:
            text = pattern.sub(name, text)
        return text

    def name(self, name: str) -> str:
        """A file's name or a key, its hash if private."""
        name = self._plain(name)
        return _hash(name) if self.private else name

    def outputs(self, pattern: str) -> Digest:
        """All that is below the paths of this pattern."""
        paths = sorted(self.work.glob(pattern)) if pattern else []
        files = [file for path in paths for file in _files(path) if file.name not in VOLATILE_FILES]
        groups: defaultdict[str, list[Path]] = defaultdict(list)
        for file in files:
            groups[self._group(file)].append(file)
        found = {name: digest for name, paths in sorted(groups.items()) if (digest := self._digest(paths)) is not None}
        others = Counter(path.suffix or path.name for path in files)
        return {**found, "files by ending": dict(sorted(others.items()))}

    def _group(self, file: Path) -> str:
        """Files of one kind together: those of sessions, each of which has its own name or folder."""
        place = file.relative_to(self.work)
        alone = file.name.startswith(".") or re.fullmatch(r"[a-z_-]+", file.stem) is not None
        folders = [one if re.fullmatch(r"\.?[a-zA-Z_-]+|floor_\d+", one) else "*" for one in place.parent.parts]
        return "/".join((*folders, file.name if alone else f"*{file.suffix}"))

    def _digest(self, paths: list[Path]) -> Digest | None:
        suffix = paths[0].suffix
        read = READERS.get(suffix)
        if read is not None:
            return self._tables(paths, read)
        if suffix in {".json", ".geojson"}:
            return self.json([json.loads(path.read_text(encoding="utf-8")) for path in paths], depth=WRITTEN_DEPTH)
        if suffix in TEXTS or paths[0].name == OWN_FILES:
            text = "\n".join(self._plain(path.read_text(encoding="utf-8", errors="replace")) for path in paths)
            return {"files": len(paths), "lines": text.count("\n") + 1, "hash": _hash(text)}
        return None

    def _tables(self, paths: list[Path], read: Callable[[Path], pl.DataFrame]) -> Digest:
        tables = [table.drop(name for name in table.columns if VOLATILE.search(name)) for table in map(read, paths)]
        table = pl.concat(tables, how="diagonal_relaxed")
        digest: Digest = {"rows": table.height, "columns": {one.name: column(one) for one in table}}
        if len(paths) > 1:
            names = [self.name(str(path.relative_to(self.work))) for path in paths]
            rows = (f"{one.height} rows {_hash(''.join(map(_content, one)))}" for one in tables)
            digest["files"] = dict(zip(names, rows, strict=True))
        return digest

    def json(self, documents: Iterable[Json], depth: int = PRINTED_DEPTH) -> Digest:
        """The leaves of documents of one form, by the beginning of their path."""
        leaves: defaultdict[str, list[Json]] = defaultdict(list)
        for document in documents:
            for path, value in _leaves(document, self.name):
                leaves[".".join(path.split(".")[:depth])].append(self.text(value) if isinstance(value, str) else value)
        return {path: self._leaf(values) for path, values in sorted(leaves.items())}

    def _leaf(self, values: list[Json]) -> Json:
        if len(values) == 1:
            return values[0]
        if len(values) <= MAX_SHOWN and not self.private:
            return values
        numbers = [float(one) for one in values if isinstance(one, (int, float)) and not isinstance(one, bool)]
        return {"count": len(values), "hash": _hash(json.dumps(values)), **_range(numbers)}


def _files(path: Path) -> list[Path]:
    return [path] if path.is_file() else [one for one in sorted(path.rglob("*")) if one.is_file()]


def _leaves(value: Json, name: Callable[[str], str], path: str = "") -> Iterator[tuple[str, Json]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            if not VOLATILE.search(key):
                shown = key if re.fullmatch(r"[a-z_ .-]+", key) else name(key)
                yield from _leaves(inner, name, f"{path}.{shown}" if path else shown)
    elif isinstance(value, list):
        for inner in value:
            yield from _leaves(inner, name, f"{path}[]")
    else:
        yield path, value


def column(series: pl.Series) -> Digest:
    """Type, nulls and content of a column."""
    digest: Digest = {"type": str(series.dtype), "hash": _hash(_content(series))}
    if nulls := series.null_count():
        digest["nulls"] = nulls
    if series.dtype.is_numeric():
        digest |= _range(series.drop_nulls().cast(pl.Float64).to_list())
    return digest


def _content(series: pl.Series) -> str:
    """The exact content: floats by their shortest text that reads back."""
    return repr(series.to_list())


def _range(numbers: list[float]) -> Digest:
    finite = [one for one in numbers if math.isfinite(one)]
    found = {"sum": math.fsum(finite), "min": min(finite), "max": max(finite)} if finite else {}
    return {name: float(f"{value:.9g}") for name, value in found.items()}


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]


def _numpy(path: Path) -> pl.DataFrame:
    loaded = np.load(path)
    arrays = {name: loaded[name] for name in loaded.files} if isinstance(loaded, np.lib.npyio.NpzFile) else {"": loaded}
    return pl.concat([pl.DataFrame({name: array.ravel()}) for name, array in arrays.items()], how="diagonal_relaxed")


def _hdf5(path: Path) -> pl.DataFrame:
    import h5py

    columns: list[pl.DataFrame] = []
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: (
                columns.append(pl.DataFrame({name: [str(one) for one in np.ravel(item[()])]}))
                if isinstance(item, h5py.Dataset)
                else None
            )
        )
    return pl.concat(columns, how="diagonal_relaxed")


def _csv(path: Path) -> pl.DataFrame:
    """A table of commas or, as raw files without a header, its lines."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if not re.match(r"[A-Za-z_]+[^;\n]*,", text):
        return pl.DataFrame({"line": text.splitlines()}, schema={"line": pl.String})
    return pl.read_csv(text.encode(), infer_schema_length=None, truncate_ragged_lines=True, ignore_errors=False)


READERS: dict[str, Callable[[Path], pl.DataFrame]] = {
    ".parquet": pl.read_parquet,
    ".csv": _csv,
    ".jsonl": lambda path: pl.read_ndjson(path, infer_schema_length=None),
    ".npz": _numpy,
    ".npy": _numpy,
    ".h5": _hdf5,
}
TEXTS = {".tex", ".md", ".txt", ".toml", ".tum"}


# Making and comparing


def make(only: Iterable[str] = ()) -> Digest:
    """Run all parts, or some, and return the digest."""
    libraries = {name: importlib.metadata.version(name) for name in ("numpy", "polars", "scipy", "scikit-learn")}
    parts = [part for part in PARTS if not only or part.name in set(only)]
    return {"libraries": libraries, "parts": {part.name: _run_part(part) for part in parts if _at_hand(part)}}


def _at_hand(part: Part) -> bool:
    return not part.needs or (SHARED / part.needs).exists()


def _run_part(part: Part) -> Digest:
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder).resolve()
        if part.needs.endswith(".tar.xz"):
            with tarfile.open(SHARED / part.needs) as archive:
                archive.extraction_filter = getattr(tarfile, "data_filter", None)  # Python 3.11.2 has none
                archive.extractall(work / "raw")
        writer = Writer(work, private=bool(part.needs))
        return {run.name: _run(run, work, writer) for run in part.runs}


def _run(run: Run, work: Path, writer: Writer) -> Digest:
    print(run.name, run.arguments, file=sys.stderr, flush=True)
    if run.before is not None:
        run.before(work)
    arguments = run.arguments.format(data=SHARED, corpus=CORPUS).split()
    command = [sys.executable, "-m", "vislam2tag", "-q", *arguments]
    environment = {**os.environ, **DETERMINED, "COLUMNS": "1000", "NO_COLOR": "1", "PYTHONPATH": str(HERE / "src")}
    done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=work, env=environment)
    stderr = [writer.text(line) for line in done.stderr.splitlines()]
    digest: Digest = {"command": run.arguments, "exit code": done.returncode, "stderr": stderr}
    try:
        digest["json"] = writer.json([json.loads(done.stdout)])
    except json.JSONDecodeError:
        digest["stdout"] = [writer.text(line) for line in done.stdout.splitlines()]
    return digest | {"outputs": writer.outputs(run.out)}


def differences(before: Json, after: Json, path: tuple[str, ...] = ()) -> Iterator[str]:
    """A line for each difference: where it is, and both values."""
    if isinstance(before, dict) and isinstance(after, dict):
        if "hash" in before and "hash" in after:
            yield from _of_content(before, after, path)
            return
        for key in sorted({*before, *after}):
            if key not in after:
                yield f"{' > '.join((*path, key))}: is gone"
            elif key not in before:
                yield f"{' > '.join((*path, key))}: is new"
            else:
                yield from differences(before[key], after[key], (*path, key))
    elif before != after:
        yield f"{' > '.join(path)}: {_short(before)} -> {_short(after)}"


def _of_content(before: Digest, after: Digest, path: tuple[str, ...]) -> Iterator[str]:
    changed = [key for key in sorted({*before, *after} - {"hash"}) if before.get(key) != after.get(key)]
    if changed:
        shown = ", ".join(f"{key} {_short(before.get(key))} -> {_short(after.get(key))}" for key in changed)
        yield f"{' > '.join(path)}: {shown}"
    elif before["hash"] != after["hash"]:
        yield f"{' > '.join(path)}: another content or order, the same {', '.join(sorted({*before} - {'hash'}))}"


def _short(value: Json) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 200 else f"{text[:200]}..."


def as_text(value: Json, indent: int = 0) -> str:
    """JSON, sorted, with what fits on a line on one line."""
    flat = json.dumps(value, sort_keys=True, ensure_ascii=False, allow_nan=True)
    if not isinstance(value, (dict, list)) or indent + len(flat) <= WIDTH or ("hash" in value and "[" not in flat):
        return flat
    pad = " " * (indent + 1)
    if isinstance(value, list):
        inner = [pad + as_text(one, indent + 1) for one in value]
        return "[\n" + ",\n".join(inner) + "\n" + " " * indent + "]"
    rows = [f"{pad}{json.dumps(key, ensure_ascii=False)}: {as_text(value[key], indent + 1)}" for key in sorted(value)]
    return "{\n" + ",\n".join(rows) + "\n" + " " * indent + "}"


def main() -> int:
    """Make a digest, or compare two."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", type=Path, help="file to write")
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("A", "B"))
    parser.add_argument("--only", action="append", default=[], help="only this part; repeatable")
    options = parser.parse_args()
    if options.compare:
        before, after = (json.loads(path.read_text(encoding="utf-8")) for path in options.compare)
        lines = list(differences(before, after))
        print("\n".join(lines) if lines else "no difference")
        return int(bool(lines))
    if options.out is None:
        parser.error("give the file to write, or --compare A B")
    options.out.write_text(as_text(make(options.only)) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
