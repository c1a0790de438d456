"""A survey without landmarks, made from a plan and simulated walks that its shape alone does not place."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
from typer.testing import CliRunner

from vislam2tag.cli.app import app

FLOOR, DEVICE, WIDTH_M = 0, "LG", 60.0
AMBIGUOUS = 502, 1.0
"""Seed and minutes of a walk whose shape fits several places, and which one tap places."""


def write_unplaced_survey(root: Path, seed: int, minutes: float, sessions: int = 1) -> Path:
    """Walks on one floor, which has a plan and no landmark; each folder keeps its truth."""
    walked, survey = root / "walked", root / "survey"
    counts = ("--floors", "1", "--devices", "1", "--sessions", str(sessions))
    _run("simulate", str(walked), *counts, "--minutes", str(minutes), "--seed", str(seed))
    plan = walked / f"floor_{FLOOR}" / "floorplan.jpg"
    _run("site", "init", str(survey), "--plan", str(plan), "--floor", str(FLOOR), "--width-m", str(WIDTH_M))
    no_landmarks = shutil.ignore_patterns("initPoses.csv")
    shutil.copytree(plan.parent / DEVICE, survey / f"floor_{FLOOR}" / DEVICE, ignore=no_landmarks)
    return survey


def true_place(survey: Path, session: str, time_s: float) -> tuple[float, float]:
    """Where a walk truly was at a time, metres in the BCS."""
    truth = pl.read_csv(survey / f"floor_{FLOOR}" / DEVICE / session / "truth.csv")
    since = (truth["time_ns"] - truth["time_ns"][0]) * 1e-9
    row = truth.row(int((since - time_s).abs().arg_min() or 0), named=True)
    return row["x"], row["y"]


def set_tap(survey: Path, session: str, at_s: float, x: float, y: float) -> None:
    """Write one tap as the only correction."""
    entry = f'[[set_tap]]\nsession = "{session}"\nat_s = {at_s}\nx = {x}\ny = {y}\n'
    (survey / "corrections.toml").write_text(entry, encoding="utf-8")


def _run(*arguments: str) -> None:
    done = CliRunner().invoke(app, ["-q", *arguments])
    assert done.exit_code == 0, done.output
