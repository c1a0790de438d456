"""Heights: each station's frame lies higher than the building's by one number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.registration.gross_errors import explanations, listed
from vislam2tag.preparation.registration.least_squares import Adjusted, adjust, suspicious
from vislam2tag.preparation.registration.names import point_label
from vislam2tag.preparation.registration.settings import RegistrationSettings

KNOWN_HEIGHT = ""
"""The station of a known height: it has no shift."""


@dataclass(frozen=True)
class MeasuredHeight:
    """One measured height, metres: in a station's frame, or known (station :data:`KNOWN_HEIGHT`)."""

    point: str
    station: str
    height_m: float
    sigma_m: float
    source: str = ""

    @property
    def label(self) -> str:
        """How messages call it."""
        what = f"height of {point_label(self.point)} from {self.station}"
        what = what if self.station else f"known height of {point_label(self.point)}"
        return f"{what} ({self.source})" if self.source else what


@dataclass(frozen=True)
class HeightFit:
    """Heights of points in the building with their standard deviation, metres, by point; what was left out."""

    heights: dict[str, tuple[float, float]]
    errors: tuple[str, ...]
    untied: tuple[str, ...]
    """Stations whose height nothing tells."""
    sigma0: float | None


def adjust_heights(measured: Sequence[MeasuredHeight], settings: RegistrationSettings) -> HeightFit:
    """Adjust all heights that are tied to a known one; leave out, and name, what contradicts the others."""
    good, untied = _tied_to_known(measured)
    errors: list[str] = []
    while good:
        points, values, adjusted = _solve(good, settings.prior_freedom)
        groups = [np.array((i,)) for i in range(len(good))]
        suspects = [i for i, _ in suspicious(adjusted, groups, adjusted.noise_level, settings.false_alarm)]
        if not suspects:
            sigma = np.sqrt(np.diag(adjusted.cofactor)[: len(points)] * adjusted.variance_factor)
            heights = {name: (float(values[i]), float(sigma[i])) for i, name in enumerate(points)}
            return HeightFit(heights, tuple(errors), untied, adjusted.sigma0)
        sigmas = np.array([one.sigma_m for one in good])
        found = explanations(adjusted, groups, sigmas, adjusted.noise_level, suspects, ())
        wrong = sorted(i for one in found for i in one.measurements)
        names = listed([good[i].label for i in wrong])
        errors.append(
            f"{names} {'is off' if len(wrong) == 1 else 'contradict each other (nothing tells which is off)'}"
        )
        good, further = _tied_to_known([one for i, one in enumerate(good) if i not in wrong])
        untied += further
    return HeightFit({}, tuple(errors), untied, None)


def _tied_to_known(measured: Sequence[MeasuredHeight]) -> tuple[list[MeasuredHeight], tuple[str, ...]]:
    """What is tied to a known height, and the stations that are not."""
    graph = nx.Graph()
    graph.add_node(("station", KNOWN_HEIGHT))
    graph.add_edges_from((("station", one.station), ("point", one.point)) for one in measured)
    tied = nx.node_connected_component(graph, ("station", KNOWN_HEIGHT))
    kept = [one for one in measured if ("station", one.station) in tied]
    stations = dict.fromkeys(one.station for one in measured)
    return kept, tuple(name for name in stations if ("station", name) not in tied)


def _solve(good: Sequence[MeasuredHeight], prior_freedom: float) -> tuple[list[str], FloatArray, Adjusted]:
    """Heights of the points (k,) by least squares: measured = height + the station's shift."""
    points = list(dict.fromkeys(one.point for one in good))
    stations = list(dict.fromkeys(one.station for one in good if one.station != KNOWN_HEIGHT))
    rows = np.arange(len(good))
    design = np.zeros((len(good), len(points) + len(stations)))
    design[rows, [points.index(one.point) for one in good]] = 1.0
    for row, one in enumerate(good):
        if one.station != KNOWN_HEIGHT:
            design[row, len(points) + stations.index(one.station)] = 1.0
    sigma = np.array([one.sigma_m for one in good])
    values, adjusted = adjust(design / sigma[:, None], np.array([one.height_m for one in good]) / sigma, prior_freedom)
    return points, values, adjusted
