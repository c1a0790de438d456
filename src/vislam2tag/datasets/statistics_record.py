"""The statistics of a data set as JSON (``statistics.json``), small for data sets of any size.

Also writes the paper's Table III, the walks of each device, as CSV, Markdown and LaTeX.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from pydantic import Field

from vislam2tag.common.records import FiniteRecord
from vislam2tag.common.text_tables import csv_rows, latex_escaped, latex_table, markdown_table

UNKNOWN = "unknown"
"""Name of a device that no file names."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


class FieldWork(FiniteRecord):
    """Effort of a survey beyond the walks: setting up, pauses, ways between floors."""

    people: int = Field(ge=1, le=1_000_000)
    hours: float = Field(gt=0, le=1_000_000)
    """Hours from arrival to departure."""


class WalkTotals(FiniteRecord):
    """Sums over walks (paper, Table III); None if unknown for all walks."""

    trajectories: int
    duration_s: float | None = None
    distance_m: float | None = None
    velocity_m_s: float | None = None
    """Distance over duration, including pauses, of the walks for which both are known."""
    labelled_s: float | None = None
    labelled_m: float | None = None


class LabelCounts(FiniteRecord):
    """Number of fingerprints, of labelled ones (status ``ok``), and their share (None without fingerprints)."""

    fingerprints: int
    labelled: int
    share: float | None

    @classmethod
    def of(cls, fingerprints: int, labelled: int) -> Self:
        """Count and share."""
        share = round(labelled / fingerprints, 6) if fingerprints else None
        return cls(fingerprints=fingerprints, labelled=labelled, share=share)


