"""What is attacked: readers, called as functions here; commands stand in ``commands``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.format_registry import ImportContext, import_format_of
from vislam2tag.dataset.labelled import open_labelled
from vislam2tag.evaluation.control_points.route_file import read_route
from vislam2tag.evaluation.total_station.station_file import read_shots, read_station_track
from vislam2tag.evaluation.trajectory_files import READERS
from vislam2tag.positioning.model_file import load_model
from vislam2tag.positioning.scan_file import BadLines, Tracks, scan_blocks
from vislam2tag.registration.settings import RegistrationSettings
from vislam2tag.registration.tape_file import read_distances, read_targets
from vislam2tag.studio.receiving.zips import unpack
from vislam2tag.survey.corrections.file import read_corrections
from vislam2tag.survey.discover import read_site


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
    *(
        _reader(f"import {name}", name, ("**/*",), lambda run: _import(run.base, run.out))
        for name in ("uji", "comford", "parquet", "gia")
    ),
)
