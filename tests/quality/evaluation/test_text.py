from __future__ import annotations

import csv

import numpy as np

from tests.quality.evaluation.test_metrics import session, walk
from vislam2tag.quality.evaluation.metrics import table_rows
from vislam2tag.quality.evaluation.record import DenseRow, FigureWithInterval
from vislam2tag.quality.evaluation.text import (
    dense_csv,
    figure_text,
    latex_text,
    rows_csv,
    sessions_csv,
    truth_name,
)

SESSIONS = [session(str(i), walk(np.array([0.1 * i, 1.0]), "local_50%")) for i in range(6)]


def test_rows_have_their_bounds_beside_them() -> None:
    rows = table_rows(SESSIONS)
    [first, *_] = list(csv.DictReader(rows_csv(rows).splitlines()))
    mean = rows[0].mean_m
    assert (float(first["mean_m"]), float(first["mean_m_low"]), float(first["mean_m_high"])) == (
        mean.value,
        mean.low,
        mean.high,
    )
    assert (first["max_m_low"], first["over"], first["walks"]) == ("", "walks", "6")


def test_a_session_without_figures_has_a_line_that_says_why() -> None:
    failed = session("b").model_copy(update={"error": "no poses, none"})
    silent = session("c").model_copy(update={"missing": ["no presses"]})
    lines = list(csv.DictReader(sessions_csv([*SESSIONS[:1], failed, silent]).splitlines()))
    assert [line["session"] for line in lines] == ["0", "b", "c"]
    assert [line["error"] for line in lines] == ["", "no poses, none", "no presses"]
    assert (lines[0]["mean_m"], lines[1]["mean_m"]) == ("0.5", "")


def test_latex_escapes_names_and_has_a_line_for_each_selection() -> None:
    text = latex_text(table_rows(SESSIONS))
    assert "all walks & local\\_50\\% & 6 & 100\\,\\% & 0.62 [" in text
    assert text.count("\\midrule") == 2
    assert all(line.count("&") == 12 for line in text.splitlines() if line.endswith("\\\\"))


def test_dense_rows() -> None:
    row = DenseRow(strategy="local", what="speed", low=2.5, high=None, points=3, mean_m=0.5, labelled=1.0)
    assert dense_csv([row]).splitlines()[1] == "local,speed,2.5,,3,0.5,,1.0"


def test_figures_and_names_as_people_read_them() -> None:
    assert figure_text(FigureWithInterval(value=0.314, low=0.25, high=0.4)) == "0.31 [0.25 to 0.40]"
    assert figure_text(FigureWithInterval(value=None)) == "-"
    assert truth_name("control_points", "nearest") == "control points (nearest)"
    assert truth_name("dense", "") == "dense truth"
