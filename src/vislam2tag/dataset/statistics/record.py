"""The statistics of a data set as JSON (``statistics.json``): small whatever the size of the set."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from vislam2tag.common.records import FiniteRecord

UNKNOWN = "unknown"
"""What stands for a device that no file names."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


class FieldWork(FiniteRecord):
    """What the survey took beside the walks themselves: setting up, pauses, ways between floors."""

    people: int = Field(ge=1, le=1_000_000)
    hours: float = Field(gt=0, le=1_000_000)
    """From arrival to departure."""


class WalkTotals(FiniteRecord):
    """Sums over walks (paper, Table III); None where no walk tells."""

    trajectories: int
    duration_s: float | None = None
    distance_m: float | None = None
    velocity_m_s: float | None = None
    """Distance over duration, pauses included, of the walks that know both."""
    labelled_s: float | None = None
    labelled_m: float | None = None


class LabelCounts(FiniteRecord):
    """Fingerprints, how many of them are labelled (status ``ok``), and what share that is (None of none)."""

    fingerprints: int
    labelled: int
    share: float | None

    @classmethod
    def of(cls, fingerprints: int, labelled: int) -> Self:
        """Count and share."""
        share = round(labelled / fingerprints, 6) if fingerprints else None
        return cls(fingerprints=fingerprints, labelled=labelled, share=share)


class Distribution(FiniteRecord):
    """How a whole number is distributed: access points a fingerprint, RSSI in dBm."""

    count: int
    mean: float
    deviation: float
    quantiles: dict[str, float]
    """By share (``0.05`` to ``0.95``): the least number that so large a share does not exceed."""
    counts: dict[int, int]
    """How often each number occurs."""

    @classmethod
    def of(cls, counts: Mapping[int, int]) -> Self:
        """Reduce counts, at least one."""
        numbers = np.array(sorted(counts))
        often = np.array([counts[number] for number in numbers.tolist()])
        mean = float(np.average(numbers, weights=often))
        upto = np.cumsum(often)
        places = np.searchsorted(upto, np.array(QUANTILES) * upto[-1])
        return cls(
            count=int(upto[-1]),
            mean=round(mean, 4),
            deviation=round(float(np.sqrt(np.average((numbers - mean) ** 2, weights=often))), 4),
            quantiles={str(share): float(numbers[place]) for share, place in zip(QUANTILES, places, strict=True)},
            counts=dict(zip(numbers.tolist(), often.tolist(), strict=True)),
        )

    def binned(self, most: int) -> tuple[int, dict[int, int]]:
        """Width of at most ``most`` bins of equal width, and how many numbers fall into each, by its least number."""
        lowest, highest = min(self.counts), max(self.counts)
        width = -(-(highest - lowest + 1) // most)
        bins = dict.fromkeys(range(lowest, highest + 1, width), 0)
        for number, count in self.counts.items():
            bins[lowest + (number - lowest) // width * width] += count
        return width, bins


class SigmaDistribution(FiniteRecord):
    """How sure the positions are: sigma of the fingerprints that state one, uncertain ones included, metres."""

    fingerprints: int
    median_m: float
    p95_m: float
    counts: dict[int, int]
    """Number of fingerprints by the bin of their sigma (:mod:`vislam2tag.common.log_bins`)."""


class DeviceRssi(FiniteRecord):
    """What one device hears."""

    rssi_dbm: Distribution
    offset_db: float | None
    """How much louder it hears than the mean of the devices that share places with it; None where none does."""
    shared: int
    """Access points heard in a cell where another device heard them as well, over all cells."""


class FloorLabels(FiniteRecord):
    """The fingerprints of one floor. One without a label counts where its walk says that it was (None: nowhere)."""

    building: str
    floor: int | None
    labels: LabelCounts
    by_device: dict[str, LabelCounts]


class TechnologyStatistics(FiniteRecord):
    """The fingerprints of one technology."""

    labels: LabelCounts
    readings: int
    labelled_readings: int
    """Readings with a position, that of uncertain fingerprints included."""
    transmitters: int
    by_device: dict[str, LabelCounts]
    by_floor: tuple[FloorLabels, ...]
    statuses: dict[str, int]
    """Fingerprints by status: ``ok``, or why there is no position, or none that is sure."""
    heard: Distribution
    """Access points (or beacons) a fingerprint."""
    rssi: dict[str, DeviceRssi]
    sigma: SigmaDistribution | None
    labelled_per_minute: float | None
    """Labelled fingerprints a minute of walking."""
    labelled_per_person_hour: float | None
    """By :class:`Effort`."""


class Effort(FiniteRecord):
    """What labels cost."""

    basis: Literal["total time", "walking time"]
    """Whether person-hours count all time on site times people, or only the walks, one person each."""
    people: int | None
    person_hours: float
    labelled_m_per_minute: float | None
    """Labelled metres a minute of walking."""
    labelled_m_per_person_hour: float | None


class SessionStatistics(FiniteRecord):
    """One walk; None where its files do not tell."""

    session: str
    device: str
    building: str
    floor: int | None
    started: dt.datetime | None
    duration_s: float | None
    distance_m: float | None
    labelled_s: float | None
    labelled_m: float | None
    labels: dict[str, LabelCounts]
    """By technology."""


class DatasetStatistics(FiniteRecord):
    """Totals of a data set, by device, floor and walk."""

    name: str
    walks: WalkTotals
    by_device: dict[str, WalkTotals]
    effort: Effort | None
    """None where no walk has a duration and a length, as in sets of single points."""
    technologies: dict[str, TechnologyStatistics]
    sessions: tuple[SessionStatistics, ...]

    @property
    def main(self) -> tuple[str, TechnologyStatistics] | None:
        """Wi-Fi where there is any, else the technology with the most fingerprints; None in an empty set."""
        if not self.technologies:
            return None
        return max(self.technologies.items(), key=lambda item: (item[0] == "wifi", item[1].labels.fingerprints))
