"""k nearest neighbours: by hand, on the public set's known figures, and radii that hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.conftest import shared_folder
from tests.positioning.radio_world import STOREYS, assert_says_what_is_unlike, radio_world
from tests.positioning.test_radio_scans import scans_from
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.format_registry import ImportContext
from vislam2tag.datasets.formats.published_sets import TAMPERE
from vislam2tag.datasets.point_fingerprints import OFFICIAL
from vislam2tag.positioning.learning_data import learning_data
from vislam2tag.positioning.model_scores import score
from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import Representation
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.signal_distance import SignalDistance

LEVELS = np.array([[-50.0, -60.0, np.nan], [-52.0, -63.0, np.nan], [np.nan, -60.0, -50.0], [np.nan, -57.0, -48.0]])


def places(storey: list[int]) -> ScanPlaces:
    n = len(storey)
    xy = np.stack([10.0 * np.arange(n), np.zeros(n)], axis=1)
    return ScanPlaces(STOREYS, np.array(storey), xy, np.array([np.nan, 2.0, 3.0, 4.0])[:n], np.full(n, np.nan))


def padded(levels: np.ndarray) -> np.ndarray:
    return np.pad(levels, ((0, 0), (0, 3)), constant_values=np.nan)


@pytest.mark.parametrize("representation", Representation)
@pytest.mark.parametrize("distance", SignalDistance)
def test_a_learned_scan_is_its_own_nearest_neighbour(distance: SignalDistance, representation: Representation) -> None:
    scans, learned = scans_from(padded(LEVELS)), places([0, 0, 1, 1])
    model = NearestNeighbours(k=1, distance=distance, representation=representation).fit(scans, learned)
    found = model.predict(scans)
    np.testing.assert_array_equal(found.xy, learned.xy)
    np.testing.assert_array_equal(found.storey, learned.storey)
    np.testing.assert_array_equal(found.z, learned.z)


def test_the_position_is_of_neighbours_on_the_storey_with_most_votes() -> None:
    scans = scans_from(padded(LEVELS))
    alike = NearestNeighbours(k=3, exponent=0.0, distance="euclidean", representation="positive")
    model = alike.fit(scans, places([0, 0, 0, 1]))
    found = model.predict(scans_from(padded(np.array([[-51.0, -59.0, -96.0]]))))
    assert found.storey.tolist() == [0]
    np.testing.assert_allclose(found.xy, [[10.0, 0.0]])
    np.testing.assert_allclose(found.z, [2.5])
    closer = NearestNeighbours(k=3, exponent=8.0, distance="euclidean", representation="positive")
    assert closer.fit(scans, places([0, 0, 0, 1])).predict(scans[:1]).xy[0, 0] < 1e-3


def test_a_scan_like_nothing_that_was_learned_says_so() -> None:
    model = NearestNeighbours().fit(*radio_world(seed=1))
    assert_says_what_is_unlike(model)
    before = {name: array for name, array in model.arrays().items() if name != "like"}  # of an earlier version
    model.restore(before)
    unlike = model.predict(radio_world(seed=2)[0]).unlike
    assert unlike is not None
    assert not unlike.any()


@pytest.mark.parametrize(
    ("name", "settings"), [("weighted-knn", {}), ("weighted-knn", {"k": 3, "exponent": 0.0}), ("local-kriging", {})]
)
def test_it_learns_and_its_radii_hold(name: str, settings: dict[str, float]) -> None:
    model = model_named(name, **settings).fit(*radio_world(seed=1))
    scans, true = radio_world(seed=2)
    result = score(model.predict(scans), true)
    assert result.plane.mean_m is not None
    assert result.plane.mean_m < 4
    assert result.floor_hit is not None
    assert result.floor_hit > 0.95
    assert result.inside_68 == pytest.approx(0.68, abs=0.12)
    assert result.inside_95 == pytest.approx(0.95, abs=0.05)


def test_radii_come_from_a_validation_part_where_there_is_one() -> None:
    scans, learned = radio_world(seed=1, walks=2)
    elsewhere = ScanPlaces(learned.storeys, learned.storey, learned.xy + 30.0, learned.z, learned.sigma_m)
    wrong = NearestNeighbours().fit(scans, learned, validation=(scans, elsewhere)).predict(scans)
    assert (wrong.radius_68_m > 30).all()
    deaf = scans.over(["stranger"])
    own = NearestNeighbours().fit(scans, learned, validation=(deaf, learned)).predict(scans)
    assert (own.radius_68_m < 30).all()


def test_a_lone_scan_promises_nothing() -> None:
    scans, learned = scans_from(padded(LEVELS)), places([0, 0, 1, 1])
    model = NearestNeighbours().fit(scans[:1], learned[:1])
    found = model.predict(scans[:2])
    np.testing.assert_array_equal(found.xy, [[0.0, 0.0], [0.0, 0.0]])
    assert (found.radius_68_m >= 100).all()


@pytest.mark.parametrize("representation", Representation)
@pytest.mark.parametrize("distance", SignalDistance)
def test_scans_too_faint_to_count_are_still_answered(distance: SignalDistance, representation: Representation) -> None:
    scans, learned = scans_from(padded(LEVELS)), places([0, 0, 1, 1])
    model = NearestNeighbours(distance=distance, representation=representation).fit(scans, learned)
    found = model.predict(scans_from(padded(np.array([[-109.0, np.nan, np.nan]]))))
    assert np.isfinite(found.xy).all()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"k": 0}, "k must be 1 or more"),
        ({"exponent": -1.0}, "the exponent 0 or more"),
        ({"distance": "taxi"}, "distance=taxi: expected one of euclidean, sorensen, cosine"),
        ({"representation": "dbm"}, "representation=dbm: expected one of positive"),
    ],
)
def test_wrong_parameters_are_told(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        model_named("weighted-knn", **parameters).fit(*radio_world(walks=1))


def test_the_public_set_gives_its_known_figures(tmp_path: Path) -> None:
    """../shared/algorithms.md, section 4: the nearest neighbour's mean error and floor hit on the official split."""
    dataset = TAMPERE.read(shared_folder("tampere"), ImportContext(Folder.at(tmp_path)))
    split = dataset.splits[OFFICIAL]
    train, test = learning_data(dataset).train_test(split, split.info.folds[0])
    model = model_named("weighted-knn", k=1, distance="euclidean", representation="positive")
    result = score(model.fit(train.scans, train.places).predict(test.scans), test.places)
    assert result.plane.mean_m == pytest.approx(9.40, abs=0.01)
    assert result.floor_hit == pytest.approx(0.915, abs=0.001)
