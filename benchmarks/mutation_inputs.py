"""Clean inputs of the campaign of semantic mutations, the commands that read them, and the results to compare.

Every input is made by the program for a seed, which also selects its settings, and is kept in a folder.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from mutation_results import Table
from mutation_tables import Rows
from typer.testing import CliRunner

from vislam2tag.cli.app import app

VARIANTS = (
    (),
    ("--severity", "mild", "--locale", "en"),
    ("--names", "paper"),
    ("--severity", "none", "--pressure"),
    ("--locale", "en", "--column", "sigma"),
    ("--severity", "severe"),
)
"""Settings of surveys; a seed takes one."""
_SIZES = (("60.0", "32.0"), ("45.0", "30.0"), ("80.0", "24.0"))


_OK = pl.col("status") == "ok"
_PLACE = ("x", "y")
LABELS = (
    Table("o/trajectory/*.parquet", ("session", "time_ns"), _PLACE, ("floor",), _OK),
    Table("o/wifi/*.parquet", ("session", "time_ns", "bssid"), _PLACE, ("rssi_dbm",), _OK),
    Table("o/wifi_*/*.parquet", ("session", "time_ns", "bssid"), _PLACE, ("rssi_dbm",)),
    Table("o/ble/*.parquet", ("session", "time_ns", "address"), _PLACE, ("rssi_dbm",), _OK),
    Table("o/sensors/*.parquet", ("session", "time_ns", "sensor"), _PLACE, ("v1", "v2", "v3"), _OK),
    Table("o/run.json", ("number",), (), ("width_m", "height_m")),
)
"""What ``process`` makes of a survey."""
DATA_SET = (
    Table("o/fingerprints.parquet", ("scan_id",), _PLACE, ("floor", "start_ns")),
    Table("o/readings.parquet", ("scan_id", "bssid"), (), ("rssi_dbm",)),
)
LABELLED = (Table("l.csv", ("row",), ("x_m", "y_m"), ("floor",), pl.col("status") == "ok"),)
LANDMARKS = (Table("o/marker_dict.csv", ("id",), _PLACE),)
LOCATED = (Table("p.csv", ("scan_id",), _PLACE, ("floor", "status")),)
PROCESS = "process {base}/survey --out {out}/o --jobs 1"


@dataclass(frozen=True)
class Input:
    """A clean input: how it is made for a seed, the commands that read it one after the other, and their tables."""

    make: Callable[[Path, int], None]
    commands: tuple[str, ...]
    tables: tuple[Table, ...]


def run(command: str, **folders: Path) -> tuple[int, str]:
    """Run a command in this process; returns its exit code and all that it prints. ``{NAME}`` are folders."""
    base = folders.get("base")
    if base is not None and "{walk}" in command:
        folders["walk"] = walks(base)[0]
    words = [word.format(**folders) for word in command.split()]
    result = CliRunner().invoke(app, words, terminal_width=200)
    text = result.output
    error = result.exception
    if error is not None and not isinstance(error, SystemExit):
        text += f"error: {error}\n" if type(error).__module__.startswith("vislam2tag") else f"Traceback: {error!r}\n"
        return 2, text
    return result.exit_code, text


def made(work: Path, name: str, seed: int) -> Path:
    """Folder of an input, which is made unless it is there."""
    folder = work / "inputs" / f"{name}-{seed}"
    if not folder.exists():
        partial = folder.with_name(f".{folder.name}")
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        INPUTS[name].make(partial, seed)
        partial.rename(folder)
    return folder


def _must(command: str, **folders: Path) -> None:
    code, text = run(command, **folders)
    if code:
        raise SystemExit(f"{command}: {text}")


def _simulate(out: Path, seed: int, sizes: str, more: str = "") -> None:
    width, height = _SIZES[seed % len(_SIZES)]
    settings = out.with_suffix(".toml")
    settings.write_text(f"[simulation.building]\nwidth_m = {width}\nheight_m = {height}\n", encoding="utf-8")
    options = " ".join(VARIANTS[seed % len(VARIANTS)])
    _must(f"simulate {{out}} {sizes} --seed {seed} --config {{settings}} {options} {more}", out=out, settings=settings)


def _survey(folder: Path, seed: int) -> None:
    _simulate(folder / "survey", seed, "--floors 1 --devices 2 --sessions 2 --minutes 1.5 --landmark-count 10")


def _storeys(folder: Path, seed: int) -> None:
    """Two floors of different sizes."""
    _simulate(folder / "survey", seed, "--floors 2 --devices 2 --sessions 1 --minutes 1.5")


def _phone(folder: Path, seed: int) -> None:
    _simulate(folder / "survey", seed, "--floors 1 --devices 1 --sessions 2 --minutes 1.5", "--format phone --ble")


def _labels(folder: Path, seed: int) -> Path:
    """Labels of a small survey; returns the survey."""
    _simulate(folder / "survey", seed, "--floors 1 --devices 1 --sessions 2 --minutes 2")
    _must("process {survey} --out {out} --jobs 1", survey=folder / "survey", out=folder / "labels")
    (folder / "labels" / "report.html").unlink()
    return folder / "survey"


def walks(folder: Path) -> list[Path]:
    """Folders of all walks of a survey."""
    return sorted(folder.glob("survey/floor_*/*/*/"))


def _label(folder: Path, seed: int) -> None:
    """A table of an instrument with boot times in ns, one with local dates, and labels."""
    _labels(folder, seed)
    frames = pl.read_parquet(min((folder / "labels" / "trajectory").glob("*.parquet")))["time_ns"].gather_every(15)
    value = (400 + 20 * np.sin(np.arange(len(frames)) / 9)).round(2)
    table = pl.DataFrame({"time_ns": frames, "co2_ppm": value, "level_dbm": (-60 - value / 40).round(1)})
    table.write_csv(folder / "table.csv")


OFFSET_S = 1_635_000_000
"""Of the clock of a table with dates from the boot clock of the walks."""
_ZONE = "Europe/Berlin"


def _dates(folder: Path, seed: int) -> None:
    """A table of an instrument with dates of a time zone, and labels."""
    _label(folder, seed)
    table = pl.read_csv(folder / "table.csv")
    local = pl.from_epoch(pl.col("time_ns") + OFFSET_S * 10**9, "ns").dt.replace_time_zone("UTC")
    date = local.dt.convert_time_zone(_ZONE).dt.to_string("%Y-%m-%dT%H:%M:%S%.6f")
    table.select(date.alias("datetime"), pl.exclude("time_ns")).write_csv(folder / "table.csv")


def _sensor_rows(walk: Path) -> list[list[str]]:
    """Rows of a walk's accelerometer and gyroscope as one table: seconds, then three values each."""
    rows = Rows.read(next(each for each in walk.iterdir() if each.name.lower() == "sensors.csv")).rows
    by_kind = {kind: [row for row in rows if row[1] == kind] for kind in ("ACC", "GYRO")}
    start = int(by_kind["GYRO"][0][0])
    pairs = zip(by_kind["ACC"], by_kind["GYRO"], strict=False)
    return [[f"{(int(gyro[0]) - start) / 1e9:.6f}", *acc[2:5], *gyro[2:5]] for acc, gyro in pairs]


