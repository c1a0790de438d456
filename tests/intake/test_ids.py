"""Ids of two sets."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.intake.ids import IdComparison, IdShift, compare_ids, shift_by_geometry

NUMBERS = [str(number) for number in range(1, 10)]
AFFIX = st.text(alphabet="abcDEF_- ", max_size=6)


def compared(ours: list[str], theirs: list[str]) -> IdComparison:
    return compare_ids(ours, theirs, ("the table", "the phone"))


@given(
    numbers=st.sets(st.integers(1, 5000), min_size=2, max_size=30), ahead=AFFIX, behind=AFFIX, width=st.integers(1, 5)
)
def test_prefix_suffix_and_padding_are_found(numbers: set[int], ahead: str, behind: str, width: int) -> None:
    ours = [str(number) for number in sorted(numbers)]
    theirs = [f"{ahead}{number:0{width}d}{behind}" for number in sorted(numbers)]
    found = compared(ours, theirs)
    if len(found.unknown) >= 2:
        assert found.differ
        assert found.pattern is not None
        renamed = dict(zip(theirs, ours, strict=True))
        assert all(renamed[name] == own for name, own in found.pattern.mapping.items())
        assert set(found.pattern.mapping) == set(found.unknown)
        assert compared(theirs, ours).pattern is not None


@given(count=st.integers(2, 40), shift=st.integers(50, 3000))
def test_a_shift_of_whole_sets_is_found(count: int, shift: int) -> None:
    ours = [str(number) for number in range(1, count + 1)]
    found = compared(ours, [str(int(name) + shift) for name in ours])
    assert found.differ
    assert found.pattern is not None
    assert found.pattern.kind == f"all shifted by -{shift}"


@given(
    ours=st.sets(st.text(min_size=1, max_size=6), max_size=15),
    theirs=st.sets(st.text(min_size=1, max_size=6), max_size=15),
)
def test_whatever_the_ids_are_the_counts_hold(ours: set[str], theirs: set[str]) -> None:
    found = compared(sorted(ours), sorted(theirs))
    assert set(found.agree) == ours & theirs
    assert set(found.unknown) == theirs - ours
    if found.pattern is not None:
        assert set(found.pattern.mapping) <= theirs - ours
        assert set(found.pattern.mapping.values()) <= ours - theirs
        assert len(set(found.pattern.mapping.values())) == len(found.pattern.mapping)


@pytest.mark.parametrize(
    ("ours", "theirs", "pattern"),
    [
        (NUMBERS, [f"tag_{name}" for name in NUMBERS], "other prefix or suffix: tag_1 there is 1 here"),
        (["LM1", "LM2", "LM3"], ["tag-1", "tag-2"], "other prefix or suffix: tag-1 there is LM1 here"),
        (["Lobby", "Door"], ["lobby", "door"], "upper and lower case or separators: lobby there is Lobby here"),
        (["tag_1", "tag_2"], ["tag_01", "tag_02"], "zero padding: tag_01 there is tag_1 here"),
        (["A_1", "A_2"], ["B_2", "B_3"], None),
        (NUMBERS, ["x", "y", "z"], None),
        (NUMBERS, ["1", "2", "tag_5", "tag_6"], "other prefix or suffix: tag_5 there is 5 here"),
    ],
)
def test_sets_of_other_kinds(ours: list[str], theirs: list[str], pattern: str | None) -> None:
    found = compared(ours, theirs)
    assert found.differ
    assert found.pattern is None or pattern is None or found.pattern.text == pattern
    assert (found.pattern is None) == (pattern is None) or ours == ["A_1", "A_2"]
    assert f"the table has {len(ours)} ids ({ours[0]}" in found.text
    assert f"the phone has {len(theirs)} ids ({theirs[0]}" in found.text


@pytest.mark.parametrize("theirs", [["3", "4"], ["1", "2", "44"], ["1", "44", "45"], ["44"], [], ["1", "a", "b"]])
def test_some_of_the_landmarks_and_new_ones_are_usual(theirs: list[str]) -> None:
    assert not compared(NUMBERS, theirs).differ


@pytest.mark.parametrize(
    ("ours", "theirs", "by"),
    [
        (range(1, 40), range(41, 45), None),
        (range(1, 10), range(11, 14), None),
        (range(1, 40), range(40, 42), None),
        (range(1, 10, 2), range(2, 9, 2), None),
        (range(10, 40), (9, 40), None),
        (range(2, 40, 2), range(1, 39, 2), "+1"),
        (range(1, 10), range(101, 110), "-100"),
        (range(1, 10), range(11, 20), "-10"),
        ((3, 7, 20, 31), (5, 9, 22), "-2"),
    ],
)
def test_a_shift_is_claimed_only_if_no_other_fits_as_well(
    ours: Iterable[int], theirs: Iterable[int], by: str | None
) -> None:
    found = compared(list(map(str, ours)), list(map(str, theirs)))
    assert found.differ
    if by is None:
        assert found.pattern is None
        assert "no simple pattern maps one set to the other" in found.text
    else:
        assert f"the pattern is: all shifted by {by}" in found.text


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
