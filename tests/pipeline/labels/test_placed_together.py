"""What walks that are placed on one plan say of each other, and which known place is asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.test_candidate_walks import AWAY
from tests.positioning.test_walk_ties import heard, route
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlacingHints
from vislam2tag.pipeline.labels.placed_together import PlacedSession, placing_hints
from vislam2tag.positioning import candidate_walks
from vislam2tag.site.model import SessionKey

START_NS = 5 * 10**9
ASK_NS = START_NS + 65 * 10**9
BOTH = (0 * AWAY, AWAY)


def key(name: str) -> SessionKey:
    return SessionKey(1, "LG", name)


def placed(
    name: str, *shifts: FloatArray, weight: tuple[float, ...] = (1.0,), north_rad: float | None = None
) -> PlacedSession:
    """A walk through the hall with its scans, whose paths are the true one, shifted; certain, if it has one."""
    rng = np.random.default_rng(ord(name))
    way = route(rng)
    scans = heard(way, rng)
    assert scans.time_ns is not None
    time_ns = START_NS + np.arange(0, len(way), 5) * 10**9
    return PlacedSession(
        key(name),
        weight=np.array(weight),
        time_ns=time_ns,
        position=np.stack([way[::5] + shift for shift in shifts or BOTH[:1]]),
        north_rad=None if north_rad is None else np.full(len(weight), north_rad),
        scans=replace(scans, time_ns=START_NS + np.arange(len(scans)) * 2 * 10**9),
        ask_ns=ASK_NS if len(weight) > 1 else None,
        start_ns=START_NS,
    )


def unsure(name: str, north_rad: float | None = None) -> PlacedSession:
    """A walk with two paths, of which the first is true."""
    return placed(name, *BOTH, weight=(0.5, 0.5), north_rad=north_rad)


def test_walks_that_are_certain_show_where_another_one_was() -> None:
    hints, question = placing_hints([unsure("b"), placed("a"), PlacedSession(key("c"))])
    assert hints.keys() == {key("b")}
    (place,) = hints[key("b")].places
    assert place.time_ns == ASK_NS
    assert place.weight[0] > 0.9
    assert place.weight[1] < 0.05
    np.testing.assert_allclose(place.weight * 100, np.round(place.weight * 100), atol=1e-9)
    np.testing.assert_allclose(place.position_bcs[1] - place.position_bcs[0], AWAY, atol=0.11)
    assert question == []


def test_a_walk_that_may_have_taken_none_of_its_paths_gets_less_weight_for_them() -> None:
    lost = placed("b", np.array([0.0, 6.0]), AWAY, weight=(0.7, 0.3))
    hints, _ = placing_hints([placed("a"), lost])
    (place,) = hints[key("b")].places
    assert 0.1 < place.weight.sum() < 0.9


def test_walks_beyond_the_most_combinations_hear_those_that_are_certain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidate_walks, "MOST_COMBINATIONS", 3)
    hints, _ = placing_hints([placed("a"), unsure("b"), unsure("c")])
    assert hints.keys() == {key("b"), key("c")}
    assert all(hint.places[0].weight[0] > 0.9 for hint in hints.values())


def test_walks_that_share_no_scans_say_nothing_of_each_other() -> None:
    alone = replace(unsure("b"), scans=None)
    assert placing_hints([placed("a"), alone])[0] == {}


def hint_of(*norths: float | None) -> PlacingHints | None:
    """What a walk without a place hears from certain walks whose compasses show these directions."""
    certain = [replace(placed(name, north_rad=north), scans=None) for name, north in zip("acd", norths, strict=False)]
    others = [replace(unsure(name, north), scans=None) for name, north in (("b", 2.0), ("e", 0.3))]
    assert others[0].north_rad is not None
    others[0].north_rad[1] = 0.3
    hints, _ = placing_hints([*certain, *others])
    assert hints.keys() <= {key("b"), key("e")}
    return hints.get(key("b"))


@pytest.mark.parametrize(
    ("norths", "north_rad"),
    [
        ((0.28, 0.34), 0.3),
        ((0.28, 0.34, 0.31), 0.3),
        ((np.pi - 0.02, -np.pi + 0.12), -3.1),
        ((0.3,), None),
        ((0.3, None), None),
        ((0.3, 2.0), None),
    ],
)
def test_two_certain_walks_show_north(norths: tuple[float | None, ...], north_rad: float | None) -> None:
    hint = hint_of(*norths)
    if north_rad is None:
        assert hint is None or hint.north_rad is None
    else:
        assert hint is not None
        assert hint.north_rad == pytest.approx(north_rad)
        assert hint.places == (), "the direction does not count twice"


def asked(*walks: PlacedSession) -> Finding:
    (found,) = placing_hints(walks)[1]
    assert found.kind == "one_place_helps"
    return found


def test_the_place_that_settles_most_walks_is_asked_for() -> None:
    alone = replace(unsure("a"), scans=None)
    found = asked(alone, unsure("b"), unsure("c"))
    assert found.count == 2
    assert "the plan does not place 3 walks with certainty. One known place settles 2: " in found.message
    assert any(f"where session {key(name)} was at 1:05" in found.message for name in "bc")
    assert "(at_s = 65)" in found.message
    assert asked(unsure("c"), alone, unsure("b")) == found
    assert asked(alone).count == 1


def test_a_walk_with_one_path_that_is_refused_in_part_is_asked_for_too() -> None:
    refused = replace(placed("b"), ask_ns=ASK_NS)
    found = asked(placed("a"), refused)
    assert found.count == 1
    assert "the plan does not place 1 walk with certainty" in found.message
    assert f"session {key('b')} was at 1:05" in found.message
    assert placing_hints([placed("a"), placed("b")])[1] == []


def test_nothing_is_said_without_walks() -> None:
    assert placing_hints([PlacedSession(key("a"))]) == ({}, [])