def _attach(folder: Path, seed: int) -> None:
    """A walk without sensors, and these as the table of another device with a clock of its own."""
    _simulate(folder / "survey", seed, "--floors 1 --devices 1 --sessions 2 --minutes 2")
    first, second = walks(folder)
    head = "Time (s),acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z\n"
    for name, source in (("other.csv", first), ("foreign.csv", second)):
        lines = (",".join(row) for row in _sensor_rows(source))
        (folder / name).write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    next(each for each in first.iterdir() if each.name.lower() == "sensors.csv").unlink()


def _attach_wifi(folder: Path, seed: int) -> None:
    """A walk with Wi-Fi, and a second phone's log of the same access points with Unix times."""
    _simulate(folder / "survey", seed, "--floors 1 --devices 1 --sessions 1 --minutes 3")
    (walk,) = walks(folder)
    rows = Rows.read(next(each for each in walk.iterdir() if each.name.lower() == "wifi.csv")).rows
    shift_us = 1_640_000_000_000_000 - int(rows[0][1])
    lines = (f"{int(row[1]) + shift_us + 350_000},{row[4]},{int(float(row[5])) - 2}" for row in rows)
    (folder / "other.csv").write_text("time_us,bssid,rssi_dbm\n" + "\n".join(lines) + "\n", encoding="utf-8")


def _data_set(folder: Path, seed: int) -> Path:
    """The data set of a small survey."""
    survey = _labels(folder, seed)
    _must(
        "dataset {labels} --survey {survey} --out {out} --jobs 1",
        labels=folder / "labels",
        survey=survey,
        out=folder / "set",
    )
    return folder / "set"


