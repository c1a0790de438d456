"""What all networks share: parts, training, calibration, saved weights; values that cannot be are refused before.

The training loop learns, stops and repeats; which device trains, and that PyTorch is left as it was.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from tests.positioning.radio_fields import TWO_BUILDINGS, TWO_FLOORS, surveyed
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.positioning.model_scores import score
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import Positioner, model_named

pytest.importorskip("torch", reason="networks need the extra 'models'")
import torch

from vislam2tag.positioning.networks.positioner import (
    NetworkSettings,
    TrainingExamples,
    batch_for,
    repeatable,
    train,
    training_device,
)

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
def test_parameters_can_be_changed_as_a_search_does(name: str) -> None:
    model = model_named(name, epochs=7).set_params(seed=9)
    assert (model.get_params()["epochs"], model.get_params()["seed"]) == (7, 9)
    assert clone(model).get_params() == model.get_params()
    with pytest.raises(ValueError, match="no parameter rounds"):
        model.set_params(rounds=3)


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


@pytest.mark.parametrize(
    ("name", "floors", "floor_hit", "mean_m"),
    [
        ("multi-cel", TWO_FLOORS, 0.95, 3.5),
        ("multi-cel", TWO_BUILDINGS, 0.85, 4.5),
        ("regression-net", TWO_FLOORS, 0.95, 4.0),
        ("regression-net", TWO_BUILDINGS, 0.85, 6.0),
    ],
)
def test_floors_of_different_size_and_buildings_whose_frames_overlap_are_learned(
    name: str, floors: Any, floor_hit: float, mean_m: float
) -> None:
    widths = dict.fromkeys(WIDTHS[name], (64,))
    model = tiny(name, **widths, epochs=25, learning_rate=1e-2).fit(*surveyed(240, floors))
    fresh, truth = surveyed(100, floors, seed=1)
    found = model.predict(fresh)
    result = score(found, truth)
    assert result.building_hit == 1.0
    assert (result.floor_hit or 0.0) > floor_hit
    assert (result.plane.mean_m or math.inf) < mean_m
    np.testing.assert_allclose(found.storey_probability.sum(axis=1), 1.0)


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
        ("heads", [512, 0], "heads .512, 0.: expected layer widths"),
        ("input_scale", "loud", "input_scale 'loud': expected one of min-max, powed"),
        ("device", "abacus", "device 'abacus' is not available"),
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


class Scripted:
    """Held-out examples with these losses, epoch after epoch; keeps the weight that each was asked with."""

    def __init__(self, network: torch.nn.Linear, losses: list[float]) -> None:
        self.network, self.losses = network, iter(losses)
        self.seen: list[float] = []

    def __call__(self, rows: np.ndarray) -> torch.Tensor:
        assert not self.network.training
        self.seen.append(self.network.weight.tolist()[0][0])
        return torch.full((len(rows),), next(self.losses))


def line(network: torch.nn.Linear) -> TrainingExamples:
    x = torch.linspace(-1, 1, 64)[:, None]
    return TrainingExamples(64, lambda rows: (network(x[rows]) - 3 * x[rows]).square()[:, 0])


def test_it_learns_a_line() -> None:
    network = torch.nn.Linear(1, 1)
    history = train(network, line(network), line(network), NetworkSettings(epochs=100, learning_rate=0.05))
    assert network.weight.tolist()[0][0] == pytest.approx(3.0, abs=0.01)
    assert history.held_out_loss[-1] < 1e-3


def test_best_weights_are_kept_and_patience_ends_it() -> None:
    network = torch.nn.Linear(1, 1)
    held_out = Scripted(network, [5, 4, 2, 3, 3, 3, 3, 3])
    steps: list[tuple[int, int]] = []
    schedule = NetworkSettings(epochs=8, patience=3)
    examples = TrainingExamples(5, held_out)
    history = train(network, line(network), examples, schedule, lambda done, total: steps.append((done, total)))
    assert history.best_epoch == 2
    assert list(history.held_out_loss) == [5, 4, 2, 3, 3, 3]
    assert network.weight.tolist()[0][0] == held_out.seen[2] != held_out.seen[-1]
    assert steps == [(epoch, 8) for epoch in range(1, 7)]
    assert not network.training


def test_a_loss_that_is_no_number_ends_it() -> None:
    network = torch.nn.Linear(1, 1)
    with pytest.raises(DatasetError, match="lower the learning rate"):
        train(network, line(network), TrainingExamples(5, Scripted(network, [1, float("nan")])), NetworkSettings())


def test_a_gpu_gets_larger_batches_where_there_are_examples_for_them_and_a_processor_the_published_ones() -> None:
    gpu, processor = torch.device("cuda"), torch.device("cpu")
    assert batch_for(100_000, gpu) == (512, 4.0)  # the rate grows with the root of 16
    size, faster = batch_for(4000, gpu)
    assert size == 100  # 40 steps an epoch
    assert faster**2 == pytest.approx(100 / 32)
    assert batch_for(500, gpu) == (32, 1.0)
    assert batch_for(100_000, processor) == (32, 1.0)
    assert batch_for(100_000, gpu, asked_for=64) == (64, 1.0)


def test_batch_of_one_and_one_example() -> None:
    network = torch.nn.Linear(1, 1)
    one = TrainingExamples(1, line(network).losses)
    assert len(train(network, one, one, NetworkSettings(epochs=3, batch_size=1)).held_out_loss) == 3


def test_the_same_seed_draws_the_same_and_leaves_no_trace() -> None:
    before, threads = torch.random.get_rng_state(), torch.get_num_threads()
    drawn = []
    for seed in (1, 1, 2):
        with repeatable(seed, torch.device("cpu")):
            assert torch.get_num_threads() == 1
            drawn.append(torch.rand(3).tolist())
    assert drawn[0] == drawn[1] != drawn[2]
    assert torch.equal(torch.random.get_rng_state(), before)
    assert torch.get_num_threads() == threads


def test_devices() -> None:
    assert training_device("cpu").type == "cpu"
    assert training_device("auto").type == ("cuda" if torch.cuda.is_available() else "cpu")
    for name in ("cuda:99", "abacus"):
        with pytest.raises(UsageError, match=f"device '{name}' is not available"):
            training_device(name)


@pytest.mark.parametrize("there", [False, True])
def test_auto_takes_the_gpu_where_there_is_one(monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    made = torch.empty
    monkeypatch.setattr(torch, "empty", lambda *size, **_: made(*size))  # no GPU is asked for memory
    assert training_device("auto").type == ("cuda" if there else "cpu")
    assert training_device("cpu").type == "cpu"


@pytest.mark.parametrize("name", ["abacus", "meta:x"])
def test_a_device_that_is_not_there(name: str) -> None:
    with pytest.raises(UsageError, match=f"device '{name}' is not available .*; use auto or cpu"):
        training_device(name)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_gpu_that_is_not_there() -> None:
    with pytest.raises(UsageError, match="device 'cuda' is not available"):
        training_device("cuda")


def test_random_numbers_and_threads_are_left_as_they_were() -> None:
    threads = torch.get_num_threads()
    torch.manual_seed(3)
    expected = torch.rand(2)
    torch.manual_seed(3)
    with repeatable(7, torch.device("cpu")):
        first = torch.rand(2)
        assert torch.get_num_threads() == 1
    assert torch.equal(torch.rand(2), expected)
    assert torch.get_num_threads() == threads
    with repeatable(7, torch.device("cpu")):
        assert torch.equal(torch.rand(2), first)
