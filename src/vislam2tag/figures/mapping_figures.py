"""How a walk is mapped: the visits that split it, its sub-trajectories one by one, and what strategies make of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory, Visit
from vislam2tag.figures.panels import (
    aspect_of,
    draw_floor,
    draw_recording,
    draw_walk,
    extent_around,
    extent_of,
    in_metres,
    letter,
    panel_grid,
    show,
)
from vislam2tag.figures.style import PAGE_IN, QUIET, colour_of, name_of, print_quality
from vislam2tag.site.model import Floor

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
