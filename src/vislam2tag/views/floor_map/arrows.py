"""Arrows on a floor's map from where a landmark was surveyed to where the walks put it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from vislam2tag.labeling.results import LandmarkContradiction
from vislam2tag.views.floor_map.layers import Columns, Trace, plotly_text

_RED = "#b00020"
_BARB = 0.25
"""Length of the arrow's barbs as a share of its own."""
_BARB_TURN = np.exp(1j * np.pi * (1 - 1 / 7))


def arrows(contradictions: Sequence[LandmarkContradiction]) -> list[Trace]:
    """Return one trace with an arrow, true to scale, and a text at its tip for each; none where nothing contradicts."""
    if not contradictions:
        return []
    columns: Columns = {"x": [], "y": [], "text": [], "textposition": [], "hovertext": []}
    for found in contradictions:
        line = arrow_line(complex(*found.surveyed_m), complex(*found.offset_m))
        columns["x"] += [*np.round(line.real, 3).tolist(), None]
        columns["y"] += [*np.round(line.imag, 3).tolist(), None]
        columns["text"] += ["", plotly_text(_label(found)), *[""] * 4]
        columns["textposition"] += ["middle left" if found.offset_m[0] < 0 else "middle right"] * 6
        columns["hovertext"] += [plotly_text(_sentence(found))] * 6
    return [
        {
            "type": "scatter",
            "mode": "lines+text",
            "name": "contradicting landmark",
            "line": {"color": _RED, "width": 2.5},
            "textfont": {"size": 12, "color": _RED, "shadow": "0 0 2px white, 0 0 2px white, 0 0 3px white"},
            "hovertemplate": "%{hovertext}<extra></extra>",
            **columns,
        }
    ]


def size_m(found: LandmarkContradiction) -> float:
    """Length of the mean offset, metres."""
    return math.hypot(*found.offset_m)


def arrow_line(start: complex, offset: complex) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return the points (5,) of an arrow in one line: start, tip, one barb, tip, the other barb; x + iy, metres."""
    tip = start + offset
    one, other = tip + _BARB * offset * _BARB_TURN, tip + _BARB * offset / _BARB_TURN
    return np.array([start, tip, one, tip, other])


def _label(found: LandmarkContradiction) -> str:
    return f"{found.landmark}: {size_m(found):.2f} m off"


def _sentence(found: LandmarkContradiction) -> str:
    return (
        f"{found.called} contradicts the others<br>by {size_m(found):.2f} m "
        f"(in {found.sessions} of the {found.seen} sessions that logged it)"
    )
