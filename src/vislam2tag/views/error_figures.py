"""Figures of a mapped walk, and of label errors: on the floor, as distributions, and against possible causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory, Visit
from vislam2tag.quality.evaluation.metrics import ErrorCurve
from vislam2tag.quality.evaluation.reliability import CoverageCurve
from vislam2tag.quality.evaluation.truth import PointErrors
from vislam2tag.site.model import Floor
from vislam2tag.views.floor_map import site_layers
from vislam2tag.views.layers import GREY, MANY_COLOURS, Chart, Trace, axis, dots, joined, line, written
from vislam2tag.views.panels import (
    COLUMN_IN,
    PAGE_IN,
    Extent,
    PlanPanel,
    aspect_of,
    colour_of,
    draw_panels,
    extent_around,
    extent_of,
    name_of,
    print_quality,
    printed,
)
from vislam2tag.views.quality_pages import curve_layers, movement_layer
from vislam2tag.views.site_figures import TRUTH, recorded, walk_layer
from vislam2tag.views.uncertainty import COVERAGE_AXIS, coverage_layers


def control_point_errors(
    floor: Floor, landmarks: Landmarks, walks: Mapping[str, tuple[Trajectory, PointErrors]]
) -> Figure:
    """Draw one walk as mapped by several strategies (by name), its label at each press joined to the control point."""
    below = site_layers(floor, landmarks, ids=False)
    panels = []
    for strategy, (trajectory, errors) in walks.items():
        known = errors.labelled
        pairs = np.stack((errors.truth_bcs, errors.label_bcs), axis=1)[known]
        layers = [
            walk_layer(trajectory, "walk", colour_of(strategy)),
            line("", joined(pairs), TRUTH, 1.5),
            dots("label at a press", errors.label_bcs, TRUTH, 5),
        ]
        mean = f"{errors.error_m[known].mean():.2f} m" if known.any() else "no label"
        panels.append(PlanPanel(f"{name_of(strategy)}: {mean}", floor, [*below, *layers], extent_of(floor, landmarks)))
    return printed(panels)


def error_by_landmark_movement(movement_m: FloatArray, errors_m: Mapping[str, FloatArray]) -> Figure:
    """Draw each walk's mean error (w,) by strategy against how far its landmarks moved (w,), metres."""
    layers = [
        movement_layer(np.column_stack((movement_m, error_m)), name_of(strategy), colour_of(strategy), symbol)
        for symbol, (strategy, error_m) in enumerate(errors_m.items())
    ]
    x = axis("mean displacement of landmarks / m", type="log")
    return printed([Chart(layers, x, axis("mean error of the walk / m", type="log"))], width_in=COLUMN_IN, aspect=0.7)


@print_quality
def station_overlay(
    floor: Floor, landmarks: Landmarks, strategy: str, trajectory: Trajectory, errors: PointErrors
) -> Figure:
    """Draw a mapped walk over the total station's track, and below it the error over time."""
    extent = extent_around(errors.truth_bcs)
    layers = [
        *site_layers(floor, landmarks, ids=False),
        dots("total station", errors.truth_bcs, TRUTH, 4),
        walk_layer(trajectory, name_of(strategy), colour_of(strategy)),
    ]
    time_s = (errors.time_ns - errors.time_ns[0]) * 1e-9
    over_time = dots("", np.column_stack((time_s, errors.error_m)), colour_of(strategy), 4)
    height_in = 1.6 + PAGE_IN * float(np.clip(aspect_of(extent), 0.15, 0.8))
    figure = Figure(figsize=(PAGE_IN, height_in), layout="constrained")
    below = Chart([over_time], axis("time / s"), axis("error / m", rangemode="tozero"), "Error over time")
    axes = figure.subplots(2, 1, height_ratios=(2, 1)).tolist()
    draw_panels(figure, axes, [PlanPanel("On the floor", floor, layers, extent), below])
    return figure


LEAST_SHARE = 0.05
"""Curves begin at this share labelled, because very few labels say little."""


def error_distributions(curves: Mapping[str, ErrorCurve]) -> Figure:
    """Draw the share of true points with an error up to a limit, by strategy, with its bounds.

    The ends of the curves are the shares labelled.
    """
    layers = [
        layer
        for strategy, curve in curves.items()
        for layer in curve_layers(
            curve, f"{name_of(strategy)} ({100 * curve.share[-1]:.0f} % labelled)", colour_of(strategy)
        )
    ]
    y = axis("share of all true points", [0.0, 1.02], tickformat=".0%")
    return printed([Chart(layers, axis("error / m", type="log"), y)], width_in=COLUMN_IN, aspect=0.7)


def coverage_accuracy(curves: Mapping[str, CoverageCurve]) -> Figure:
    """Draw mean and 95th percentile of the errors against the share labelled, as the limit of sigma rises.

    A strategy without sigma is a point.
    """
    layers: list[Trace] = []
    for strategy, curve in curves.items():
        kept = curve.labelled >= min(LEAST_SHARE, curve.labelled[-1])
        shown = CoverageCurve(*(values[kept] for values in vars(curve).values()))
        colour = colour_of(strategy)
        layers += coverage_layers(shown, f"{name_of(strategy)}, ", (colour, colour), ("solid", "dash"))
    return printed([Chart(layers, COVERAGE_AXIS, axis("error / m", type="log"))], width_in=COLUMN_IN, aspect=0.7)


