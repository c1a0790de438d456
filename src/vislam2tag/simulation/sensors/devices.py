"""The simulated phones: what differs from one to the next in radio, locale, clock and owner."""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.simulation.choices import Locale
from vislam2tag.simulation.sensors.presses import Hand
from vislam2tag.simulation.sensors.radio import Receiver
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.writing.session import DecimalMarks

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
    receiver: Receiver
    hand: Hand
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
    receiver = Receiver(offset_db=float(rng.normal(0, 3)), sensitivity_dbm=float(rng.uniform(-94, -90)))
    hand = Hand(lead_s=float(rng.normal(0.1, 0.1)), scatter_s=float(rng.uniform(0.3, 0.4)))
    clock_ns = int(rng.uniform(-_STATION_CLOCK_ERROR_S, _STATION_CLOCK_ERROR_S) * 1e9)
    marks = {
        Locale.DE: DecimalMarks(",", ","),
        Locale.EN: DecimalMarks(".", "."),
        Locale.MIXED: _OWN_MARKS.get(family, DecimalMarks(".", ".")),
    }[locale]
    return Device(marks, receiver, hand, clock_ns)
