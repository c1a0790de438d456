"""What is attacked: small surveys, plans, data sets, models, archives, made once by the program, and their readers."""

from __future__ import annotations

import os
import shutil
import sys
import tarfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from PIL import Image
from tests.estimation.dead_reckoning.ilc20 import make_site
from tests.sessions.formats.test_csv_walk import foreign_names, raw
from tests.site.plans import drawn_floor
from tests.studio.receiving.zips import session_zip

from vislam2tag.cli import main
from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.labelled import open_labelled
from vislam2tag.positioning.model_files import load_model
from vislam2tag.positioning.scan_file import BadLines, scan_blocks
from vislam2tag.positioning.tracks import Tracks
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.tape_and_clicks import read_distances, read_targets
from vislam2tag.quality.evaluation.press_truth import read_route
from vislam2tag.quality.evaluation.station_frame import read_shots, read_station_track
from vislam2tag.quality.evaluation.trajectory_files import READERS
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.settings import part_of, setting_fields
from vislam2tag.site.corrections import edits as correction_lines
from vislam2tag.site.corrections.file import Corrections, read_corrections
from vislam2tag.site.discover import read_site
from vislam2tag.site.settings import SETTINGS_FILE
from vislam2tag.studio.receiving.zips import unpack

HANG_S = 60
"""Processor time that a run may take; on a busy machine it may wait ten times as long."""
CORPUS = Path(__file__).resolve().parents[1] / "tests" / "corpus"
"""Small files kept in the repository: formats that the program does not write, and what once broke it."""
_SMALL = (
    *("--floors", "1", "--devices", "1", "--sessions", "2", "--landmark-count", "20"),
    *("--seed", "1", "--pressure", "--severity", "mild", "--locale", "en"),
)
_BUILDING = "[simulation.building]\nwidth_m = 30.0\nheight_m = 24.0\n"
_SET_TO = {"plan.time_limit_s": 1.0, "simulation.building.width_m": 30.0, "simulation.building.height_m": 24.0}
"""Settings whose defaults would take long."""
_EPOCH_NS = 1_639_988_040_000_000_000


def cli(*arguments: str | Path) -> None:
    """Run a command in this process; raises SystemExit with its code."""
    sys.argv = ["vislam2tag", *map(str, arguments)]
    main()


def first_walk(survey: Path) -> Path:
    """The folder of a survey's first walk; one that is not there where it has none."""
    return min(survey.glob("floor_0/*/*/"), default=survey / "gone")


def make_bases(root: Path, *, for_commands: bool) -> None:
    """Make everything that is not there yet; each in a process of its own, since commands end by exiting."""
    root.mkdir(parents=True, exist_ok=True)
    for name, make in _BASES.items():
        if not (root / name).exists() and (for_commands or name not in _FOR_COMMANDS):
            partial = root / f".{name}"
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir()
            apart(lambda make=make, partial=partial: make(root, partial))  # type: ignore[misc]
            partial.rename(root / name)


def apart(make: Callable[[], None]) -> None:
    """Do this in a forked process; raises SystemExit if it fails."""
    child = os.fork()
    if not child:
        try:
            make()
        except SystemExit as ended:
            os._exit(ended.code if isinstance(ended.code, int) else ended.code is not None)
        except BaseException as error:
            print(f"a base cannot be made: {error!r}", file=sys.stderr)
            os._exit(1)
        os._exit(0)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise SystemExit("a base cannot be made")


def _simulated(*options: str) -> Callable[[Path, Path], None]:
    """A survey in one of the layouts, with a file of all settings."""

    def make(root: Path, out: Path) -> None:
        building = root / "building.toml"
        building.write_text(_BUILDING, encoding="utf-8")
        out.rmdir()
        apart(lambda: cli("simulate", out, *_SMALL, "--minutes", "0.25", "--config", building, *options))
        (out / SETTINGS_FILE).write_text(_all_settings(), encoding="utf-8")

    return make


