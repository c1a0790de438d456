"""Totals of a run, reduced from the session results one at a time."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from vislam2tag.common import log_bins
from vislam2tag.common.findings import Finding
from vislam2tag.core.status import Status
from vislam2tag.evaluation.reliability import added
from vislam2tag.labeling.results import (
    ContradictionMark,
    ErrorRecord,
    LandmarkContradiction,
    SessionResult,
    SigmaStatistics,
    Summary,
)

_Key = tuple[int, str]
"""Floor and landmark."""


@dataclass
class LandmarkTally:
    """Counts sessions by landmark; its size grows with the landmarks alone."""

    _seen: Counter[_Key] = field(default_factory=Counter)
    _found: dict[_Key, LandmarkContradiction] = field(default_factory=dict)

    def add(self, result: SessionResult) -> None:
        """Add what one session says."""
        said = {mark.landmark: mark for mark in result.contradictions}
        for landmark in result.landmarks_logged:
            floor = said[landmark].floor if landmark in said else result.floor
            self._seen[floor, landmark] += 1
        for mark in said.values():
            self._found[mark.floor, mark.landmark] = _joined(self._found.get((mark.floor, mark.landmark)), mark)

    def all(self) -> list[LandmarkContradiction]:
        """Return all contradictions, those that most sessions speak of first, then the greatest."""
        complete = [found.model_copy(update={"seen": self._seen[key]}) for key, found in sorted(self._found.items())]
        return sorted(complete, key=lambda found: (-found.sessions, -found.greatest_m))


def _joined(before: LandmarkContradiction | None, mark: ContradictionMark) -> LandmarkContradiction:
    """Take one more session into the mean offset."""
    sessions = 1 + (before.sessions if before else 0)
    x, y = before.offset_m if before else (0.0, 0.0)
    return LandmarkContradiction(
        floor=mark.floor,
        landmark=mark.landmark,
        sessions=sessions,
        seen=0,
        greatest_m=max(mark.size_m, before.greatest_m if before else 0.0),
        surveyed_m=before.surveyed_m if before else mark.surveyed_m,
        offset_m=(
            round(x + (mark.offset_m[0] - x) / sessions, 4),
            round(y + (mark.offset_m[1] - y) / sessions, 4),
        ),
    )


_Number = TypeVar("_Number", int, float)

_OK = Status.OK.label
_DUPLICATE = Status.DUPLICATE.label


def summarise(
    results: Iterable[SessionResult], strategy: str, version: str, site_findings: Iterable[Finding] = ()
) -> Summary:
    """Add up the results of a run's sessions; takes them one at a time, so memory does not grow with the survey.

    ``per_floor`` and ``per_device`` hold, for each floor number or device name, ``sessions``, ``failed``,
    ``duration_s``, ``distance_m``, ``frames`` and ``frames_ok`` (both without repeated frames).
    """
    totals = _Totals()
    for result in results:
        totals.add(result)
    return Summary(
        version=version,
        strategy=strategy,
        sessions=totals.sessions,
        failed=len(totals.failures),
        duration_s=round(totals.duration_s, 3),
        distance_m=round(totals.distance_m, 3),
        frames=_sorted(totals.frames),
        frame_seconds=_rounded(totals.frame_seconds),
        readings={table: _sorted(counts) for table, counts in sorted(totals.readings.items())},
        findings=_sorted(totals.findings),
        site_findings=findings_by_kind(site_findings),
        failures=totals.failures,
        events=_sorted(totals.events),
        contradictions=totals.contradictions.all(),
        sigma=_sigma(totals),
        errors=totals.errors,
        per_floor={str(floor): _rounded(sums) for floor, sums in sorted(totals.floors.items())},
        per_device={device: _rounded(sums) for device, sums in sorted(totals.devices.items())},
    )


def findings_by_kind(findings: Iterable[Finding]) -> dict[str, int]:
    """Count what was found, by kind, sorted."""
    counts = _integers()
    for finding in findings:
        counts[finding.kind] += finding.count
    return _sorted(counts)


def _integers() -> dict[str, int]:
    return defaultdict(int)


def _floats() -> dict[str, float]:
    return defaultdict(float)


@dataclass
class _Totals:
    """Running sums over the sessions added so far."""

    sessions: int = 0
    duration_s: float = 0.0
    distance_m: float = 0.0
    frames: dict[str, int] = field(default_factory=_integers)
    frame_seconds: dict[str, float] = field(default_factory=_floats)
    readings: dict[str, dict[str, int]] = field(default_factory=lambda: defaultdict(_integers))
    findings: dict[str, int] = field(default_factory=_integers)
    failures: dict[str, str] = field(default_factory=dict)
    events: dict[str, int] = field(default_factory=_integers)
    contradictions: LandmarkTally = field(default_factory=LandmarkTally)
    sigma: Counter[int] = field(default_factory=Counter)
    """Frames by the bin of their sigma."""
    uncertain: float = 0.0
    errors: ErrorRecord | None = None
    floors: dict[int, dict[str, float]] = field(default_factory=lambda: defaultdict(_floats))
    devices: dict[str, dict[str, float]] = field(default_factory=lambda: defaultdict(_floats))

    def add(self, result: SessionResult) -> None:
        self.sessions += 1
        self.duration_s += result.duration_s
        self.distance_m += result.distance_m
        _accumulate(self.frames, result.frames)
        _accumulate(self.frame_seconds, result.frame_seconds)
        for table, counts in result.readings.items():
            _accumulate(self.readings[table], counts)
        _accumulate(self.findings, findings_by_kind(result.findings))
        _accumulate(self.events, Counter(event.kind.value for event in result.events))
        self.contradictions.add(result)
        if result.sigma is not None:
            self.sigma.update(result.sigma.frames)
            self.uncertain += result.sigma.uncertain_share * sum(result.sigma.frames.values())
        if result.errors is not None:
            self.errors = result.errors if self.errors is None else added(self.errors, result.errors)
        if result.error is not None:
            self.failures[result.slug] = result.error
        sums = _group_sums(result)
        _accumulate(self.floors[result.floor], sums)
        _accumulate(self.devices[result.device], sums)


def _sigma(totals: _Totals) -> SigmaStatistics | None:
    """How sure the frames of all sessions are, to the width of a bin."""
    if not totals.sigma:
        return None
    return SigmaStatistics(
        median_m=round(log_bins.quantile_m(totals.sigma, 0.5), 4),
        p95_m=round(log_bins.quantile_m(totals.sigma, 0.95), 4),
        uncertain_share=round(totals.uncertain / totals.sigma.total(), 6),
        frames=dict(sorted(totals.sigma.items())),
    )


def _group_sums(result: SessionResult) -> dict[str, float]:
    frames = sum(count for status, count in result.frames.items() if status != _DUPLICATE)
    return {
        "sessions": 1,
        "failed": int(result.error is not None),
        "duration_s": result.duration_s,
        "distance_m": result.distance_m,
        "frames": frames,
        "frames_ok": result.frames.get(_OK, 0),
    }


def _accumulate(sums: dict[str, _Number], more: Mapping[str, _Number]) -> None:
    for key, value in more.items():
        sums[key] += value


def _sorted(counts: Mapping[str, int]) -> dict[str, int]:
    return dict(sorted(counts.items()))


def _rounded(sums: Mapping[str, float]) -> dict[str, float]:
    return {key: round(value, 3) for key, value in sorted(sums.items())}
