"""What all models share, with the simplest model there is: everybody is where the mean fingerprint was."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from sklearn.base import clone

from tests.datasets.factory import small_dataset
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.learning_data import learning_data
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import NamedArrays, Positioner, model_named


class Mean(Positioner):
    def __init__(self, radius_m: float = 10.0) -> None:
        self.radius_m = radius_m

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: tuple[RadioScans, ScanPlaces] | None) -> None:
        assert scans.access_points == self.access_points_
        assert (scans.heard > 0).all()
        self.mean_ = places.xy.mean(axis=0)

    def _predict(self, scans: RadioScans) -> Positions:
        n = len(scans)
        return Positions(
            storeys=self.storeys_,
            storey=np.zeros(n, dtype=np.int64),
            xy=np.tile(self.mean_, (n, 1)),
            z=np.full(n, np.nan),
            storey_probability=np.full((n, len(self.storeys_)), 1 / len(self.storeys_)),
            radius_68_m=np.full(n, self.radius_m),
            radius_95_m=np.full(n, 2 * self.radius_m),
        )

    def arrays(self) -> NamedArrays:
        return {"mean": self.mean_}

    def restore(self, arrays: Mapping[str, FloatArray]) -> None:
        self.mean_ = arrays["mean"]


def test_a_scan_of_unknown_access_points_is_unknown() -> None:
    data = learning_data(small_dataset())
    model = Mean().fit(data.scans, data.places)
    deaf = scans_from_readings(
        np.array([0, 1]), np.array(["stranger", data.scans.access_points[0]]), np.array([-50.0, -50.0]), 3
    )
    found = model.predict(deaf)
    assert found.known.tolist() == [False, True, False]
    assert np.isnan(found.xy[[0, 2]]).all()
    np.testing.assert_allclose(found.xy[1], data.places.xy.mean(axis=0))


def test_unlabelled_and_deaf_scans_are_not_learned_from() -> None:
    data = learning_data(small_dataset())
    places = data.places[:]
    places.xy[0] = np.nan
    np.testing.assert_allclose(Mean().fit(data.scans, places).mean_, places.xy[1:].mean(axis=0))


def test_nothing_to_learn_from() -> None:
    data = learning_data(small_dataset())
    with pytest.raises(DatasetError, match="no fingerprint to learn from"):
        Mean().fit(data.scans.over(["stranger"]), data.places)
    with pytest.raises(ValueError, match="scans and"):
        Mean().fit(data.scans[:3], data.places)


def test_scikit_learn_can_copy_it() -> None:
    assert clone(Mean(radius_m=3.0)).get_params() == {"radius_m": 3.0}
    data = learning_data(small_dataset())
    assert Mean().fit(data.scans, data.places).score(data.scans, data.places) < -1


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"neighbours": 3},
            "model weighted-knn has no parameter 'neighbours'; it has: distance, exponent, k, representation",
        ),
        ({"k": "five"}, "model weighted-knn: k='five': expected a value such as 5"),
        ({"k": 2.5}, "model weighted-knn: k=2.5: expected a value such as"),
        ({"k": True}, "model weighted-knn: k=True: expected a value such as"),
        ({"k": 10**20}, "model weighted-knn: k=100000000000000000000: expected a value such as"),
        ({"exponent": -1e300}, r"model weighted-knn: exponent=-1e\+300: expected a value such as"),
        ({"exponent": float("nan")}, "model weighted-knn: exponent=nan: expected a value such as 4.0"),
        ({"distance": ["cosine"]}, r"model weighted-knn: distance=\['cosine'\]: expected a value such as 'sorensen'"),
    ],
)
def test_wrong_parameters_are_told(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        model_named("weighted-knn", **parameters)
    assert model_named("weighted-knn", exponent=2, k=4).get_params()["k"] == 4
