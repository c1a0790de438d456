"""What updating a model gains: errors in later months, or in a changed building, without it, by five minutes, by all.

    python benchmarks/model_update.py --library uji-library          UJI's long-term library set, as imported
    python benchmarks/model_update.py --buildings 5                  generated buildings, 9 of 28 access points changed

The library: learned are the first month's ``trn`` walks; asked are ``tst`` scans of each later month. Buildings: a base
of 12 walks of four minutes; then three access points are removed, three moved, three added, and eight walks made, of
which half update and half are asked. Both by ``local-kriging``, with its own settings; ``updated`` is what ``train
--update`` does, ``both learned`` the same without leaving anything out.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from changed_building import Changes, two_surveys

from vislam2tag.datasets.folder import open_dataset
from vislam2tag.positioning.learning_data import LearningData, learning_data
from vislam2tag.positioning.metrics import score
from vislam2tag.positioning.model_update import updated
from vislam2tag.positioning.places import LabelledScans, joined_places
from vislam2tag.positioning.radio_scans import joined_scans
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.simulation.settings import BuildingSettings, stream

MODEL = "local-kriging"
MOST_ASKED = 800
FIVE_MINUTES = 86
"""Scans of the library's phone; of the generated ones about as many."""


def main() -> None:
    """Print a line for each month or building."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path)
    parser.add_argument("--buildings", type=int, default=0)
    arguments = parser.parse_args()
    print("| | not updated | updated by five minutes | updated by all | both learned | gone, moved, new: found |")
    print("| --- |" + " ---: |" * 5)
    if arguments.library is not None:
        library(arguments.library)
    if arguments.buildings:
        rows = [building(seed) for seed in range(arguments.buildings)]
        tell(f"mean of {len(rows)} buildings", np.mean([row for row, _ in rows], axis=0).tolist(), "")


def library(folder: Path) -> None:
    """Ask about each month after the first."""
    data = learning_data(open_dataset(folder))
    month = np.strings.partition(data.scans.session, ".")[0]  # as the set names them; a calendar month may hold two
    walked = np.char.find(data.scans.session, "trn") >= 0
    first = data[(month == np.unique(month)[0]) & walked]
    before = model_named(MODEL).fit(first.scans, first.places)
    for one in np.unique(month)[1:]:
        later = data[(month == one) & walked]
        asked = data[np.flatnonzero((month == one) & ~walked)]
        if len(later) and len(asked):
            tell(str(one), *errors(before, later, asked))


def building(seed: int) -> tuple[list[float], str]:
    """Change a building and ask about half of the later walks."""
    drawn = stream(seed, "changes").choice(2 * BuildingSettings().access_points, 9, replace=False).tolist()
    surveys = two_surveys(seed, Changes(tuple(drawn[:3]), tuple(drawn[3:6]), tuple(drawn[6:])))
    base, later = (learning_data(survey) for survey in (surveys.base, surveys.later))
    half = np.char.endswith(later.scans.session, "-0")
    row = errors(model_named(MODEL).fit(base.scans, base.places), later[half], later[~half])
    tell(f"building {seed}", *row)
    return row


def errors(before: Positioner, later: LearningData, asked: LearningData) -> tuple[list[float], str]:
    """Return mean errors in the plane, metres, of all four ways, and what was found to have changed."""
    asked = asked[slice(None, None, max(1, len(asked) // MOST_ASKED))]
    known = before.learned()
    assert known is not None
    all_of_it = updated(known, (later.scans, later.places))
    parts = [(later.scans[rows], later.places[rows]) for rows in (slice(0, FIVE_MINUTES), slice(None))]
    learned = [updated(known, parts[0]).learned, all_of_it.learned, joined(known, parts[1])]
    models = [before, *(model_named(MODEL).fit(*one) for one in learned)]
    changes = ", ".join(str(len(names)) for names in (all_of_it.gone, all_of_it.moved, all_of_it.new))
    return [mean_m(model, asked) for model in models], changes


def joined(known: LabelledScans, later: LabelledScans) -> LabelledScans:
    """Put both together as they are."""
    return joined_scans([known[0], later[0]]), joined_places([known[1], later[1]])


def mean_m(model: Positioner, asked: LearningData) -> float:
    """Mean error in the plane, metres; NaN where nothing is answered."""
    found = model.predict(asked.scans)
    mean = score(found, asked.places.over(found.storeys)).plane.mean_m
    return float("nan") if mean is None else mean


def tell(name: str, means_m: Sequence[float], changes: str) -> None:
    """Print a line."""
    print(f"| {name} | " + " | ".join(f"{mean:.2f} m" for mean in means_m) + f" | {changes} |", flush=True)


if __name__ == "__main__":
    main()