def _all_settings() -> str:
    """Every setting with its default."""
    values = {name: _SET_TO.get(name, field.default) for name, field in setting_fields() if part_of(field) is None}
    return "".join(f"{name} = {toml_value(value)}\n" for name, value in values.items() if value is not None)


def _evaluated(root: Path, out: Path) -> None:
    """A survey with every kind of truth."""
    shutil.copytree(root / "survey", out, dirs_exist_ok=True)
    floor = out / "floor_0"
    (floor / "refmarker.csv").write_text("".join(f"{n},{3 * n}.5,{2 * n}.0\n" for n in range(1, 7)))
    (floor / "tachymeter").mkdir()
    shutil.copy(CORPUS / "truths" / "shots.csv", floor / "tachymeter")
    shutil.copy(CORPUS / "truths" / "route.csv", floor)
    for folder in sorted(floor.glob("*/*/"))[:1]:
        shutil.copy(CORPUS / "truths" / "tachy.csv", folder)
        (folder / "refMarker.csv").write_text("84210000000\n84215000000\n")


def _site(root: Path, out: Path) -> None:
    """A described site with a plan of every format."""
    shutil.copytree(root / "survey", out, dirs_exist_ok=True)
    plans = {"png": drawn_floor.png(out), "svg": drawn_floor.svg(out), "pdf": drawn_floor.pdf(out)}
    plans |= {"dxf": drawn_floor.dxf(out), "geojson": drawn_floor.geojson(out)}
    plans["imdf"] = drawn_floor.imdf(out, archive=True).rename(out / "plan.zip")
    text = 'name = "B"\n[georeference]\nlatitude_deg = 50.0\nlongitude_deg = 6.0\nbearing_deg = 20.0\n'
    scales = {
        "svg": "unit_m = 0.25\n",
        "pdf": "page = 2\n",
        "dxf": "unit_m = 1.0\n",
        "geojson": "",
        "imdf": 'level = "0"\n',
    }
    size = "extent = { width_m = 20.0, height_m = 10.0 }\n"
    for number, (kind, plan) in enumerate(plans.items()):
        text += f"[[floors]]\nnumber = {number}\nelevation_m = {4 * number}.0\n[floors.plan]\n"
        (out / f"floor_{number}").mkdir(exist_ok=True)
        (out / f"floor_{number}" / "marker_dict.csv").write_text("id,x,y\n1,2.0,2.0\n2,15.0,2.5\n5,8.0,8.0\n")
        text += f'file = "{plan.name}"\n{scales.get(kind, "")}{size if kind in ("png", "pdf") else ""}'
    (out / "site.toml").write_text(text)
    corrections = (CORPUS / "texts" / "corrections.toml").read_text()
    added = f"{correction_lines._BEGIN}\n[[exclude_landmark]]\nid = 5\n{correction_lines._END}\n"
    (out / "corrections.toml").write_text(corrections + added)


def _labels(survey: str) -> Callable[[Path, Path], None]:
    """Without the page, which nothing reads."""

    def make(root: Path, out: Path) -> None:
        apart(lambda: cli("process", root / survey, "--out", out, "--jobs", "1"))
        (out / "report.html").unlink()

    return make


def _set(root: Path, out: Path) -> None:
    out.rmdir()
    apart(lambda: cli("dataset", root / "labels", "--survey", root / "survey", "--out", out, "--jobs", "1"))
    (out / "report.html").unlink()


def _received(root: Path, out: Path) -> None:
    """A survey that a zip was filed in, one of whose uploads is unfinished."""
    apart(lambda: cli("receive", out, root / "small" / "zip" / "session.zip"))
    waiting = out / ".receiving"
    waiting.mkdir(exist_ok=True)
    (waiting / f"{'a' * 64}.500.part").write_bytes(b"PK")


def _ran(root: Path, out: Path) -> None:
    cli("run", root / "survey", "--out", out, "--jobs", "1")


def _benchmarked(root: Path, out: Path) -> None:
    cli("benchmark", root / "set", "--model", "weighted-knn", "--split", "random", "--seeds", "1", "--out", out)