FARTHEST_M = 12.0
"""Maximum distance to landmarks shown, metres."""
ROOM = 0.016
"""Share of the time axis that a landmark's name takes."""
STEPS = 5
"""Maximum number of mapping steps shown."""


def landmark_distances(camera: CameraTrack, log: LandmarkLog, visits: Sequence[Visit], radius_m: float) -> Figure:
    """Draw the 3-D distance from the camera to each logged landmark over time, and the visits found within a radius."""
    time_s = np.asarray((camera.time_ns - int(camera.time_ns[camera.usable][0])) * 1e-9, dtype=np.float64)
    end_s = float(time_s[camera.usable][-1])
    layers = []
    for index, name in enumerate(log.ids):
        rows = log.rows_of(index)
        distance = np.full(len(time_s), np.nan)
        gap = np.linalg.norm(camera.position_acs[log.frame[rows]] - log.position_acs[rows], axis=1)
        distance[log.frame[rows]] = np.where(log.lost[rows], np.nan, gap)
        layers.append(line(name, np.column_stack((time_s, distance)), MANY_COLOURS[index % len(MANY_COLOURS)]))
    layers.append(line(f"{radius_m:g} m", [(0, radius_m), (end_s, radius_m)], GREY, 1.5, "dash"))
    layers += _visit_layers(time_s, visits)
    y = axis("distance to landmark / m", (0, 1.08 * FARTHEST_M), grid=False)
    return printed([Chart(layers, axis("time / s", (0, end_s), grid=False), y)], aspect=0.3, extra_in=0.8)


def _visit_layers(time_s: FloatArray, visits: Sequence[Visit]) -> list[Trace]:
    """Mark the visits, and name their landmarks where there is room."""
    at_s = [float(time_s[visit.frame]) for visit in visits]
    named_s, names = -np.inf, []
    for visit, at in zip(visits, at_s, strict=True):
        room = at - named_s > ROOM * (time_s[-1] - time_s[0])
        names.append(visit.landmark if room else "")
        named_s = at if room else named_s
    ends = joined([np.array([(at, 0), (at, FARTHEST_M)]) for at in at_s])
    return [
        line("", ends, TRUTH, 1.5, "dot"),
        dots("visit", [(at, visit.distance_m) for visit, at in zip(visits, at_s, strict=True)], TRUTH),
        written([(at, FARTHEST_M) for at in at_s], names, "top center"),
    ]


def local_mapping(
    floor: Floor, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory
) -> Figure:
    """Draw a locally mapped walk's sub-trajectories as recorded, and then placed on the floor one after another."""
    mapped = [segment for segment in trajectory.segments if segment.status == Status.OK]
    extent = extent_around(np.concatenate([_path(trajectory.position_bcs, segment) for segment in mapped]))
    whole = line("", camera.plane_acs[camera.usable], GREY, 1)
    ends = [dots("", _logged_ends(log, segment), TRUTH, 5) for segment in mapped]
    pieces = [_piece(camera.plane_acs, segment, number) for number, segment in enumerate(mapped)]
    panels = [PlanPanel("Sub-trajectories as recorded", None, [whole, *pieces, *ends])]
    for upto in np.unique(np.linspace(1, len(mapped), STEPS).astype(int)).tolist():
        layers = site_layers(floor, landmarks, ids=False)
        for number, segment in enumerate(mapped[:upto]):
            rows = [landmarks.index[name] for name in (segment.first_landmark, segment.last_landmark)]
            layers += [
                _piece(trajectory.position_bcs, segment, number),
                dots("", landmarks.position_bcs[rows], TRUTH, 5),
            ]
        panels.append(PlanPanel(f"{upto} of {len(mapped)} placed", floor, layers, extent))
    return printed(panels, 3)


def _path(position: FloatArray, segment: Segment) -> FloatArray:
    return position[segment.start : segment.stop, :2]


def _piece(position: FloatArray, segment: Segment, number: int) -> Trace:
    return line("", _path(position, segment), MANY_COLOURS[number % len(MANY_COLOURS)], 3)


def _logged_ends(log: LandmarkLog, segment: Segment) -> FloatArray:
    """Where (2, 2) the tracker has a sub-trajectory's two landmarks at its two ends, in the ACS plane, metres."""
    places = []
    for name, at in ((segment.first_landmark, segment.start), (segment.last_landmark, segment.stop)):
        rows = log.rows_of(log.ids.index(name))
        place = log.plane_acs[rows]
        places.append(place[min(int(np.searchsorted(log.frame[rows], at)), len(place) - 1)])
    return np.array(places)


def strategies_compared(
    floor: Floor,
    camera: CameraTrack,
    log: LandmarkLog,
    landmarks: Landmarks,
    trajectories: Mapping[str, Trajectory],
) -> Figure:
    """Draw a walk as recorded and as mapped by each strategy (by name), without discarded frames."""
    extent: Extent = extent_of(floor, landmarks)
    below = site_layers(floor, landmarks, ids=False)
    panels = [
        PlanPanel(name_of(strategy), floor, [*below, walk_layer(trajectory, "", colour_of(strategy))], extent)
        for strategy, trajectory in trajectories.items()
    ]
    return printed([replace(recorded(camera, log), title="As recorded"), *panels], 3 if len(panels) != 3 else 2)
