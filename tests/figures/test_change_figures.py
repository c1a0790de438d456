from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from tests.dataset.changing import Survey, surveyed, usual_places
from vislam2tag.dataset.changes import CHANGED, Changes, survey_changes
from vislam2tag.dataset.model import Storey
from vislam2tag.views.coverage_figures import PLACES, ChangedFloor, change_map
from vislam2tag.views.panels import rendered


@pytest.fixture(scope="module")
def changes() -> Changes:
    places = usual_places()
    del places[8]
    after = places | {20: (56.0, 4.0)}
    return survey_changes(surveyed(Survey("base")), surveyed(Survey("later", places=after)), "wifi")


def floors(*numbers: int) -> list[ChangedFloor]:
    dataset = surveyed(Survey("base", rows=(3.0,)))
    return [ChangedFloor(f"Floor {number}", "", dataset.site_floor(Storey("", number))) for number in numbers]


def test_each_place_has_the_colour_of_its_change(changes: Changes) -> None:
    (axes,) = change_map(floors(0), changes).axes
    drawn = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert len(drawn) == changes.places.height
    colour = to_rgb(PLACES[CHANGED][0])
    changed = sum(np.allclose(patch.get_facecolor()[:3], colour) for patch in drawn)
    assert changed == changes.places.filter(change=CHANGED).height > 0


def test_access_points_are_marked_and_a_move_is_an_arrow(changes: Changes) -> None:
    (axes,) = change_map(floors(0), changes).axes
    assert sorted(str(line.get_marker()) for line in axes.lines) == ["X", "o"]
    assert len(axes.texts) == 1


def test_equal_changes_give_equal_bytes(changes: Changes) -> None:
    one, other = (rendered(change_map(floors(0), changes), "svg") for _ in range(2))
    assert one == other
    assert b"access point vanished" in one or b"<path" in one