def _tables(root: Path, out: Path) -> None:
    """Tables for ``label``, with times of each kind."""
    frames = pl.read_parquet(next((root / "labels" / "trajectory").glob("*.parquet")).read_bytes())["time_ns"]
    times = frames.gather_every(20)
    value = np.arange(len(times)) * 0.5
    boot = pl.DataFrame({"time_ns": times, "co2_ppm": value})
    boot.write_csv(out / "boot.csv")
    boot.select(time_ms=(times + _EPOCH_NS) // 10**6, co2_ppm="co2_ppm").write_csv(out / "unix.csv", separator=";")
    dates = pl.from_epoch(times + _EPOCH_NS, "ns").dt.to_string("%FT%T%.3fZ")
    boot.select(datetime=dates, co2_ppm="co2_ppm").write_csv(out / "dates.csv")
    heard = pl.read_parquet(next((root / "labels" / "wifi").glob("*.parquet")).read_bytes())
    heard = heard.select(time_s=(pl.col("time_ns") + _EPOCH_NS) / 1e9, bssid="bssid", rssi="rssi_dbm")
    heard.write_parquet(out / "heard.parquet")


def _attached(root: Path, out: Path) -> None:
    """A survey with a second device's table that is tied to its first walk, which is long enough for that."""
    out.rmdir()
    apart(lambda: cli("simulate", out, *_SMALL, "--minutes", "1", "--config", root / "building.toml"))
    (out / "other").mkdir()
    heard = raw(first_walk(out))["wifi.csv"]
    heard[["t", "mac", "rssi"]].to_csv(out / "other" / "heard.csv", index=False)
    cli("attach", first_walk(out), out / "other" / "heard.csv", "--by", "levels")


def _csv_walk(root: Path, out: Path) -> None:
    """A survey whose walks are tables with headers, some of them named in columns.toml."""
    shutil.copytree(root / "survey", out, dirs_exist_ok=True)
    for folder in out.glob("floor_0/*/*/"):
        tables = raw(folder)
        for name in tables:
            (folder / name).unlink()
        foreign_names(tables, folder)


def _own_tables(root: Path, out: Path) -> None:
    """Tables of fingerprints, wide and long."""
    points = pl.read_parquet((root / "set" / "fingerprints.parquet").read_bytes()).select("scan_id", "x", "y", "floor")
    readings = pl.read_parquet((root / "set" / "readings.parquet").read_bytes())
    for kind in ("long", "wide"):
        (out / kind).mkdir()
    heard = readings.select("scan_id", "bssid", "rssi_dbm")
    points.join(heard, on="scan_id", maintain_order="left_right").write_csv(out / "long" / "points.csv")
    wide = heard.pivot("bssid", index="scan_id", values="rssi_dbm", aggregate_function="first").fill_null(100)
    points.join(wide, on="scan_id", maintain_order="left").write_csv(out / "wide" / "points.csv", separator=";")


def _fleet(root: Path, out: Path) -> None:
    """A fleet of one survey, mapped."""
    apart(lambda: cli("fleet", "add", out, root / "survey"))
    apart(lambda: cli("fleet", "process", out, "--jobs", "1"))


def _made_by(*command: str) -> Callable[[Path, Path], None]:
    """A base that one command writes of the data set, into a folder."""

    def make(root: Path, out: Path) -> None:
        cli(command[0], root / "set", *command[1:], "--out", out / command[-1] if command[0] == "train" else out)

    return make


def _gia(root: Path, out: Path) -> None:
    """The layout, with as few readings as a quick run needs."""
    apart(lambda: cli("export", root / "labels", "--format", "gia", "--out", out))
    for sensors in out.rglob("sensors_annotated.csv"):
        sensors.write_text("".join(sensors.read_text().splitlines(keepends=True)[:200]))


def _imports(_: Path, out: Path) -> None:
    """Others' formats as folders, and one of each kind of archive."""
    for name in ("getsensordata", "ilc20", "tampere", "uts"):
        shutil.copytree(CORPUS / name, out / name)
    shutil.make_archive(str(out / "tampere_zip" / "tampere"), "zip", CORPUS / "tampere")
    (out / "uts_tar").mkdir()
    with tarfile.open(out / "uts_tar" / "uts.tar", "w") as archive:
        archive.add(CORPUS / "uts", ".")


def _small(root: Path, out: Path) -> None:
    """All that is one file, or a few."""
    for name in ("register", "truths", "scans", "texts"):
        shutil.copytree(CORPUS / name, out / name)
    (out / "zip").mkdir()
    (out / "zip" / "session.zip").write_bytes(session_zip())
    (out / "images").mkdir()
    noise = np.random.default_rng(1).integers(0, 256, (40, 40, 3), dtype=np.uint8)
    Image.fromarray(noise).resize((400, 400), Image.Resampling.NEAREST).save(out / "images" / "1.png")
    walkable = Image.new("RGB", (300, 240), "red")
    walkable.paste((0, 255, 0), (20, 20, 280, 60))
    walkable.save(out / "images" / "mask.png")
    (out / "texts" / "radio.toml").write_text("[radio_maps]\nleast_readings = 3\n")
    (out / "texts" / "key.txt").write_text("0123456789abcdef")
    shutil.copy(root / "survey" / SETTINGS_FILE, out / "texts" / "config.toml")
    head, *rows = (root / "survey" / "floor_0" / "marker_dict.csv").read_text().splitlines()
    (out / "texts" / "landmarks.csv").write_text("\n".join([f"{head},floor", *(f"{row},0" for row in rows)]))


def _model(name: str) -> Callable[[Path, Path], None]:
    return lambda root, out: cli("train", root / "set", "--model", name, "--out", out / "model.v2t")


_BASES: dict[str, Callable[[Path, Path], None]] = {
    "survey": _simulated(),
    "phone": _simulated("--ble", "--format", "phone"),
    "older": _simulated("--names", "paper", "--without-poses", "--column", "elevation", "--column", "heading"),
    "ilc20": lambda _, out: (make_site(out), None)[1],
    "evaluated": _evaluated,
    "site": _site,
    "labels": _labels("survey"),
    "phonelabels": _labels("phone"),
    "tables": _tables,
    "attached": _attached,
    "fleet": _fleet,
    "csvwalk": _csv_walk,
    "set": _set,
    "owntables": _own_tables,
    "ran": _ran,
    "benchmarked": _benchmarked,
    "uji": _made_by("export", "--format", "uji"),
    "comford": _made_by("export", "--format", "comford"),
    "parquet": _made_by("export", "--format", "parquet"),
    "gia": _gia,
    "neighbours": _model("weighted-knn"),
    "kriging": _model("local-kriging"),
    "cells": _model("cell-density"),
    "imports": _imports,
    "small": _small,
    "received": _received,
}
_FOR_COMMANDS = {"phone", "older", "ilc20", "evaluated", "phonelabels", "tables", "ran", "benchmarked", "received"} | {
    "attached",
    "fleet",
}
"""What no reader reads."""


@dataclass(frozen=True)
class Run:
    """What one run has: the damaged base, all others, an empty folder to write to, and its own random numbers."""

    base: Path
    bases: Path
    out: Path
    rng: np.random.Generator


@dataclass(frozen=True)
class Target:
    """Something to attack."""

    name: str
    base: str
    files: tuple[str, ...]
    """Patterns of the files that are damaged, below the base."""
    work: Callable[[Run], object]
    codes: tuple[int, ...] = (0,)
    """Exit codes that are documented."""
    reader: bool = False
    """Whether it is a function, quick enough for hundreds of runs in CI."""
    writes_base: bool = False
    """Whether it is meant to write into what is damaged; others must leave that as it is."""
    every: int = 1
    """It is run in each so manieth round."""


def _reader(name: str, base: str, files: tuple[str, ...], work: Callable[[Run], object]) -> Target:
    return Target(name, base, files, work, reader=True)


def _import(folder: Path, out: Path) -> None:
    dataset = import_format_of(folder).read(folder, ImportContext(Folder.at(out)))
    try:
        pl.collect_all(dataset.tables.values())
    except pl.exceptions.PolarsError as error:  # as where the data set is written
        raise DatasetError(first_line(error)) from error


def _walks(run: Run) -> None:
    survey = open_survey(run.base)
    for session in survey.sessions:
        prepared_session(SessionTask(session, survey.site, Corrections()))


def _import_below(name: str) -> Callable[[Run], object]:
    return lambda run: _import(run.base / name, run.out)


def _truth(kind: str) -> Callable[[Run], object]:
    return lambda run: READERS[kind](run.base / f"truths/truth{kind}")


def _scans(run: Run) -> None:
    for kind in ("csv", "jsonl"):
        list(scan_blocks(run.base / f"scans/scans.{kind}", BadLines("scans"), str))


def _dataset(run: Run) -> None:
    dataset = open_dataset(run.base)
    for table in dataset.tables.values():
        table.head(10).collect()


def _labelled(run: Run) -> None:
    for session in open_labelled(run.base).sessions:
        session.result()
        session.table("wifi", ("time_ns", "x", "y", "bssid"))


SITE_FILES = ("site.toml", "*.csv", "plan.*", "floor_0/*.csv", "floor_0/floorplan.*", "corrections.toml")
SET_FILES = ("*.json", "*.parquet", "splits/*", "dataset.toml")
CSV_WALK_FILES = ("floor_0/*/*.toml", "floor_0/*/*/*.csv")
LABEL_FILES = ("*.json", "*/*.json", "*/*.parquet")

READERS_ATTACKED: tuple[Target, ...] = (
    _reader("site", "site", SITE_FILES, lambda run: read_site(run.base)),
    _reader("corrections", "site", ("corrections.toml",), lambda run: read_corrections(run.base)),
    *(
        _reader(
            f"truth {kind}",
            "small",
            (f"truths/truth{kind}", f"truths/truth{'.times' if kind == '.kitti' else kind}"),
            _truth(kind),
        )
        for kind in READERS
    ),
    _reader(
        "track of a station",
        "small",
        ("truths/tachy.csv",),
        lambda run: read_station_track(run.base / "truths/tachy.csv"),
    ),
    _reader(
        "shots of a station", "small", ("truths/shots.csv",), lambda run: read_shots(run.base / "truths/shots.csv")
    ),
    _reader(
        "route",
        "small",
        ("truths/route.csv",),
        lambda run: read_route(run.base, run.base / "truths", ["1", "2", "3"]),
    ),
    _reader(
        "tape",
        "small",
        ("register/tape.csv",),
        lambda run: read_distances(run.base / "register/tape.csv", RegistrationSettings()),
    ),
    _reader(
        "targets",
        "small",
        ("register/targets.csv",),
        lambda run: read_targets(run.base / "register/targets.csv", RegistrationSettings()),
    ),
    _reader("scans", "small", ("scans/scans.csv", "scans/scans.jsonl"), _scans),
    _reader("track", "small", ("scans/track.csv",), lambda run: Tracks(run.base / "scans/track.csv")),
    _reader(
        "session zip",
        "small",
        ("zip/*",),
        lambda run: unpack(run.base / "zip/session.zip", Folder.at(run.out / "z"), 10**7),
    ),
    _reader("labels", "labels", LABEL_FILES, _labelled),
    _reader("data set", "set", SET_FILES, _dataset),
    *(
        _reader(f"model {name}", name, ("model.v2t",), lambda run: load_model(run.base / "model.v2t"))
        for name in ("neighbours", "kriging", "cells")
    ),
    *(
        _reader(f"import {name}", "imports", (f"{name}/**/*",), _import_below(name))
        for name in ("getsensordata", "ilc20", "tampere", "uts", "tampere_zip", "uts_tar")
    ),
    *(_reader(f"import {name} table", "owntables", (f"{name}/*",), _import_below(name)) for name in ("long", "wide")),
    _reader("walk as CSV", "csvwalk", CSV_WALK_FILES, _walks),
    *(
        _reader(f"import {name}", name, ("**/*",), lambda run: _import(run.base, run.out))
        for name in ("uji", "comford", "parquet", "gia")
    ),
)