def _only(folder: Path, *names: str) -> None:
    for path in folder.iterdir():
        if path.name not in names:
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _exported(kind: str) -> Callable[[Path, int], None]:
    def make(folder: Path, seed: int) -> None:
        source = _data_set(folder, seed)
        _must(f"export {{set}} --format {kind} --out {{out}}", set=source, out=folder / "table")
        (folder / "table" / "export.json").unlink()
        _only(folder, "table")

    return make


def _scans(folder: Path, seed: int) -> None:
    """A model, and scans to locate."""
    source = _data_set(folder, seed)
    _must("train {set} --model weighted-knn --out {out}", set=source, out=folder / "model.v2t")
    readings = pl.read_parquet(source / "readings.parquet").head(400)
    scans = readings.select("scan_id", "bssid", rssi_dbm=pl.col("rssi_dbm").round().cast(pl.Int64))
    scans.write_csv(folder / "scans.csv")
    _only(folder, "model.v2t", "scans.csv")


def _registered(folder: Path, seed: int) -> None:
    """A site, tape distances of its landmarks to corners, and a total station's export with its known points."""
    _simulate(folder / "survey", seed, "--floors 1 --devices 1 --sessions 1 --minutes 0.25 --landmark-count 8")
    (folder / "survey").rename(folder / "site")
    floor = folder / "site" / "floor_0"
    places = {row[0]: complex(float(row[1]), float(row[2])) for row in Rows.read(floor / "marker_dict.csv").rows}
    width, height = map(float, _SIZES[seed % len(_SIZES)])
    corners = {"K1": 0j, "K2": complex(width, 0), "K3": complex(width, height), "K4": complex(0, height)}
    rng = np.random.default_rng(seed)
    tape = [
        f"{name},{to},{abs(place - corner) + rng.normal(0, 0.005):.3f}"
        for name, place in places.items()
        for to, corner in corners.items()
    ]
    (folder / "tape.csv").write_text("landmark,to,distance_m\n" + "\n".join(tape) + "\n", encoding="utf-8")
    targets = [f"{name},{at.real},{at.imag}" for name, at in corners.items()]
    (folder / "targets.csv").write_text("name,x,y\n" + "\n".join(targets) + "\n", encoding="utf-8")
    turn, shift = np.exp(0.3j + seed), 300 + 500j
    shots = {**corners, **{f"LM{name}": place for name, place in places.items()}}
    measured = {name: place * turn / abs(turn) + shift for name, place in shots.items()}
    lines = [f"{name};{at.real + rng.normal(0, 0.002):.4f};{at.imag:.4f};1.5" for name, at in measured.items()]
    (folder / "station.csv").write_text("point;E;N;H\n" + "\n".join(lines) + "\n", encoding="utf-8")
    known = [f"{name},{at.real},{at.imag},0.005" for name, at in corners.items()]
    (folder / "control.csv").write_text("point,E,N,sigma\n" + "\n".join(known) + "\n", encoding="utf-8")


_IMPORT = ("import {base}/table --out {out}/o",)
_ATTACH = ("attach {walk} {base}/other.csv", PROCESS)
INPUTS: Mapping[str, Input] = {
    "survey": Input(_survey, (PROCESS,), LABELS),
    "storeys": Input(_storeys, (PROCESS,), LABELS),
    "phone": Input(_phone, (PROCESS,), LABELS),
    "uji": Input(_exported("uji"), _IMPORT, DATA_SET),
    "comford": Input(_exported("comford"), _IMPORT, DATA_SET),
    "label": Input(_label, ("label {base}/table.csv --labels {base}/labels --out {out}/l.csv",), LABELLED),
    "dates": Input(
        _dates,
        (
            f"label {{base}}/table.csv --labels {{base}}/labels --zone {_ZONE} --offset-s {OFFSET_S} "
            "--out {out}/l.csv",
        ),
        LABELLED,
    ),
    "attach": Input(_attach, _ATTACH, LABELS),
    "attach-wifi": Input(_attach_wifi, _ATTACH, LABELS),
    "scans": Input(_scans, ("locate {base}/model.v2t {base}/scans.csv --out {out}/p.csv",), LOCATED),
    "tape": Input(
        _registered,
        ("register {base}/site --floor 0 --tape {base}/tape.csv --targets {base}/targets.csv --out {out}/o",),
        LANDMARKS,
    ),
    "station": Input(
        _registered,
        (
            "register {base}/site --floor 0 --station {base}/station.csv --control {base}/control.csv "
            "--landmark-names LM* --out {out}/o",
        ),
        LANDMARKS,
    ),
}
