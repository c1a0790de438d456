"""A plan shows how a table is turned if walks would go through its walls by more than a tracker's error explains."""

from __future__ import annotations

import numpy as np
import pytest

from tests.quality.diagnosis.made_walks import PLACES, evidence, made_survey
from vislam2tag.common.findings import FaultKind
from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.transforms import as_points
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.evidence import Way
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.search import found_faults
from vislam2tag.quality.diagnosis.turned_tables import Inside, walls_crossed, with_turns_by_plan
from vislam2tag.site.corrections.file import TurnLandmarks

WIDTH_M, HEIGHT_M = 45.0, 30.0


def near_the_way(points_m: FloatArray) -> BoolArray:
    """A building that is free within 2 m of where the walks went, and nowhere else."""
    way = np.concatenate([walk.camera + walk.offset for walk in made_survey()])
    true = evidence(made_survey(), PLACES).walks
    on_plan = np.concatenate([walk.alignment.origin + walk.alignment.turn * walk.passes.camera for walk in true])
    assert len(way) == len(on_plan)
    place = points_m[:, 0] + 1j * points_m[:, 1]
    return np.asarray(np.abs(place[:, None] - on_plan).min(axis=1) < 2.0)


def everywhere(points_m: FloatArray) -> BoolArray:
    return np.ones(len(points_m), dtype=bool)


def way_of(walk: WalkPasses, steps: int = 1) -> Way:
    """Straight from pass to pass, in so many steps each."""
    at = np.linspace(0, len(walk.camera) - 1, steps * (len(walk.camera) - 1) + 1)
    rows = np.arange(len(walk.camera))
    return Way(np.interp(at, rows, walk.time_s), np.interp(at, rows, walk.camera))


def told(table: dict[str, complex], inside: Inside = near_the_way, steps: int = 1) -> list[Fault]:
    walks = made_survey()
    faults, corrected = found_faults(evidence(walks, table))
    ways = {walk.key: way_of(walk, steps) for walk in walks}
    return with_turns_by_plan(faults, corrected, ways, {0: inside})


def corrected_places(table: dict[str, complex], fault: Fault) -> dict[str, complex]:
    """As ``corrections.toml`` puts the landmarks by the fault's entry."""
    values = {name: of for name, of in fault.corrections[-1].values.items() if name != "reason"}
    entry = TurnLandmarks(**values)
    turn = np.exp(1j * np.radians(entry.turn_deg))
    return {
        name: turn * (-place.conjugate() if entry.mirrored else place) + complex(*entry.shift_m)
        for name, place in table.items()
    }


def test_a_sound_table_is_not_turned() -> None:
    assert told(PLACES) == []


def test_half_a_turn_is_told_by_walls_alone() -> None:
    table = {name: complex(WIDTH_M, HEIGHT_M) - place for name, place in PLACES.items()}
    (fault,) = told(table)
    assert (fault.kind, fault.floor) == (FaultKind.TURNED, 0)
    assert "turned by 180 degrees" in fault.summary
    assert "100 % of the path of 4 walks is free" in fault.evidence
    assert corrected_places(table, fault) == pytest.approx(PLACES)


def test_which_quarter_is_told_by_walls() -> None:
    """By its extent the plan would not say whether by 90 or by 270 degrees."""
    table = {name: complex(HEIGHT_M - place.imag, place.real) for name, place in PLACES.items()}
    (fault,) = told(table)
    assert fault.corrections[0].values["turn_deg"] == 270.0
    assert corrected_places(table, fault) == pytest.approx(PLACES)


def test_about_which_line_a_table_is_mirrored() -> None:
    table = {name: complex(place.real, HEIGHT_M - place.imag) for name, place in PLACES.items()}
    (fault,) = told(table)
    assert fault.kind is FaultKind.MIRRORED
    assert "check on the plan about which line" in fault.evidence
    assert corrected_places(table, fault) == pytest.approx(PLACES)


def test_a_plan_that_hardly_changes_by_half_a_turn_is_told_by_the_walls_crossed() -> None:
    """Few places of a way lie in the walls that it leads through: shares of it would not tell."""
    walks = evidence(made_survey(), PLACES).walks
    true = np.concatenate([way for walk in walks if (way := walk.on_plan(way_of(walk.passes, 20))) is not None])
    turned = complex(WIDTH_M, HEIGHT_M) - true
    walls = turned[np.abs(turned[:, None] - true).min(axis=1) > 1.7][::30]

    def inside(points_m: FloatArray) -> BoolArray:
        place = points_m[:, 0] + 1j * points_m[:, 1]
        beside = np.maximum(
            np.abs(place.real - WIDTH_M / 2) - WIDTH_M / 2, np.abs(place.imag - HEIGHT_M / 2) - HEIGHT_M / 2
        )
        return np.asarray((beside < 2) & (np.abs(place[:, None] - walls).min(axis=1) > 0.8))

    assert inside(as_points(turned)).mean() > 0.9
    table = {name: complex(WIDTH_M, HEIGHT_M) - place for name, place in PLACES.items()}
    (fault,) = told(table, inside, steps=20)
    assert "turned by 180 degrees" in fault.summary
    assert "cross 0 of the plan's walls with this correction, and " in fault.evidence
    assert told(PLACES, inside, steps=20) == []


def test_a_plan_without_walls_in_the_way_tells_nothing() -> None:
    table = {name: complex(WIDTH_M, HEIGHT_M) - place for name, place in PLACES.items()}
    assert told(table, everywhere) == []


def hall(points_m: FloatArray) -> BoolArray:
    """Two rooms, parted at x = 10 by a wall of 20 cm with a door from y = 4 to 5."""
    x, y = points_m.T
    return np.asarray((np.abs(x - 10) > 0.1) | ((y > 4) & (y < 5)))


def across(y: float, x: tuple[float, float] = (6.0, 14.0)) -> ComplexArray:
    return np.asarray(np.arange(*x, 0.5) + 1j * y)


GAP = across(9.0)
GAP[6:10] = np.nan


@pytest.mark.parametrize(
    ("ways", "walls"),
    [
        ([across(4.5)], 0),
        ([across(3.6), across(5.4)], 0),  # through the door, off by less than half a metre
        ([across(2.0)], 1),
        ([across(2.0), across(2.5), across(8.0)], 2),  # twice in one place
        ([across(2.0, (0.0, 8.0))], 0),
        ([GAP], 0),
        ([], 0),
    ],
)
def test_walls_that_ways_lead_through(ways: list[ComplexArray], walls: int) -> None:
    assert walls_crossed(hall, ways) == walls
