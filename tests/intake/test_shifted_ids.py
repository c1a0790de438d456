"""A shift of all ids shows in the distances between landmarks, and nothing else looks like one."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.intake.shifted_ids import IdShift, shift_by_geometry


def walk(shift: int, seed: int, count: int = 9, scale: float = 1.0, noise_m: float = 0.1) -> IdShift | None:
    """A walk past the landmarks of a table, logged with ids that are smaller by ``shift``, in a frame of its own."""
    rng = np.random.default_rng(seed)
    table = {str(number): complex(*rng.uniform(0, 40, 2)) for number in range(1, count + 1)}
    order = rng.permutation(np.arange(1, count + 1))
    true = np.array([table[str(number)] for number in order])
    place = np.exp(1j * rng.uniform(0, 6)) * true + complex(*rng.uniform(-50, 50, 2))
    place += noise_m * (rng.standard_normal(count) + 1j * rng.standard_normal(count))
    way_m = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(true)))))
    ids = [str(number - shift) for number in order]
    return shift_by_geometry(ids, place, way_m, {name: at * scale for name, at in table.items()})


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("shift", [-2, -1, 1])
def test_a_shift_is_found(shift: int, seed: int) -> None:
    found = walk(shift, seed)
    assert found is not None
    assert found.shift == shift
    assert f"fit the table under the logged ids, and {found.shifted} of" in found.text


@pytest.mark.parametrize("seed", range(10))
def test_right_ids_are_not_shifted_nor_other_faults(seed: int) -> None:
    assert walk(0, seed) is None
    assert walk(0, seed, count=3) is None
    assert walk(0, seed, scale=3.28) is None, "a table in feet"
    assert walk(0, seed, noise_m=8.0) is None, "a table of another building"


def test_what_cannot_be_known_is_not_said() -> None:
    assert shift_by_geometry([], np.empty(0, dtype=complex), np.empty(0), {}) is None
    place = np.array([0, 5, 9 + 3j])
    assert shift_by_geometry(["a", "b", "c"], place, np.arange(3.0), {"a": 0j, "b": 1j, "c": 2j}) is None
    assert shift_by_geometry(["1", "2", "3"], place, np.arange(3.0), {"7": 0j}) is None
