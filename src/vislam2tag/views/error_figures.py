"""A walk mapped step by step, and labels against truth: on the floor, as distributions, against causes of errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory, Visit
from vislam2tag.quality.evaluation.metrics import ErrorCurve
from vislam2tag.quality.evaluation.reliability import CoverageCurve
from vislam2tag.quality.evaluation.truth import PointErrors
from vislam2tag.site.model import Floor
from vislam2tag.views.panels import (
    COLUMN_IN,
    PAGE_IN,
    QUIET,
    TRUTH,
    aspect_of,
    colour_of,
    draw_control_points,
    draw_floor,
    draw_recording,
    draw_walk,
    extent_around,
    extent_of,
    in_metres,
    legend_below,
    letter,
    log_metres,
    name_of,
    panel_grid,
    print_quality,
    show,
)


@print_quality
def control_point_errors(
    floor: Floor, landmarks: Landmarks, walks: Mapping[str, tuple[Trajectory, PointErrors]]
) -> Figure:
    """Draw one walk as mapped by several strategies (by name), its label at each press joined to the control point."""
    extent = extent_of(floor, landmarks)
    figure, axes = panel_grid(len(walks), min(2, len(walks)), PAGE_IN, aspect_of(extent))
    for one, (strategy, (trajectory, errors)) in zip(axes, walks.items(), strict=True):
        draw_floor(one, floor, landmarks)
        draw_control_points(one, floor)
        draw_walk(one, trajectory, colour_of(strategy), "walk", width=0.5)
        joined = np.stack((errors.truth_bcs, errors.label_bcs), axis=1)[errors.labelled]
        for pair in joined:
            one.plot(*pair.T, color=TRUTH, linewidth=0.7, zorder=5)
        one.plot(*errors.label_bcs.T, ".", color=TRUTH, markersize=2.5, zorder=5, label="label at a press")
        show(one, extent)
    legend_below(figure, axes[:1])
    letter(axes, [f"{name_of(name)}: {_mean(errors)}" for name, (_, errors) in walks.items()])
    return figure


def _mean(errors: PointErrors) -> str:
    return f"{errors.error_m[errors.labelled].mean():.2f} m" if errors.labelled.any() else "no label"


@print_quality
def error_by_landmark_movement(movement_m: FloatArray, errors_m: Mapping[str, FloatArray]) -> Figure:
    """Draw each walk's mean error (w,) by strategy against how far its landmarks moved (w,), metres."""
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for marker, (strategy, error_m) in zip("os^Dv", errors_m.items(), strict=False):
        axes.plot(
            movement_m, error_m, marker, color=colour_of(strategy), markersize=3.5, alpha=0.8, label=name_of(strategy)
        )
    axes.set(xscale="log", yscale="log", xlabel="mean movement of the logged landmarks / m", ylabel="mean error / m")
    log_metres(axes.xaxis)
    log_metres(axes.yaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.legend()
    return figure


@print_quality
def station_overlay(
    floor: Floor, landmarks: Landmarks, strategy: str, trajectory: Trajectory, errors: PointErrors
) -> Figure:
    """Draw a mapped walk over the total station's track, and below it the error over time."""
    extent = extent_around(errors.truth_bcs)
    figure = Figure(figsize=(PAGE_IN, 1.3 + PAGE_IN * np.clip(aspect_of(extent), 0.15, 0.8)), layout="constrained")
    plan, below = figure.subplots(2, 1, height_ratios=(2, 1))
    draw_floor(plan, floor, landmarks)
    plan.plot(*errors.truth_bcs.T, ".", color=TRUTH, markersize=3, zorder=2, label="total station")
    draw_walk(plan, trajectory, colour_of(strategy), name_of(strategy), width=0.8)
    show(plan, extent)
    plan.legend(loc="upper right", ncols=3)
    time_s = (errors.time_ns - errors.time_ns[0]) * 1e-9
    below.plot(time_s, errors.error_m, ".", color=colour_of(strategy), markersize=1.5)
    below.set(xlabel="time / s", ylabel="error / m", ylim=(0, None))
    return figure


LEAST_SHARE = 0.05
"""The surest few labels of all say little: curves begin with this share."""


@print_quality
def error_distributions(curves: Mapping[str, ErrorCurve]) -> Figure:
    """Draw the share of all true points whose label is no farther off than a limit, by strategy, with its bounds.

    The ends of the curves are the shares labelled.
    """
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for strategy, curve in curves.items():
        colour, end = colour_of(strategy), f"{100 * curve.share[-1]:.0f} % labelled"
        axes.plot(curve.error_m, curve.share, color=colour, label=f"{name_of(strategy)} ({end})")
        if curve.low is not None and curve.high is not None:
            axes.fill_between(curve.error_m, curve.low, curve.high, color=colour, alpha=0.18, linewidth=0)
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="error / m", ylabel="share of all true points")
    log_metres(axes.xaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.legend(loc="best")
    return figure


@print_quality
def coverage_accuracy(curves: Mapping[str, CoverageCurve]) -> Figure:
    """Draw mean and 95th percentile of the errors against the share labelled, as the limit of sigma rises.

    A strategy that states no sigma is a point.
    """
    figure, (axes,) = panel_grid(1, 1, COLUMN_IN, 0.7)
    for strategy, curve in curves.items():
        shown = curve.labelled >= min(LEAST_SHARE, curve.labelled[-1])
        marker = "o" if shown.sum() == 1 else ""
        for values, style, fill, what in ((curve.mean_m, "-", "full", "mean"), (curve.p95_m, "--", "none", "95 %")):
            line = axes.plot(curve.labelled[shown], values[shown], style, color=colour_of(strategy), marker=marker)
            line[0].set(fillstyle=fill, markersize=3.5, label=f"{name_of(strategy)}, {what}")
    axes.set(xlim=(0, 1.02), yscale="log", xlabel="share labelled", ylabel="error / m")
    log_metres(axes.yaxis)
    axes.grid(linewidth=0.3, alpha=0.6)
    legend_below(figure, [axes], 2)
    return figure


FARTHEST_M = 12.0
"""Distances to landmarks are shown up to this, metres."""
ROOM = 0.016
"""Share of the time axis that a landmark's name takes."""
STEPS = 5
"""How many steps of a mapping are shown at most."""


@print_quality
def landmark_distances(camera: CameraTrack, log: LandmarkLog, visits: Sequence[Visit], radius_m: float) -> Figure:
    """Draw the 3-D distance from the camera to each logged landmark over time, and the visits found within a radius."""
    figure, (axes,) = panel_grid(1, 1, PAGE_IN, 0.3)
    start_ns = int(camera.time_ns[camera.usable][0])
    time_s = np.asarray((camera.time_ns - start_ns) * 1e-9, dtype=np.float64)
    colours = mpl.colormaps["tab10" if len(log.ids) <= 10 else "tab20"]
    for index, name in enumerate(log.ids):
        rows = log.rows_of(index)
        distance = np.full(len(time_s), np.nan)
        gap = np.linalg.norm(camera.position_acs[log.frame[rows]] - log.position_acs[rows], axis=1)
        distance[log.frame[rows]] = np.where(log.lost[rows], np.nan, gap)
        axes.plot(time_s, distance, color=colours(index % colours.N), linewidth=0.8, label=name)
    axes.axhline(radius_m, color=QUIET, linestyle="dashed", linewidth=0.6)
    _draw_visits(axes, time_s, visits)
    axes.set(
        xlim=(0, time_s[camera.usable][-1]), ylim=(0, FARTHEST_M), xlabel="time / s", ylabel="distance to landmark / m"
    )
    figure.legend(title="landmark", loc="outside right upper", fontsize=6)
    return figure


def _draw_visits(axes: Axes, time_s: FloatArray, visits: Sequence[Visit]) -> None:
    """Mark the visits, and name their landmarks where there is room."""
    named_s = -np.inf
    for visit in visits:
        at = float(time_s[visit.frame])
        axes.axvline(at, color="black", linestyle="dotted", linewidth=0.6)
        axes.plot(at, visit.distance_m, "ok", markersize=2.5)
        if at - named_s > ROOM * (time_s[-1] - time_s[0]):
            axes.annotate(visit.landmark, (at, FARTHEST_M), ha="center", va="bottom", annotation_clip=False)
            named_s = at


@print_quality
def local_mapping(
    floor: Floor, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory
) -> Figure:
    """Draw a locally mapped walk's sub-trajectories as recorded, and then placed on the floor one after another."""
    mapped = [segment for segment in trajectory.segments if segment.status == Status.OK]
    extent = extent_around(np.concatenate([_path(trajectory.position_bcs, segment) for segment in mapped]))
    steps = np.unique(np.linspace(1, len(mapped), STEPS).astype(int)).tolist()
    figure, axes = panel_grid(1 + len(steps), 3, PAGE_IN, aspect_of(extent))
    axes[0].plot(*camera.plane_acs[camera.usable].T, color=QUIET, linewidth=0.5)
    for number, segment in enumerate(mapped):
        _draw_piece(axes[0], camera.plane_acs, segment, number)
        ends = _logged_ends(log, segment)
        axes[0].plot(*ends.T, "ok", markersize=2)
    in_metres(axes[0])
    for one, upto in zip(axes[1:], steps, strict=True):
        draw_floor(one, floor, landmarks)
        for number, segment in enumerate(mapped[:upto]):
            _draw_piece(one, trajectory.position_bcs, segment, number)
            rows = [landmarks.index[name] for name in (segment.first_landmark, segment.last_landmark)]
            one.plot(*landmarks.position_bcs[rows].T, "ok", markersize=2, zorder=6)
        show(one, extent)
    titles = [f"{upto} of {len(mapped)} placed" for upto in steps]
    letter(axes, ["Sub-trajectories as recorded", *titles])
    return figure


def _path(position: FloatArray, segment: Segment) -> FloatArray:
    return position[segment.start : segment.stop, :2]


def _draw_piece(axes: Axes, position: FloatArray, segment: Segment, number: int) -> None:
    colour = mpl.colormaps["tab10"](number % 10)
    axes.plot(*_path(position, segment).T, color=colour, linewidth=1.2, zorder=5)


def _logged_ends(log: LandmarkLog, segment: Segment) -> FloatArray:
    """Where (2, 2) the tracker has a sub-trajectory's two landmarks at its two ends, in the ACS plane, metres."""
    ends = ((segment.first_landmark, segment.start), (segment.last_landmark, segment.stop))
    places = [log.plane_acs[log.rows_of(log.ids.index(name))] for name, _ in ends]
    frames = [log.frame[log.rows_of(log.ids.index(name))] for name, _ in ends]
    return np.array(
        [
            place[min(int(np.searchsorted(frame, at)), len(place) - 1)]
            for place, frame, (_, at) in zip(places, frames, ends, strict=True)
        ]
    )


@print_quality
def strategies_compared(
    floor: Floor,
    camera: CameraTrack,
    log: LandmarkLog,
    landmarks: Landmarks,
    trajectories: Mapping[str, Trajectory],
) -> Figure:
    """Draw a walk as recorded, and what each strategy (by name) makes of it; discarded frames are left out."""
    extent = extent_of(floor, landmarks)
    figure, axes = panel_grid(1 + len(trajectories), 3 if len(trajectories) != 3 else 2, PAGE_IN, aspect_of(extent))
    draw_recording(axes[0], camera, log)
    for one, (strategy, trajectory) in zip(axes[1:], trajectories.items(), strict=True):
        draw_floor(one, floor, landmarks)
        draw_walk(one, trajectory, colour_of(strategy), name_of(strategy))
        show(one, extent)
    letter(axes, ["As recorded", *map(name_of, trajectories)])
    return figure