class Distribution(FiniteRecord):
    """Distribution of a whole number: access points in a fingerprint, RSSI in dBm."""

    count: int
    mean: float
    deviation: float
    quantiles: dict[str, float]
    """By share (``0.05`` to ``0.95``): the smallest number that this share does not exceed."""
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
        """Width of at most ``most`` bins of equal width, and the count in each, by its smallest number."""
        lowest, highest = min(self.counts), max(self.counts)
        width = -(-(highest - lowest + 1) // most)
        bins = dict.fromkeys(range(lowest, highest + 1, width), 0)
        for number, count in self.counts.items():
            bins[lowest + (number - lowest) // width * width] += count
        return width, bins


class SigmaDistribution(FiniteRecord):
    """Distribution of sigma over fingerprints that have one, including uncertain ones, metres."""

    fingerprints: int
    median_m: float
    p95_m: float
    counts: dict[int, int]
    """Number of fingerprints by the bin of their sigma (:mod:`vislam2tag.common.error_statistics`)."""


class DeviceRssi(FiniteRecord):
    """RSSI of one device."""

    rssi_dbm: Distribution
    offset_db: float | None
    """Offset against the mean of the devices that share places with it; None if there are none."""
    shared: int
    """Number of access points heard in a cell that another device heard there, too, over all cells."""


class FloorLabels(FiniteRecord):
    """The fingerprints of one floor. Unlabelled ones count on the floor of their walk (None: nowhere)."""

    building: str
    floor: int | None
    labels: LabelCounts
    by_device: dict[str, LabelCounts]


class TechnologyStatistics(FiniteRecord):
    """The fingerprints of one technology."""

    labels: LabelCounts
    readings: int
    labelled_readings: int
    """Readings with a position, including those of uncertain fingerprints."""
    transmitters: int
    by_device: dict[str, LabelCounts]
    by_floor: tuple[FloorLabels, ...]
    statuses: dict[str, int]
    """Fingerprints by status: ``ok``, or why there is no position, or only an uncertain one."""
    heard: Distribution
    """Access points (or beacons) in a fingerprint."""
    rssi: dict[str, DeviceRssi]
    sigma: SigmaDistribution | None
    labelled_per_minute: float | None
    """Labelled fingerprints for each minute of walking."""
    labelled_per_person_hour: float | None
    """Labelled fingerprints for each person-hour of :class:`Effort`."""


class Effort(FiniteRecord):
    """The cost of labels."""

    basis: Literal["total time", "walking time"]
    """Whether person-hours are time on site times people, or only the walks with one person each."""
    people: int | None
    person_hours: float
    labelled_m_per_minute: float | None
    """Labelled metres for each minute of walking."""
    labelled_m_per_person_hour: float | None


class SessionStatistics(FiniteRecord):
    """One walk; None if its files do not contain it."""

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
    """None if no walk has a duration and a length, as in data sets of single points."""
    technologies: dict[str, TechnologyStatistics]
    sessions: tuple[SessionStatistics, ...]

    @property
    def main(self) -> tuple[str, TechnologyStatistics] | None:
        """Wi-Fi if there is any, else the technology with the most fingerprints; None in an empty set."""
        if not self.technologies:
            return None
        return max(self.technologies.items(), key=lambda item: (item[0] == "wifi", item[1].labels.fingerprints))


TABLE_3_TITLE = "Table III: walks by device"
HEADS = ("trajectories", "duration / min", "walked distance / m", "average velocity / m/s")
ALL = "all"
"""Name of the row of totals."""
PAPER: Mapping[str, Sequence[float | None]] = {
    "Galaxy": (24, 54.77, 2559.39, 0.99),
    "LG": (18, 77.56, 3701.38, 0.92),
    "OnePlus": (24, 51.49, 2351.40, 0.94),
    "S20": (15, 68.18, 2624.85, 0.98),
    ALL: (81, 252.00, 11237.02, None),
}
"""The paper's numbers for giaIndoorLoc; the totals are sums of its rows. Its velocities exceed its own distance over
duration (0.64 to 0.80 m/s), for unknown reasons. Ours are distance over duration."""
PAPER_FINGERPRINTS = 2049
"""Labelled fingerprints of giaIndoorLoc, by two people in under two hours (paper, section VII)."""
_NONE = "-"
_COLUMNS = ("trajectories", "duration_min", "distance_m", "velocity_m_s")


@dataclass(frozen=True)
class Table3:
    """Rows by device with the total last, with or without the paper's numbers."""

    rows: tuple[tuple[str, tuple[float | None, ...]], ...]
    beside_paper: bool

    @classmethod
    def of(cls, by_device: Mapping[str, WalkTotals], total: WalkTotals, *, beside_paper: bool = False) -> Table3:
        """Make the table from statistics; devices that only the paper has are skipped."""
        rows = [*by_device.items(), (ALL, total)]
        return cls(tuple((device, _numbers(walks)) for device, walks in rows), beside_paper)

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns after the device."""
        return tuple(head for own in HEADS for head in ((own, "paper") if self.beside_paper else (own,)))

    def texts(self) -> list[tuple[str, tuple[str, ...]]]:
        """Each device with its numbers as text, or a dash."""
        return [(device, tuple(self._beside(device, numbers))) for device, numbers in self.rows]

    def _beside(self, device: str, numbers: Sequence[float | None]) -> list[str]:
        own = _shown(numbers)
        if not self.beside_paper:
            return own
        paper = _shown(PAPER.get(device, (None,) * len(HEADS)))
        return [text for pair in zip(own, paper, strict=True) for text in pair]


def table_3_csv(table: Table3) -> str:
    """One line for each device; unknown numbers are empty."""
    paper = [f"paper_{name}" for name in _COLUMNS] if table.beside_paper else []
    rows = [("device", *_COLUMNS, *paper)]
    for device, numbers in table.rows:
        beside = PAPER.get(device, (None,) * len(_COLUMNS)) if table.beside_paper else ()
        rows.append((device, *("" if number is None else f"{number:.10g}" for number in (*numbers, *beside))))
    return csv_rows(rows)


def table_3_markdown(table: Table3) -> str:
    """The table as Markdown."""
    rows = ((device, *texts) for device, texts in table.texts())
    return markdown_table(TABLE_3_TITLE, ("device", *table.heads), rows, texts=1)


def table_3_latex(table: Table3) -> str:
    """A ``tabular`` (package booktabs)."""
    rows = [(latex_escaped(device), *texts) for device, texts in table.texts()]
    return latex_table(TABLE_3_TITLE, (("Device", *table.heads),), (rows[:-1], rows[-1:]), texts=1)


def _numbers(walks: WalkTotals) -> tuple[float | None, ...]:
    minutes = None if walks.duration_s is None else round(walks.duration_s / 60, 2)
    return walks.trajectories, minutes, walks.distance_m, walks.velocity_m_s


def _shown(numbers: Sequence[float | None]) -> list[str]:
    """Trajectories as a whole number, everything else with two decimals."""
    return [
        _NONE if number is None else f"{number:.0f}" if column == 0 else f"{number:.2f}"
        for column, number in enumerate(numbers)
    ]
