"""A model's scans and a later survey: what is gone or was moved is left out of the old ones, known scans come once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError
from vislam2tag.positioning.model_update import updated
from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
from vislam2tag.positioning.places import LabelledScans, joined_places
from vislam2tag.positioning.radio_scans import joined_scans

KNOWN = radio_world(seed=1, walks=10)
SWAPPED = {"ap-1-1": "ap-1-2", "ap-1-2": "ap-1-1"}


@pytest.fixture(scope="module")
def later() -> LabelledScans:
    """A later survey: an access point is gone, two changed their places, one is new."""
    scans, places = radio_world(seed=2, walks=10)
    scans = scans.only(np.array(scans.access_points)[scans.column] != "ap-0-0")
    names = {**SWAPPED, "ap-0-3": "ap-9"}
    renamed = replace(scans, access_points=tuple(names.get(name, name) for name in scans.access_points))
    return renamed.over(sorted(renamed.access_points)), places


def test_what_changed_is_left_out_of_the_old_scans_alone(later: LabelledScans) -> None:
    update = updated(KNOWN, later)
    assert update.gone == ("ap-0-0", "ap-0-3")
    assert update.moved == ("ap-1-1", "ap-1-2")
    assert update.new == ("ap-9",)
    scans, places = update.learned
    assert (len(scans), update.added) == (len(places), len(later[0]))
    old = scans[: len(scans) - update.added]
    heard = {old.access_points[column] for column in old.column}
    assert heard == set(KNOWN[0].access_points) - {"ap-0-0", "ap-0-3", "ap-1-1", "ap-1-2"}
    np.testing.assert_array_equal(
        scans[len(scans) - update.added :].over(later[0].access_points).dense(), later[0].dense()
    )


def test_an_updated_model_errs_less_than_one_that_is_not(later: LabelledScans) -> None:
    scans, places = radio_world(seed=3)
    names = {**SWAPPED, "ap-0-3": "ap-9", "ap-0-0": "gone"}
    asked = replace(scans, access_points=tuple(names.get(name, name) for name in scans.access_points))
    before = NearestNeighbours().fit(*KNOWN)
    after = NearestNeighbours().fit(*updated(before.learned(), (later[0][::2], later[1][::2])).learned)
    assert after.score(asked, places) > before.score(asked, places)


def test_scans_that_are_known_come_once(later: LabelledScans) -> None:
    both = joined_scans([KNOWN[0], later[0]]), joined_places([KNOWN[1], later[1]])
    one, other = updated(KNOWN, later), updated(KNOWN, both)
    assert (one.added, one.moved) == (other.added, other.moved)
    np.testing.assert_array_equal(one.learned[0].dense(), other.learned[0].dense())
    with pytest.raises(DatasetError, match="nothing to update"):
        updated(KNOWN, KNOWN)
