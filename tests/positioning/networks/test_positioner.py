"""What all networks share: parts, training, calibration, saved weights; values that cannot be are refused before."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from tests.positioning.radio_fields import TWO_FLOORS, surveyed
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.positioning.metrics import score
from vislam2tag.positioning.registry import Positioner, model_named
from vislam2tag.positioning.scans.places import Positions, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans, scans_from_readings

torch = pytest.importorskip("torch", reason="networks need the extra 'models'")

WIDTHS: dict[str, dict[str, Any]] = {
    "multi-cel": {"backbone": (16,), "heads": (16,)},
    "regression-net": {"backbone": (16,), "head": (16,)},
}
NAMES = sorted(WIDTHS)


def tiny(name: str, **parameters: Any) -> Positioner:
    return model_named(name, **{**WIDTHS[name], "epochs": 3, "device": "cpu", **parameters})


def same(one: Positions, other: Positions) -> bool:
    fields = ("storey", "xy", "z", "storey_probability", "radius_68_m", "radius_95_m")
    return all(np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name != "storey") for name in fields)


@pytest.mark.parametrize("name", NAMES)
def test_seeds_repeat_and_differ(name: str) -> None:
    scans, places = surveyed(40)
    first, second, other = (tiny(name, seed=seed).fit(scans, places).predict(scans) for seed in (3, 3, 4))
    assert same(first, second)
    assert not same(first, other)


@pytest.mark.parametrize("name", NAMES)
def test_what_was_saved_answers_the_same(name: str) -> None:
    scans, places = surveyed(40)
    model = tiny(name, backbone=(16, 8), dropout=0.1).fit(scans, places)
    again = clone(model)
    again.access_points_, again.storeys_ = model.access_points_, model.storeys_
    again.restore(model.arrays())
    assert same(again.predict(scans), model.predict(scans))
    assert all(array.dtype == np.float64 for array in model.arrays().values())


@pytest.mark.parametrize("name", NAMES)
def test_arrays_of_another_model_are_refused(name: str) -> None:
    scans, places = surveyed(20)
    model = tiny(name).fit(scans, places)
    other = tiny(name, backbone=(8,))
    other.access_points_, other.storeys_ = model.access_points_, model.storeys_
    arrays = model.arrays()
    with pytest.raises(ValueError, match="do not fit the model"):
        other.restore(arrays)
    with pytest.raises(ValueError, match="do not fit the model"):
        other.restore({key: value for key, value in arrays.items() if "weight" not in key})


@pytest.mark.parametrize("name", NAMES)
def test_answers_do_not_depend_on_company(name: str) -> None:
    scans, places = surveyed(30)
    model = tiny(name).fit(scans, places)
    together, alone = model.predict(scans), model.predict(scans[7:8])
    np.testing.assert_allclose(together.xy[7], alone.xy[0], atol=1e-9)
    assert len(model.predict(scans[:0])) == 0


@pytest.mark.parametrize("name", NAMES)
def test_radii_hold_their_shares_of_new_scans(name: str) -> None:
    scans, places = surveyed(300)
    fresh, truth = surveyed(400, seed=5)
    model = tiny(name, epochs=5, learning_rate=1e-2, validation_share=0.5).fit(scans, places)
    result = score(model.predict(fresh), truth)
    assert result.inside_68 == pytest.approx(0.68, abs=0.08)
    assert result.inside_95 == pytest.approx(0.95, abs=0.05)


@pytest.mark.parametrize("name", NAMES)
def test_a_scan_that_hears_nothing_known_is_unknown(name: str) -> None:
    scans, places = surveyed(20)
    model = tiny(name).fit(scans, places)
    deaf = scans_from_readings(np.array([0]), np.array(["stranger"]), np.array([-50.0]), 2)
    found = model.predict(deaf)
    assert not found.known.any()
    assert np.isnan(found.xy).all()
    assert np.isnan(found.radius_95_m).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("count", [1, 2, 3, 10])
def test_hardly_any_scans(name: str, count: int) -> None:
    scans, places = surveyed(count)
    found = tiny(name, batch_size=1).fit(scans, places).predict(scans)
    assert np.isfinite(found.xy).all()
    assert (found.radius_95_m >= found.radius_68_m).all()


@pytest.mark.parametrize("name", NAMES)
def test_one_floor_one_access_point_one_level(name: str) -> None:
    _, places = surveyed(12, TWO_FLOORS[:1])
    scans = scans_from_readings(np.arange(12), np.full(12, "ap"), np.full(12, -60.0), 12)
    found = tiny(name).fit(scans, places).predict(scans)
    assert np.isfinite(found.xy).all()
    assert (found.storey == 0).all()
    assert np.ptp(found.xy, axis=0) == pytest.approx(0.0)


@pytest.mark.parametrize("name", NAMES)
def test_labels_that_are_no_numbers_are_not_learned_from(name: str) -> None:
    scans, places = surveyed(20)
    xy = places.xy.copy()
    xy[::2] = np.nan
    found = tiny(name).fit(scans, replace(places, xy=xy, z=np.full(20, np.nan))).predict(scans)
    assert np.isfinite(found.xy).all()
    assert np.isnan(found.z).all()
    with pytest.raises(DatasetError, match="no fingerprint to learn from"):
        tiny(name).fit(scans, replace(places, xy=np.full((20, 2), np.nan)))


def spoilt(places: ScanPlaces) -> ScanPlaces:
    return replace(places, xy=np.full((len(places), 2), np.nan))


@pytest.mark.parametrize("name", NAMES)
def test_a_given_validation_part_is_used_where_it_is_of_use(name: str) -> None:
    scans, places = surveyed(40)
    own = tiny(name).fit(scans, places).predict(scans)
    given = tiny(name).fit(scans, places, surveyed(20, seed=7)).predict(scans)
    assert not same(own, given)
    of_no_use: list[tuple[RadioScans, ScanPlaces]] = [(scans[:0], places[:0]), (scans, spoilt(places))]
    for part in of_no_use:
        assert same(tiny(name).fit(scans, places, part).predict(scans), own)


@pytest.mark.parametrize("name", NAMES)
def test_progress_is_told(name: str) -> None:
    scans, places = surveyed(10)
    model = tiny(name)
    steps: list[tuple[float, int]] = []
    model.progress = lambda done, total: steps.append((done, total))
    model.fit(scans, places)
    assert steps == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("parameter", "value", "message"),
    [
        ("epochs", 0, "epochs 0: expected 1 or more"),
        ("learning_rate", 2.0, "learning_rate 2.0: expected 1e-09 to 1"),
        ("dropout", 1.0, "dropout 1.0: expected 0 to 0.95"),
        ("cell_m", 0, "cell_m 0: expected 0.1 to 10000"),
        ("heads", [512, 0], "heads .512, 0.: expected the widths"),
        ("input_scale", "loud", "input_scale 'loud': expected one of min-max, powed"),
        ("device", "abacus", "device 'abacus' is not there"),
    ],
)
def test_what_cannot_be_is_refused(parameter: str, value: Any, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        model_named("multi-cel", **{"device": "cpu", parameter: value}).fit(*surveyed(4))


def test_no_hidden_layer_is_a_linear_model() -> None:
    scans, places = surveyed(12)
    for name, head in (("multi-cel", "heads"), ("regression-net", "head")):
        model = model_named(name, **{"backbone": [], head: [], "epochs": 2, "device": "cpu"})
        assert model.fit(scans, places).predict(scans).known.all()


@pytest.mark.parametrize("name", NAMES)
def test_a_batch_that_was_asked_for_is_kept_on_a_gpu_with_its_learning_rate(name: str) -> None:
    gpu = torch.device("cuda")
    chosen = model_named(name)._schedule(100_000, gpu)
    asked_for = model_named(name, batch_size=64)._schedule(100_000, gpu)
    assert (chosen.batch_size, chosen.learning_rate) == (512, 4e-3)
    assert (asked_for.batch_size, asked_for.learning_rate) == (64, 1e-3)
