"""Small made surveys for diagnosis: landmarks on a floor, and walks that pass them with a tracker's usual errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.estimation.tracker_errors import STATES
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.evidence import Evidence, Mark, PlacedWalk, Table
from vislam2tag.site.model import SessionKey

SIGHTING_M = 0.15
PLACES = {
    "1": 2 + 3j,
    "2": 14 + 4j,
    "3": 30 + 2j,
    "4": 41 + 12j,
    "5": 33 + 25j,
    "6": 19 + 22j,
    "7": 5 + 26j,
    "8": 9 + 13j,
}


def made_walk(
    order: Sequence[str], places: dict[str, complex], seed: int, floor: int = 0, start: str = "2022-01-10T09:00:00"
) -> WalkPasses:
    """A walk past landmarks that truly hang at these places."""
    rng = np.random.default_rng(seed)
    count = len(order)
    turn = np.exp(1j * rng.uniform(0, 2 * np.pi))
    true = np.array([places[name] for name in order])
    seen = turn * (true + rng.normal(0, SIGHTING_M, count) + 1j * rng.normal(0, SIGHTING_M, count)) + 100
    offset = turn * np.exp(1j * rng.uniform(0, 2 * np.pi, count))
    way = np.abs(np.diff(seen - offset))
    drift = np.zeros((max(count - 1, 0), STATES, STATES))
    drift[:, (0, 1), (0, 1)] = (0.016**2 * way)[:, None]
    drift[:, 2, 2], drift[:, 3, 3] = 0.0008**2 * way, 0.0015**2 * way
    return WalkPasses(
        key=SessionKey(floor, "LG", start),
        landmark=tuple(order),
        time_s=np.arange(0.0, 10.0 * count, 10.0),
        camera=seen - offset,
        offset=offset,
        sighting_m2=np.full(count, SIGHTING_M**2),
        drift=drift,
    )


ORDERS = ("12345678", "87654321", "3456712", "1284653")
STARTS = tuple(f"2022-01-{day}T09:00:00" for day in (10, 11, 12, 13))


def made_survey(true: dict[str, complex] | None = None, orders: Sequence[str] = ORDERS) -> list[WalkPasses]:
    """Walks past landmarks at these places (:data:`PLACES`), a day apart."""
    return [
        made_walk(tuple(order), true or PLACES, seed, start=start)
        for seed, (order, start) in enumerate(zip(orders, STARTS, strict=True))
    ]


def evidence(
    walks: Sequence[WalkPasses], table: dict[str, complex], other: dict[str, complex] | None = None
) -> Evidence:
    """These walks on a table of floor 0, and of floor 1 where there is another."""
    place = {Mark(0, name): at for name, at in table.items()}
    place |= {Mark(1, name): at for name, at in (other or {}).items()}
    everything = Table(place, {0: (45.0, 30.0)})
    return Evidence(
        everything,
        tuple(PlacedWalk.of(walk, dict.fromkeys(walk.landmark, walk.key.floor), everything) for walk in walks),
    )
