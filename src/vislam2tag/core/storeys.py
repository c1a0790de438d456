"""What heights and floors are known by besides poses: the building's storeys, and air pressure."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.core.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Storeys:
    """The floors of a building, ``s`` of them, in order of their numbers.

    ``number`` (s,) int; ``elevation_m`` (s,) metres above the building's zero, NaN where unknown; ``own`` is the floor
    that a session lies under: where it starts.
    """

    own: int
    number: IntArray
    elevation_m: FloatArray


@dataclass(frozen=True)
class PressureLog:
    """Air pressure beside a walk: ``time_ns`` (p,) boot clock, strictly increasing; ``pressure_hpa`` (p,), finite."""

    time_ns: IntArray
    pressure_hpa: FloatArray
