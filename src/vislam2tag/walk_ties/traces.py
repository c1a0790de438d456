"""A mapped walk, thinned to what others are told of it."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.core.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class WalkTrace:
    """Where a walk led, at ``n`` moments about a metre of way apart.

    ``time_ns`` (n,) boot clock, in time order; ``position_bcs`` (n, 2) metres; ``covariance_bcs`` (n, 2, 2), m^2;
    ``course_rad`` (n,) of the way from the BCS x axis; ``way_m`` (n,) walked until then, metres.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    covariance_bcs: FloatArray
    course_rad: FloatArray
    way_m: FloatArray
