"""What is attacked: readers, called as functions, and commands, each with the files that are damaged for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from fuzzing.bases import cli
from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.dataset.fingerprinting.labelled import open_labelled
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.format_registry import ImportContext, import_format_of
from vislam2tag.evaluation.control_points.route_file import read_route
from vislam2tag.evaluation.total_station.station_file import read_shots, read_station_track
from vislam2tag.evaluation.trajectory_files import READERS
from vislam2tag.positioning.model_file import load_model
from vislam2tag.positioning.scans.scan_file import BadLines, scan_blocks
from vislam2tag.positioning.scans.track_file import Tracks
from vislam2tag.receiving.session_zip import unpack
from vislam2tag.registration.settings import RegistrationSettings
from vislam2tag.registration.tape_file import read_distances, read_targets
from vislam2tag.survey.corrections import read_corrections
from vislam2tag.survey.discover import read_site

Work = Callable[[Path, Path, Path], object]
"""What is done with the damaged base, with all others, and with a new folder to write to."""


@dataclass(frozen=True)
class Target:
    """Something to attack."""

    name: str
    base: str
    files: tuple[str, ...]
    """Patterns of the files that are damaged, below the base."""
    work: Work
    codes: tuple[int, ...] = (0, 1, 2)
    """Exit codes that are documented."""
    reader: bool = False
    """Whether it is a function, quick enough for hundreds of runs in CI."""


def _reader(name: str, base: str, files: tuple[str, ...], work: Work) -> Target:
    return Target(name, base, files, work, (0,), reader=True)


def _command(name: str, base: str, files: tuple[str, ...], *arguments: str) -> Target:
    """``{base}``, ``{all}`` and ``{out}`` in the arguments stand for folders."""

    def work(folder: Path, bases: Path, out: Path) -> None:
        cli(*(argument.format(base=folder, all=bases, out=out) for argument in arguments))

    return Target(name, base, files, work)


def _import(folder: Path, _: Path, out: Path) -> None:
    dataset = import_format_of(folder).read(folder, ImportContext(out))
    try:
        pl.collect_all(dataset.tables.values())
    except pl.exceptions.PolarsError as error:  # as where the data set is written
        raise DatasetError(first_line(error)) from error


def _import_below(name: str) -> Work:
    return lambda folder, bases, out: _import(folder / name, bases, out)


def _truth(kind: str) -> Work:
    return lambda folder, _, __: READERS[kind](folder / f"truths/truth{kind}")


def _scans(folder: Path, _: Path, __: Path) -> None:
    for path in sorted((folder / "scans").glob("scans.*")):
        list(scan_blocks(path, BadLines(path.name), str))


def _dataset(folder: Path, _: Path, __: Path) -> None:
    dataset = open_dataset(folder)
    for table in dataset.tables.values():
        table.head(10).collect()


def _labelled(folder: Path, _: Path, __: Path) -> None:
    for session in open_labelled(folder).sessions:
        session.result()
        session.table("wifi", ("time_ns", "x", "y", "bssid"))


_SITE_FILES = ("site.toml", "*.csv", "plan.*", "floor_0/*.csv", "floor_0/floorplan.*", "corrections.toml")
_SESSION_FILES = ("floor_0/*/*/*",)
_REGISTER = ("register", "{base}/register/site", "--floor", "1", "--out", "{out}/r")
_REBASE = (
    "site",
    "rebase",
    "{base}",
    "--by",
    "{all}/small/texts/rebase.toml",
    "--to",
    "{all}/survey",
    "--out",
    "{out}/b",
)
_SET_FILES = ("*.json", "*.parquet", "splits/*", "dataset.toml")
_SET_COMMANDS: dict[str, tuple[str, ...]] = {
    "split": ("split", "{base}", "--by", "block", "--name", "new"),
    "train": ("train", "{base}", "--model", "weighted-knn", "--out", "{out}/m.v2t"),
    "figures": ("figures", "{base}", "--out", "{out}/f"),
    "radio-maps": ("radio-maps", "{base}", "--out", "{out}/r"),
    "export uji": ("export", "{base}", "--format", "uji", "--out", "{out}/u"),
    "export hdf5": ("export", "{base}", "--format", "hdf5", "--out", "{out}/h"),
    "export comford": ("export", "{base}", "--format", "comford", "--out", "{out}/c"),
    "export geojson": ("export", "{base}", "--format", "geojson", "--out", "{out}/g"),
    "join": ("join", "{all}/set", "{base}", "--out", "{out}/j"),
    "verify": ("verify", "{all}/set", "{base}"),
    "locate a set": ("locate", "{all}/knn/model.v2t", "{base}", "--out", "{out}/p.csv"),
    "rebase a set": _REBASE,
}
_SURVEY_COMMANDS: dict[str, tuple[str, ...]] = {
    "inspect": ("inspect", "{base}"),
    "process": ("process", "{base}", "--out", "{out}/o", "--jobs", "1"),
    "check": ("check", "{base}", "--out", "{out}/c", "--jobs", "1"),
    "survey-landmarks": ("survey-landmarks", "{base}", "--out", "{out}/lm.csv", "--jobs", "1"),
}

TARGETS: tuple[Target, ...] = (
    _reader("site", "site", _SITE_FILES, lambda folder, _, __: read_site(folder)),
    _reader("corrections", "site", ("corrections.toml",), lambda folder, _, __: read_corrections(folder)),
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
        lambda f, _, __: read_station_track(f / "truths/tachy.csv"),
    ),
    _reader("shots of a station", "small", ("truths/shots.csv",), lambda f, _, __: read_shots(f / "truths/shots.csv")),
    _reader("route", "small", ("truths/route.csv",), lambda f, _, __: read_route(f, f / "truths", ["1", "2", "3"])),
    _reader(
        "tape",
        "small",
        ("register/tape.csv",),
        lambda f, _, __: read_distances(f / "register/tape.csv", RegistrationSettings()),
    ),
    _reader(
        "targets",
        "small",
        ("register/targets.csv",),
        lambda f, _, __: read_targets(f / "register/targets.csv", RegistrationSettings()),
    ),
    _reader(
        "scans",
        "small",
        ("scans/scans.csv", "scans/scans.jsonl"),
        lambda f, _, __: [
            list(scan_blocks(f / f"scans/scans.{kind}", BadLines("scans"), str)) for kind in ("csv", "jsonl")
        ],
    ),
    _reader("track", "small", ("scans/track.csv",), lambda f, _, __: Tracks(f / "scans/track.csv")),
    _reader("session zip", "small", ("zip/*",), lambda f, _, out: unpack(f / "zip/session.zip", out / "z", 10**7)),
    _reader("labels", "labels", ("*.json", "*/*.json", "*/*.parquet"), _labelled),
    _reader("data set", "set", _SET_FILES, _dataset),
    *(
        _reader(f"model {name}", name, ("model.v2t",), lambda f, _, __: load_model(f / "model.v2t"))
        for name in ("knn", "trees", "cells")
    ),
    *(
        _reader(f"import {name}", "imports", (f"{name}/**/*",), _import_below(name))
        for name in ("getsensordata", "ilc20", "tampere", "uts", "tampere_zip", "uts_tar")
    ),
    *(_reader(f"import {name}", name, ("**/*",), _import) for name in ("uji", "comford", "parquet", "gia")),
    *(
        _command(f"{name} {base}", base, (*_SITE_FILES, *_SESSION_FILES), *arguments)
        for base in ("survey", "phone")
        for name, arguments in _SURVEY_COMMANDS.items()
    ),
    *(_command(name, "set", _SET_FILES, *arguments) for name, arguments in _SET_COMMANDS.items()),
    _command(
        "evaluate",
        "evaluated",
        ("floor_0/*.csv", "floor_0/tachymeter/*", "floor_0/*/*/tr*", "floor_0/*/*/ref*", "floor_0/*/*/ta*"),
        "evaluate",
        "{base}",
        "--out",
        "{out}/e",
        "--jobs",
        "1",
    ),
    _command("site show", "site", _SITE_FILES, "site", "show", "{base}"),
    _command("site write", "site", _SITE_FILES, "site", "write", "{base}", "--out", "{out}/w"),
    _command("site walkable", "site", _SITE_FILES, "site", "walkable", "{base}", "--floor", "1", "--out", "{out}/w"),
    _command("plan", "survey", _SITE_FILES, "plan", "{base}", "--out", "{out}/p", "--time-limit-s", "5"),
    _command("sheets", "survey", _SITE_FILES, "sheets", "{base}", "--out", "{out}/s"),
    _command(
        "sheets of images",
        "small",
        ("images/*",),
        "sheets",
        "--ids",
        "1",
        "--images",
        "{base}/images",
        "--out",
        "{out}/s",
    ),
    _command(
        "dataset",
        "labels",
        ("*.json", "*/*.json", "*/*.parquet"),
        "dataset",
        "{base}",
        "--survey",
        "{all}/survey",
        "--out",
        "{out}/d",
        "--jobs",
        "1",
    ),
    _command(
        "dataset described",
        "small",
        ("texts/dataset.toml",),
        "dataset",
        "{all}/labels",
        "--describe",
        "{base}/texts/dataset.toml",
        "--out",
        "{out}/d",
        "--jobs",
        "1",
    ),
    _command(
        "export gia",
        "labels",
        ("*.json", "*/*.json", "*/*.parquet"),
        "export",
        "{base}",
        "--format",
        "gia",
        "--survey",
        "{all}/survey",
        "--out",
        "{out}/g",
    ),
    _command(
        "export tum",
        "labels",
        ("*.json", "*/*.json", "*/*.parquet"),
        "export",
        "{base}",
        "--format",
        "tum",
        "--out",
        "{out}/t",
    ),
    _command(
        "rebase labels",
        "labels",
        ("*.json", "*/*.json", "*/*.parquet"),
        *_REBASE,
    ),
    _command(
        "rebase by",
        "small",
        ("texts/rebase.toml",),
        "site",
        "rebase",
        "{all}/set",
        "--by",
        "{base}/texts/rebase.toml",
        "--to",
        "{all}/survey",
        "--out",
        "{out}/b",
    ),
    _command(
        "process with settings",
        "small",
        ("texts/config.toml",),
        "process",
        "{all}/survey",
        "--config",
        "{base}/texts/config.toml",
        "--out",
        "{out}/o",
        "--jobs",
        "1",
    ),
    *(
        _command(
            f"locate {name}", name, ("model.v2t",), "locate", "{base}/model.v2t", "{all}/set", "--out", "{out}/p.csv"
        )
        for name in ("knn", "trees", "cells")
    ),
    _command(
        "locate scans",
        "small",
        ("scans/scans.csv", "scans/track.csv"),
        "locate",
        "{all}/knn/model.v2t",
        "{base}/scans/scans.csv",
        "--track",
        "{base}/scans/track.csv",
        "--out",
        "{out}/p.csv",
    ),
    _command(
        "register by station",
        "small",
        ("register/S1.csv", "register/control.csv", "register/site/**/*.csv"),
        *_REGISTER,
        "--station",
        "{base}/register/S1.csv",
        "--control",
        "{base}/register/control.csv",
        "--landmark-names",
        "LM*",
    ),
    _command(
        "register by tape",
        "small",
        ("register/t*.csv", "register/site/**/*.csv"),
        *_REGISTER,
        "--tape",
        "{base}/register/tape.csv",
        "--targets",
        "{base}/register/targets.csv",
    ),
    _command("receive a zip", "small", ("zip/*",), "receive", "{out}", "{base}/zip/session.zip"),
    *(
        _command(
            f"import {name} by command", "imports", (f"{name}/**/*",), "import", f"{{base}}/{name}", "--out", "{out}/i"
        )
        for name in ("getsensordata", "ilc20", "tampere_zip", "uts_tar")
    ),
    *(
        _command(f"import {name} by command", name, ("**/*",), "import", "{base}", "--out", "{out}/i")
        for name in ("uji", "gia")
    ),
)
