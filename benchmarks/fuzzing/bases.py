"""What is damaged: small surveys, plans, data sets, models, exports and archives, made once by the program itself."""

from __future__ import annotations

import os
import shutil
import sys
import tarfile
from collections.abc import Callable
from pathlib import Path

from tests.receiving.zips import session_zip
from tests.survey.plans import drawn_floor

from vislam2tag.cli import main

CORPUS = Path(__file__).resolve().parents[2] / "tests" / "corpus"
"""Small files kept in the repository: formats that the program does not write, and what once broke it."""
_SMALL = ("--floors", "1", "--devices", "1", "--sessions", "2", "--landmark-count", "20", "--minutes", "0.5")


def cli(*arguments: str | Path) -> None:
    """Run a command in this process; raises SystemExit with its code."""
    sys.argv = ["vislam2tag", *map(str, arguments)]
    main()


def make_bases(root: Path) -> None:
    """Make everything that is not there yet; each in a process of its own, since commands end by exiting."""
    root.mkdir(parents=True, exist_ok=True)
    for name, make in _BASES.items():
        if not (root / name).exists():
            partial = root / f".{name}"
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir()
            _apart(lambda make=make, partial=partial: make(root, partial))  # type: ignore[misc]
            partial.rename(root / name)


def _apart(make: Callable[[], None]) -> None:
    child = os.fork()
    if not child:
        try:
            make()
        except SystemExit as ended:
            os._exit(ended.code if isinstance(ended.code, int) else 0)
        except BaseException as error:
            print(f"a base cannot be made: {error!r}", file=sys.stderr)
            os._exit(1)
        os._exit(0)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise SystemExit("a base cannot be made")


def _survey(_: Path, out: Path) -> None:
    out.rmdir()
    cli("simulate", out, *_SMALL, "--pressure", "--severity", "mild", "--locale", "en")


def _phone(_: Path, out: Path) -> None:
    out.rmdir()
    cli("simulate", out, *_SMALL, "--pressure", "--ble", "--format", "phone")


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
    imdf = drawn_floor.imdf(out, archive=True)
    text = '[building]\nname = "B"\n[georeference]\nlatitude_deg = 50.0\nlongitude_deg = 6.0\nbearing_deg = 20.0\n'
    for number, plan in enumerate([*plans.values(), imdf]):
        scale = "extent = { width_m = 60.0, height_m = 32.0 }" if number else "unit_m = 0.1"
        level = 'level = "0"\n' if plan == imdf else ""
        text += f'[[floors]]\nnumber = {number}\nelevation_m = {4 * number}.0\n[floors.plan]\nfile = "{plan.name}"\n'
        text += f"{level}{scale}\n"
    (out / "site.toml").write_text(text)
    shutil.copy(CORPUS / "texts" / "corrections.toml", out)


def _labels(root: Path, out: Path) -> None:
    cli("process", root / "survey", "--out", out, "--jobs", "1")


def _set(root: Path, out: Path) -> None:
    out.rmdir()
    cli("dataset", root / "labels", "--survey", root / "survey", "--out", out, "--jobs", "1")


def _made_by(*command: str) -> Callable[[Path, Path], None]:
    """A base that one command writes of the data set, into a folder."""

    def make(root: Path, out: Path) -> None:
        cli(command[0], root / "set", *command[1:], "--out", out / command[-1] if command[0] == "train" else out)

    return make


def _gia(root: Path, out: Path) -> None:
    """The layout, with as few readings as a quick run needs."""
    _apart(lambda: cli("export", root / "labels", "--format", "gia", "--out", out))
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


def _small(_: Path, out: Path) -> None:
    """All that is one file, or a few."""
    for name in ("register", "truths", "scans", "texts"):
        shutil.copytree(CORPUS / name, out / name)
    (out / "zip").mkdir()
    (out / "zip" / "session.zip").write_bytes(session_zip())
    (out / "images").mkdir()
    drawn_floor.png(out / "images", name="1.png")


def _model(name: str) -> Callable[[Path, Path], None]:
    return lambda root, out: cli("train", root / "set", "--model", name, "--out", out / "model.v2t")


_BASES: dict[str, Callable[[Path, Path], None]] = {
    "survey": _survey,
    "phone": _phone,
    "evaluated": _evaluated,
    "site": _site,
    "labels": _labels,
    "set": _set,
    "uji": _made_by("export", "--format", "uji"),
    "comford": _made_by("export", "--format", "comford"),
    "parquet": _made_by("export", "--format", "parquet"),
    "gia": _gia,
    "knn": _model("weighted-knn"),
    "trees": _model("extra-trees"),
    "cells": _model("cell-density"),
    "imports": _imports,
    "small": _small,
}
