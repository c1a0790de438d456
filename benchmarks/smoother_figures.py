"""Figures of docs/explanation/smoother.md: one walk with faults, and stated against observed regions.

python benchmarks/smoother_figures.py docs/images
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from data_sets import Walk, generated
from plotly.subplots import make_subplots
from scipy.stats import chi2
from static_figure import write_svg

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.faults import EventKind
from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.truth import errors_at_frames
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings

SEED = 3
BREAKS = 2
"""The first walk with so many breaks is drawn."""
SEVERITIES = ("mild", "default", "severe")
COLOURS = {"truth": "#999999", "local-corrected": "#d55e00", "smoother": "#0072b2"}
THINNED = 10


def main() -> None:
    """Draw both figures into a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    write_svg(one_walk(next(filter(faulty, generated([SEED], "default")))), folder / "walk.svg", 1000, 430)
    write_svg(reliability(), folder / "reliability.svg", 520, 430)


def faulty(walk: Walk) -> bool:
    """Tell whether the tracker broke down often enough on a walk to be worth a picture."""
    events = strategy_named("smoother", MappingSettings()).map(walk.camera, walk.log, walk.landmarks).events
    return sum(event.kind is EventKind.BREAK for event in events) >= BREAKS


def one_walk(walk: Walk) -> go.Figure:
    """Map of one walk, and its error, stated sigma and events over time."""
    figure = make_subplots(
        cols=2, column_widths=[0.5, 0.5], subplot_titles=("floor, m", "error and 2 sigma, m, over s")
    )
    trajectories = {
        name: strategy_named(name, MappingSettings()).map(walk.camera, walk.log, walk.landmarks)
        for name in ("local-corrected", "smoother")
    }
    assert walk.truth is not None
    draw_path(figure, "truth", walk.truth.position_bcs)
    for name, trajectory in trajectories.items():
        draw_path(figure, name, trajectory.position_bcs)
        draw_error(figure, name, trajectory, errors_at_frames(trajectory, walk.truth))
    marks = walk.landmarks.position_bcs
    figure.add_scatter(
        x=marks[:, 0],
        y=marks[:, 1],
        mode="markers",
        name="landmarks",
        marker={"symbol": "square", "color": "black"},
        row=1,
        col=1,
    )
    draw_sigma(figure, trajectories["smoother"])
    figure.update_yaxes(scaleanchor="x", row=1, col=1)
    figure.update_yaxes(range=[0, 2.5], row=1, col=2)
    figure.update_layout(template="plotly_white", legend={"orientation": "h", "y": -0.1}, margin={"t": 40, "r": 20})
    return figure


def seconds(trajectory: Trajectory) -> FloatArray:
    """Time of each frame from the first."""
    return np.asarray((trajectory.time_ns - trajectory.time_ns[0]) * 1e-9)


def draw_path(figure: go.Figure, name: str, position: FloatArray) -> None:
    """Draw a path on the map."""
    thin = position[::THINNED]
    figure.add_scatter(
        x=thin[:, 0],
        y=thin[:, 1],
        mode="lines",
        name=name,
        legendgroup=name,
        line={"color": COLOURS[name], "width": 5 if name == "truth" else 1.5},
        row=1,
        col=1,
    )


def draw_error(figure: go.Figure, name: str, trajectory: Trajectory, error: FloatArray) -> None:
    """Draw the error over time; gaps where nothing is mapped."""
    figure.add_scatter(
        x=seconds(trajectory)[::THINNED],
        y=error[::THINNED],
        mode="lines",
        legendgroup=name,
        showlegend=False,
        line={"color": COLOURS[name], "width": 1.5},
        row=1,
        col=2,
    )


def draw_sigma(figure: go.Figure, trajectory: Trajectory) -> None:
    """Draw two standard deviations as an area, and the events as lines."""
    time_s = seconds(trajectory)
    figure.add_scatter(
        x=time_s[::THINNED],
        y=2 * trajectory.sigma_m[::THINNED],
        mode="lines",
        fill="tozeroy",
        name="2 sigma of the smoother",
        line={"width": 0},
        fillcolor="rgba(0,114,178,0.2)",
        row=1,
        col=2,
    )
    for event in trajectory.events:
        if event.kind is not EventKind.MAP_UPDATE or event.size_m > 1:
            figure.add_vline(x=time_s[event.frame], line={"dash": "dot", "width": 1}, row=1, col=2)


def reliability() -> go.Figure:
    """Share of errors inside the stated regions, for each severity of the generated walks."""
    stated = np.linspace(0, 1, 101)
    figure = go.Figure()
    figure.add_scatter(x=[0, 1], y=[0, 1], mode="lines", line={"dash": "dot", "color": "grey"}, showlegend=False)
    for severity in SEVERITIES:
        observed = np.concatenate([regions(walk) for walk in generated([SEED, SEED + 1], severity)])
        share = np.searchsorted(np.sort(observed), stated) / len(observed)
        figure.add_scatter(x=stated, y=share, mode="lines", name=severity)
    figure.update_layout(
        template="plotly_white",
        xaxis_title="stated region",
        yaxis_title="share of errors inside",
        margin={"t": 20, "r": 20},
    )
    return figure


def regions(walk: Walk) -> FloatArray:
    """The smallest stated region that holds the error of each frame (n,), 0 to 1."""
    trajectory = strategy_named("smoother", MappingSettings()).map(walk.camera, walk.log, walk.landmarks)
    truth = walk.truth
    assert truth is not None
    inside = (trajectory.time_ns >= truth.time_ns[0]) & (trajectory.time_ns <= truth.time_ns[-1])
    known = inside & np.isfinite(trajectory.position_bcs[:, 0])
    true = np.column_stack(
        [np.interp(trajectory.time_ns[known], truth.time_ns, truth.position_bcs[:, axis]) for axis in (0, 1)]
    )
    miss = trajectory.position_bcs[known, :2] - true
    distance = np.einsum("ni,nij,nj->n", miss, np.linalg.inv(trajectory.covariance_bcs[known]), miss)
    return np.asarray(chi2.cdf(distance, 2))


if __name__ == "__main__":
    main()
