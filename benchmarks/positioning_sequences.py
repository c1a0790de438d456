"""Gain from combining the scans of a walk: held-out walks, each scan alone, filtered and smoothed, with the tracker.

    vislam2tag simulate survey --floors 3 --devices 3 --sessions 3 --minutes 3 --seed 7
    vislam2tag dataset survey --out fingerprints
    python benchmarks/positioning_sequences.py fingerprints --survey survey
    python benchmarks/positioning_sequences.py wifine --split official --model weighted-knn
    python benchmarks/positioning_sequences.py mall --traces site2/F4 --model weighted-knn

Trains on each fold of the split; prints means over the folds. The raw survey contains the motion of the tracker.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from dead_reckoning import step_path

from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.positioning.learning_data import LearningData, learning_data
from vislam2tag.positioning.model_scores import Score, score
from vislam2tag.positioning.places import Positions
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.sequences import filtered, smoothed
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.without_poses import inertial_log

COLUMNS: dict[str, Callable[[Score], float | None]] = {
    "mean": lambda figures: figures.plane.mean_m,
    "95th percentile": lambda figures: figures.plane.p95_m,
    "right floor": lambda figures: figures.floor_hit,
    "68 %": lambda figures: figures.inside_68,
    "95 %": lambda figures: figures.inside_95,
}
Walks = list[tuple[Positions, LearningData]]


def main() -> None:
    """Print a line for each way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--survey", type=Path, help="the raw survey it was made of: where the tracker saw itself")
    parser.add_argument("--traces", type=Path, help="a floor of the malls as published: steps are the track")
    parser.add_argument("--split", default="trajectory")
    parser.add_argument("--model", default="cell-density")
    arguments = parser.parse_args()
    walks = held_out_walks(arguments.dataset, arguments.split, arguments.model)
    print("| | " + " | ".join(COLUMNS) + " |\n" + "| --- " * (len(COLUMNS) + 1) + "|")
    tell("each scan alone", walks, [found for found, _ in walks])
    for name, together in (("filter", filtered), ("smoother", smoothed)):
        tell(name, walks, [together(found, asked.scans) for found, asked in walks])
        if (arguments.survey or arguments.traces) is not None:
            of = partial(tracked, arguments.survey) if arguments.survey else partial(stepped, arguments.traces)
            tracks = [of(asked.scans) for _, asked in walks]
            both = zip(walks, tracks, strict=True)
            with_track = [together(found, asked.scans, track) for (found, asked), track in both]
            tell(f"{name} with the {'tracker' if arguments.survey else 'steps'}", walks, with_track)


def held_out_walks(folder: Path, split_name: str, model: str) -> Walks:
    """Return what a model says of each fold's walks, and these."""
    dataset = open_dataset(folder)
    data, split = learning_data(dataset), dataset.splits[split_name]
    walks = []
    for fold in split.info.folds:
        learned, asked = data.train_test(split, fold)
        walks.append((model_named(model).fit(learned.scans, learned.places).predict(asked.scans), asked))
    return walks


def tracked(survey: Path, scans: RadioScans) -> FloatArray:
    """Return where the tracker saw itself at each scan (n, 2), metres."""
    place = np.full((len(scans), 2), np.nan)
    for session in open_survey(survey).sessions:
        rows = scans.session == session.slug
        if rows.any():
            camera = read_session(session).camera
            time_ns, plane = camera.time_ns[camera.usable], camera.plane_acs[camera.usable]
            place[rows] = np.column_stack([np.interp(scans.time_ns[rows], time_ns, axis) for axis in plane.T])
    return place


def stepped(floor: Path, scans: RadioScans) -> FloatArray:
    """Return where the organisers' step model puts each scan (n, 2), metres from each walk's start."""
    place = np.full((len(scans), 2), np.nan)
    for session in np.unique(scans.session):
        file = floor / "path_data_files" / f"{session.rpartition('.')[2]}.txt"
        trace, rows = parse_trace(file.read_bytes(), file.name), scans.session == session
        log = inertial_log(trace.sensors)
        if log is not None:
            moments = replace(trace.taps, time_ns=scans.time_ns[rows], position_bcs=np.zeros((int(rows.sum()), 2)))
            place[rows] = step_path(log, moments)
    return place


def tell(name: str, walks: Walks, found: list[Positions]) -> None:
    """Print the means over folds."""
    figures = [score(positions, asked.places) for positions, (_, asked) in zip(found, walks, strict=True)]
    means = (np.mean(np.array([column(one) for one in figures], dtype=np.float64)) for column in COLUMNS.values())
    print(f"| {name} | " + " | ".join(f"{mean:.2f}" for mean in means) + " |", flush=True)


if __name__ == "__main__":
    main()
