"""Compares two labellings of the same walks: distances between positions, sigmas, and errors if the truth is known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.files.given_files import read_json
from vislam2tag.common.records import FiniteRecord
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.status import has_position, labelled_share
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.labeling.results import RESULTS, RUN_FILE, SessionResult
from vislam2tag.labeling.tables import TRAJECTORY, status_codes


class ComparedSession(FiniteRecord):
    """A session in two outputs; ``error`` is the mean error against truth, if that is known."""

    id: str
    labelled_a: float | None
    labelled_b: float | None
    sigma_a_m: float | None
    sigma_b_m: float | None
    error_a_m: float | None
    error_b_m: float | None
    apart_median_m: float | None
    apart_p95_m: float | None
    frames_compared: int


class ComparedTotal(FiniteRecord):
    """A measure over all sessions."""

    measure: str
    a: float | None
    b: float | None
    unit: str


class ComparedSetting(FiniteRecord):
    """A setting that differs."""

    name: str
    a: str
    b: str


class LabelComparison(FiniteRecord):
    """Two outputs of ``process`` side by side, walk by walk."""

    sessions: list[ComparedSession]
    totals: list[ComparedTotal]
    settings: list[ComparedSetting]


@dataclass(frozen=True)
class Positions:
    """Positions of a walk's frames in one output, in the order of the file."""

    position: FloatArray
    """(n, 2) metres, BCS of the frame's floor; any value if it has none."""
    floor: IntArray
    """(n,)"""
    there: BoolArray
    """(n,) whether the frame has a position."""


@dataclass(frozen=True)
class Labelled:
    """A walk in one output; without positions if its frames are missing."""

    result: SessionResult
    positions: Positions | None


def compare_labels(
    walks: Iterable[tuple[str, Labelled | None, Labelled | None]],
    settings_a: Mapping[str, object],
    settings_b: Mapping[str, object],
) -> LabelComparison:
    """Compare two outputs walk by walk: each walk's id with its labels in either (None: none).

    Walks are processed one at a time; only their results are kept.
    """
    sessions: list[ComparedSession] = []
    first: list[SessionResult | None] = []
    second: list[SessionResult | None] = []
    for id, a, b in walks:
        first.append(a.result if a else None)
        second.append(b.result if b else None)
        sessions.append(_session(id, first[-1], second[-1], _apart_m(a, b)))
    return LabelComparison(sessions=sessions, totals=_totals(first, second), settings=_settings(settings_a, settings_b))


def compare_outputs(first: Path, second: Path) -> LabelComparison:
    """Compare two output folders of ``process``; raises DatasetError if one of their files cannot be read."""
    slugs = sorted({path.stem for folder in (first, second) for path in (folder / RESULTS).glob("*.json")})
    walks = ((slug, _read(first, slug), _read(second, slug)) for slug in slugs)
    return compare_labels(walks, settings_of_output(first), settings_of_output(second))


def settings_of_output(folder: Path) -> dict[str, object]:
    """Settings of the labels; empty if they are not recorded."""
    try:
        found = read_json(folder / RUN_FILE)["settings"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return found if isinstance(found, dict) else {}


def mean_error_m(results: Sequence[SessionResult | None]) -> float | None:
    """Mean error of all labels whose truth is known, metres; None if none is."""
    rows = [row for result in results if result and result.errors for row in result.errors.rows]
    count = sum(sum(row.errors.values()) for row in rows)
    return sum(row.sum_m for row in rows) / count if count else None


def _read(folder: Path, slug: str) -> Labelled | None:
    session = LabelledSession(folder, slug)
    if not (folder / RESULTS / f"{slug}.json").is_file():
        return None
    result = session.result()
    if not session.has(TRAJECTORY):
        return Labelled(result, None)
    table = session.table(TRAJECTORY, ("x", "y", "floor", "status"))
    position = table.select("x", "y").fill_null(float("nan")).to_numpy()
    status = status_codes(table)
    return Labelled(result, Positions(position, table["floor"].to_numpy(), has_position(status)))


def _session(id: str, a: SessionResult | None, b: SessionResult | None, apart_m: FloatArray) -> ComparedSession:
    median, p95 = np.quantile(apart_m, (0.5, 0.95)).tolist() if len(apart_m) else (None, None)
    return ComparedSession(
        id=id,
        labelled_a=labelled_share(a.frames) if a else None,
        labelled_b=labelled_share(b.frames) if b else None,
        sigma_a_m=_sigma_m(a),
        sigma_b_m=_sigma_m(b),
        error_a_m=mean_error_m([a]),
        error_b_m=mean_error_m([b]),
        apart_median_m=median,
        apart_p95_m=p95,
        frames_compared=len(apart_m),
    )


def _apart_m(a: Labelled | None, b: Labelled | None) -> FloatArray:
    """Distances between the positions of frames that both outputs put on the same floor, in the order of one file."""
    if a is None or b is None:
        return np.empty(0)
    one, other = a.positions, b.positions
    if one is None or other is None or len(one.floor) != len(other.floor):
        return np.empty(0)
    both = one.there & other.there & (one.floor == other.floor)
    return np.asarray(np.linalg.norm(one.position[both] - other.position[both], axis=1))


def _totals(a: list[SessionResult | None], b: list[SessionResult | None]) -> list[ComparedTotal]:
    measures: tuple[tuple[str, Callable[[list[SessionResult | None]], float | None], str], ...] = (
        ("sessions", lambda results: float(sum(map(bool, results))), ""),
        ("labelled", _labelled, "share"),
        ("sigma_median", _typical_sigma_m, "m"),
        ("error_mean", mean_error_m, "m"),
    )
    return [ComparedTotal(measure=name, a=of(a), b=of(b), unit=unit) for name, of, unit in measures]


def _labelled(results: list[SessionResult | None]) -> float | None:
    return labelled_share(sum((Counter(result.frames) for result in results if result), Counter[str]()))


def _typical_sigma_m(results: list[SessionResult | None]) -> float | None:
    """Median over the sessions of their median sigma."""
    known = [sigma for result in results if (sigma := _sigma_m(result)) is not None]
    return float(np.median(known)) if known else None


def _sigma_m(result: SessionResult | None) -> float | None:
    return result.sigma.median_m if result and result.sigma else None


def _settings(a: Mapping[str, object], b: Mapping[str, object]) -> list[ComparedSetting]:
    first, second = dict(_leaves(a)), dict(_leaves(b))
    return [
        ComparedSetting(name=name, a=first.get(name, ""), b=second.get(name, ""))
        for name in sorted(first.keys() | second.keys())
        if first.get(name) != second.get(name)
    ]


def _leaves(settings: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, str(value)
