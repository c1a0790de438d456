"""What all figures share: sizes of a two-column page, lettering, colours, and files with the same bytes each time."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import ParamSpec

import matplotlib as mpl
from matplotlib.figure import Figure

COLUMN_IN, PAGE_IN = 3.5, 7.16
"""Widths of one column and of a page with two, inches."""
LANDMARK, TRUTH, QUIET, DISCARDED = "#d55e00", "#000000", "#8c959f", "#cc79a7"
"""Colours, of Okabe and Ito where hue matters: the colour-blind can tell them apart."""

_Args = ParamSpec("_Args")
_STYLE = Path(__file__).with_name("print.mplstyle")
_STRATEGIES = {
    "local": ("Local", "#e69f00"),
    "local-corrected": ("Local (corrected)", "#0072b2"),
    "global": ("Global", "#cc79a7"),
    "global-affine": ("Global (LS)", "#cc79a7"),
    "smoother": ("Smoother", "#009e73"),
}


def print_quality(draw: Callable[_Args, Figure]) -> Callable[_Args, Figure]:
    """Let a function draw in the style of print; matplotlib's own settings stay as they are."""

    @wraps(draw)
    def drawn(*args: _Args.args, **kwargs: _Args.kwargs) -> Figure:
        with mpl.rc_context(fname=_STYLE):
            return draw(*args, **kwargs)

    return drawn


def name_of(strategy: str) -> str:
    """How a strategy is called in figures and tables: the paper's name where it has one."""
    return _STRATEGIES[strategy][0] if strategy in _STRATEGIES else strategy


def colour_of(strategy: str) -> str:
    """Colour of a strategy, the same in all figures; grey for one that is not the package's own."""
    return _STRATEGIES[strategy][1] if strategy in _STRATEGIES else QUIET


def rendered(figure: Figure, kind: str) -> bytes:
    """Bytes of a figure as ``svg``, ``pdf`` or ``png``; equal figures give equal bytes."""
    dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    buffer = io.BytesIO()
    with mpl.rc_context(fname=_STYLE):
        figure.savefig(buffer, format=kind, bbox_inches="tight", pad_inches=0.02, dpi=300, metadata=dates.get(kind, {}))
    return buffer.getvalue()
