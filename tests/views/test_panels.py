from __future__ import annotations

import subprocess
import sys

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from vislam2tag.estimation.strategy import strategy_names
from vislam2tag.views.panels import colour_of, name_of, print_quality, rendered


@print_quality
def a_figure() -> Figure:
    figure = Figure(figsize=(2, 1))
    figure.subplots().plot([0, 1], [0, 1], label="walk")
    return figure


@pytest.mark.parametrize(("kind", "head"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_equal_figures_give_equal_bytes(kind: str, head: bytes) -> None:
    first = rendered(a_figure(), kind)
    assert first.startswith(head)
    assert first == rendered(a_figure(), kind)


def test_style_is_matplotlibs_only_while_drawing() -> None:
    before = mpl.rcParams["font.size"], mpl.rcParams["svg.hashsalt"]
    figure = a_figure()
    rendered(figure, "svg")
    assert (mpl.rcParams["font.size"], mpl.rcParams["svg.hashsalt"]) == before
    assert figure.axes[0].xaxis.label.get_fontsize() == 7


def test_letters_are_outlines() -> None:
    assert b"<text" not in rendered(a_figure(), "svg")


def test_every_strategy_has_a_colour_and_only_the_two_global_ones_share_it() -> None:
    names = strategy_names()
    assert len({name_of(name) for name in names}) == len(names)
    assert len({colour_of(name) for name in names}) == len(names) - 1


def test_no_window_system_is_touched() -> None:
    code = (
        "import sys, vislam2tag.views.site_figures, vislam2tag.views.error_figures, "
        "vislam2tag.views.error_figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
