"""Codes say the place that they were made of, whichever cell they are seen from.

multi-CEL learns, and says what the paper's decoding says.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.positioning.radio_fields import surveyed
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.networks.multi_cel import NO_CELL, CellLattice, decoded, lattice_over
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.registry import model_named

COORDINATE = st.floats(-500, 500)
SPOTS = st.lists(st.tuples(st.integers(0, 2), COORDINATE, COORDINATE), min_size=1, max_size=30)
SIDES = st.floats(8, 60)
OVERLAPS = st.floats(0, 1.4)


def places_at(spots: list[tuple[int, float, float]]) -> ScanPlaces:
    storey, x, y = (np.array(values) for values in zip(*spots, strict=True))
    storeys = (Storey("A", 0), Storey("A", 1), Storey("B", 0), Storey("B", 1))
    return ScanPlaces(storeys, storey, np.column_stack([x, y]), np.zeros(len(x)), np.zeros(len(x)))


def every_cell(lattice: CellLattice, storey: int, xy: np.ndarray) -> tuple[int, set[int]]:
    """The nearest cell and all that reach a place, looking at each of them."""
    own = np.flatnonzero(lattice.storey == storey)
    away = np.abs(lattice.centre_m[own] - xy)
    return own[np.hypot(*away.T).argmin()], set(own[(away < lattice.reach_m).all(axis=1)])


@given(SPOTS, SIDES, OVERLAPS)
def test_every_code_of_a_place_decodes_to_it(
    spots: list[tuple[int, float, float]], side: float, overlap: float
) -> None:
    places = places_at(spots)
    lattice = lattice_over(places, side, overlap)
    codes = lattice.codes(places.storey, places.xy)
    found = decoded(lattice.centre_m[codes.cell], codes.code, lattice.reach_m)
    off = np.abs(found - places.xy[:, None]).max(axis=2)
    assert off[codes.valid].max() < 1e-9
    assert (np.abs(codes.code) <= 1).all()
    storey = np.where(codes.valid, lattice.storey[codes.cell], places.storey[:, None])
    assert (storey == places.storey[:, None]).all()


@given(SPOTS, SIDES, OVERLAPS)
def test_the_nearest_cell_comes_first_and_no_cell_in_reach_lacks(
    spots: list[tuple[int, float, float]], side: float, overlap: float
) -> None:
    places = places_at(spots)
    lattice = lattice_over(places, side, overlap)
    codes = lattice.codes(places.storey, places.xy)
    for row, (storey, xy) in enumerate(zip(places.storey, places.xy, strict=True)):
        nearest, reach = every_cell(lattice, storey, xy)
        cells = codes.cell[row][codes.valid[row]]
        assert len(set(cells)) == len(cells)
        away = [np.linalg.norm(lattice.centre_m[cell] - xy) for cell in (cells[0], nearest)]
        assert away[0] == pytest.approx(away[1], abs=1e-9)
        assert set(cells) == reach | {cells[0]}


def test_cells_lie_at_multiples_of_their_side_one_row_and_column_more_than_fits() -> None:
    lattice = lattice_over(places_at([(0, 0.0, 0.0), (0, 25.0, 8.0), (2, -12.0, 31.0)]), 10.0, 0.3)
    assert lattice.count == 4 * 2 + 2 * 2
    np.testing.assert_array_equal(
        lattice.centre_m[lattice.storey == 0][:5], [[0, 0], [10, 0], [20, 0], [30, 0], [0, 10]]
    )
    np.testing.assert_array_equal(lattice.centre_m[lattice.storey == 2], [[-20, 30], [-10, 30], [-20, 40], [-10, 40]])
    assert lattice.reach_m == pytest.approx(8.0)


def test_the_paper_code_of_a_place_seen_from_two_cells() -> None:
    """6 m right of a centre at side 10 m and overlap 0.3: 4 m left of the next one, both within 8 m."""
    lattice = lattice_over(places_at([(0, 0.0, 0.0), (0, 20.0, 0.0)]), 10.0, 0.3)
    codes = lattice.codes(np.array([0, 0]), np.array([[6.0, 0.0], [10.5, 0.0]]))
    assert codes.cell.tolist() == [[1, 0], [1, NO_CELL]]
    np.testing.assert_allclose(codes.code[..., 0], [[-0.5, 0.75], [0.0625, 0.0]])


def test_a_place_far_outside_is_said_by_the_nearest_cell_alone() -> None:
    lattice = lattice_over(places_at([(0, 0.0, 0.0), (0, 20.0, 20.0)]), 10.0, 0.3)
    codes = lattice.codes(np.array([0]), np.array([[50.0, 20.0]]))
    assert codes.valid.sum() == 1
    np.testing.assert_array_equal(lattice.centre_m[codes.cell[0, 0]], [20, 20])
    np.testing.assert_allclose(codes.code[0, 0], [3.75, 0.0])


def test_a_label_that_is_far_off_is_told_before_memory_runs_out() -> None:
    with pytest.raises(DatasetError, match="extend over 100010 x 100010 m, which is 100020001 cells of 10 m"):
        lattice_over(places_at([(0, 0.0, 0.0), (0, 1e5, 1e5)]), 10.0, 0.3)


torch = pytest.importorskip("torch", reason="networks need the extra 'models'")

QUICK = {"backbone": (64,), "heads": (64,), "epochs": 25, "learning_rate": 1e-2, "device": "cpu"}


def test_answers_are_the_best_cells_codes() -> None:
    scans, places = surveyed(60)
    model = model_named("multi-cel", **{**QUICK, "epochs": 2}).fit(scans, places)
    found = model.predict(scans)
    locator = model.locator_
    lattice = lattice_over(places, 10.0, 0.3)
    with torch.no_grad():
        logits, codes = (part.numpy() for part in locator.network(locator.scaling(torch.from_numpy(scans.dense()))))
    best = logits.argmax(axis=1)
    expected = lattice.centre_m[best] + 8.0 * codes[np.arange(60), best]
    np.testing.assert_allclose(found.xy, expected, atol=1e-9)
    np.testing.assert_array_equal(found.storey, lattice.storey[best])
    np.testing.assert_allclose(found.storey_probability.sum(axis=1), 1.0)
    np.testing.assert_allclose(found.z, 4.0 * found.floor + 1.0)


def test_the_loss_is_cross_entropy_of_weights_plus_squared_code_errors() -> None:
    scans, places = surveyed(2)
    model = model_named("multi-cel", **{**QUICK, "epochs": 1, "class_weight": 2.0, "code_weight": 3.0}).fit(
        scans, places
    )
    locator = model.locator_
    cell, weight, code = (
        torch.tensor([[0, 1, 0]]),
        torch.tensor([[0.8, 0.2, 0.0]]).double(),
        torch.zeros(1, 3, 2).double(),
    )
    inputs = locator.scaling(torch.from_numpy(scans[:1].dense()))
    with torch.no_grad():
        logits, codes = locator.network(inputs)
        log_share = torch.log_softmax(logits, dim=1)[0]
        expected = 2.0 * -(0.8 * log_share[0] + 0.2 * log_share[1]) + 3.0 * codes[0, :2].square().sum()
        loss = locator.losses(inputs, cell, weight, code)
    assert loss.tolist() == pytest.approx([float(expected)])
