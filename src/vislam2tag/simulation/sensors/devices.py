"""The simulated phones: what differs from one to the next in radio, locale and clock, and the hand that presses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.simulation.choices import Locale
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.sensors.radio import PhoneReceiver
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.writing.session import DecimalMarks


@dataclass(frozen=True)
class PressTiming:
    """How one person presses: ``lead_s`` before the exact moment on average, normal scatter ``scatter_s``."""

    lead_s: float = 0.1
    scatter_s: float = 0.35


def simulate_presses(walk: TrueWalk, hand: PressTiming, rng: np.random.Generator) -> IntArray:
    """Return the times (p,) of the presses, boot-clock ns, in order and inside the walk."""
    error_s = rng.normal(-hand.lead_s, hand.scatter_s, len(walk.presses_ns))
    pressed = walk.presses_ns + (error_s * 1e9).astype(np.int64)
    inside: IntArray = np.sort(np.clip(pressed, walk.time_ns[0], walk.time_ns[-1]))
    return inside


DEVICE_NAMES = ("LG", "OnePlus", "Galaxy", "S20")
"""The phones of the published survey; further ones are called Phone5, Phone6, ..."""
_STATION_CLOCK_ERROR_S = 3.0
_OWN_MARKS = {
    "LG": DecimalMarks(",", ","),
    "OnePlus": DecimalMarks(",", "."),
    "Galaxy": DecimalMarks(".", "."),
    "S20": DecimalMarks(",", ","),
}


@dataclass(frozen=True)
class Device:
    """One phone and who carries it."""

    marks: DecimalMarks
    receiver: PhoneReceiver
    hand: PressTiming
    station_clock_ns: int
    """The total station's wall clock minus this phone's."""


def device_names(count: int) -> tuple[str, ...]:
    """Return the names of the first ``count`` phones."""
    further = (f"Phone{number}" for number in range(len(DEVICE_NAMES) + 1, count + 1))
    return (*DEVICE_NAMES[:count], *further)


def make_device(name: str, locale: Locale, seed: int) -> Device:
    """Draw a phone's constants; ``LG_ref`` and ``LG_tachy`` are the same phone as ``LG``."""
    family = name.split("_")[0]
    rng = stream(seed, "device", family)
    receiver = PhoneReceiver(offset_db=float(rng.normal(0, 3)), sensitivity_dbm=float(rng.uniform(-94, -90)))
    hand = PressTiming(lead_s=float(rng.normal(0.1, 0.1)), scatter_s=float(rng.uniform(0.3, 0.4)))
    clock_ns = int(rng.uniform(-_STATION_CLOCK_ERROR_S, _STATION_CLOCK_ERROR_S) * 1e9)
    marks = {
        Locale.DE: DecimalMarks(",", ","),
        Locale.EN: DecimalMarks(".", "."),
        Locale.MIXED: _OWN_MARKS.get(family, DecimalMarks(".", ".")),
    }[locale]
    return Device(marks, receiver, hand, clock_ns)
