"""A run in a few numbers and sentences: totals, expected errors, and problems with remedies."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from vislam2tag.common import error_statistics
from vislam2tag.common.findings import Finding, Severity, counted
from vislam2tag.common.palette import STATUS_STYLES, StatusStyle
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.labeling.results import (
    ContradictionMark,
    ErrorRecord,
    LandmarkContradiction,
    SessionResult,
    SigmaStatistics,
    Summary,
)
from vislam2tag.quality.evaluation.reliability import added, coverage_curve
from vislam2tag.views.page import count, duration, percent

_Key = tuple[int, str]
"""Floor and landmark."""


@dataclass
class LandmarkTally:
    """Counts sessions by landmark; its size depends only on the number of landmarks."""

    _seen: Counter[_Key] = field(default_factory=Counter)
    _found: dict[_Key, LandmarkContradiction] = field(default_factory=dict)

    def add(self, result: SessionResult) -> None:
        """Add one session's contradictions."""
        said = {mark.landmark: mark for mark in result.contradictions}
        for landmark in result.landmarks_logged:
            floor = said[landmark].floor if landmark in said else result.floor
            self._seen[floor, landmark] += 1
        for mark in said.values():
            self._found[mark.floor, mark.landmark] = _joined(self._found.get((mark.floor, mark.landmark)), mark)

    def all(self) -> list[LandmarkContradiction]:
        """Return all contradictions, those found in most sessions first, then the largest."""
        complete = [found.model_copy(update={"seen": self._seen[key]}) for key, found in sorted(self._found.items())]
        return sorted(complete, key=lambda found: (-found.sessions, -found.greatest_m))


def _joined(before: LandmarkContradiction | None, mark: ContradictionMark) -> LandmarkContradiction:
    """Add one more session to the mean offset."""
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


_OK = Status.OK.label
_DUPLICATE = Status.DUPLICATE.label


def summarise(
    results: Iterable[SessionResult], strategy: str, version: str, site_findings: Iterable[Finding] = ()
) -> Summary:
    """Add up the results of a run's sessions; takes them one at a time, so memory does not grow with the survey.

    ``per_floor`` and ``per_device`` contain, for each floor number or device name, ``sessions``, ``failed``,
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
        unplaced=totals.unplaced,
        duration_s=round(totals.duration_s, 3),
        distance_m=round(totals.distance_m, 3),
        frames=_sorted(totals.frames),
        frame_seconds=_rounded(totals.frame_seconds),
        readings={table: _sorted(counts) for table, counts in sorted(totals.readings.items())},
        findings=_sorted(totals.findings),
        site_findings=findings_by_kind(site_findings),
        failures=totals.failures,
        lost=totals.lost,
        events=_sorted(totals.events),
        contradictions=totals.contradictions.all(),
        sigma=_sigma(totals),
        errors=totals.errors,
        per_floor={str(floor): _rounded(sums) for floor, sums in sorted(totals.floors.items())},
        per_device={device: _rounded(sums) for device, sums in sorted(totals.devices.items())},
    )


def findings_by_kind(findings: Iterable[Finding]) -> dict[str, int]:
    """Count findings by kind, sorted."""
    counts = Counter[str]()
    for finding in findings:
        counts[finding.kind] += finding.count
    return _sorted(counts)


def _floats() -> dict[str, float]:
    return defaultdict(float)


_LOST_BY = frozenset({"clock_mismatch", "unread_file", "implausible_poses", "pose_convention"})
"""Findings by which readings or positions may be lost while all else is sound."""


@dataclass
class _Totals:
    """Running sums over the sessions added so far."""

    sessions: int = 0
    unplaced: int = 0
    duration_s: float = 0.0
    distance_m: float = 0.0
    frames: Counter[str] = field(default_factory=Counter)
    frame_seconds: dict[str, float] = field(default_factory=_floats)
    readings: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    findings: Counter[str] = field(default_factory=Counter)
    failures: dict[str, str] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    events: Counter[str] = field(default_factory=Counter)
    contradictions: LandmarkTally = field(default_factory=LandmarkTally)
    sigma: Counter[int] = field(default_factory=Counter)
    """Frames by the bin of their sigma."""
    uncertain: float = 0.0
    errors: ErrorRecord | None = None
    floors: dict[int, dict[str, float]] = field(default_factory=lambda: defaultdict(_floats))
    devices: dict[str, dict[str, float]] = field(default_factory=lambda: defaultdict(_floats))

    def add(self, result: SessionResult) -> None:
        self.sessions += 1
        self.unplaced += result.unplaced
        self.duration_s += result.duration_s
        self.distance_m += result.distance_m
        self.frames.update(result.frames)
        _accumulate(self.frame_seconds, result.frame_seconds)
        for table, counts in result.readings.items():
            self.readings[table].update(counts)
        self.findings.update(findings_by_kind(result.findings))
        lost = (each for each in result.findings if each.kind in _LOST_BY and each.severity is not Severity.INFO)
        self.lost = [*self.lost, *(f"{result.slug}: {each.file}: {each.message}" for each in lost)][:MOST_FINDINGS]
        self.events.update(event.kind.value for event in result.events)
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
    """Sigma of the frames of all sessions, to the width of a bin."""
    if not totals.sigma:
        return None
    return SigmaStatistics(
        median_m=round(error_statistics.quantile_m(totals.sigma, 0.5), 4),
        p95_m=round(error_statistics.quantile_m(totals.sigma, 0.95), 4),
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


def _accumulate(sums: dict[str, float], more: Mapping[str, float]) -> None:
    for key, value in more.items():
        sums[key] += value


def _sorted(counts: Mapping[str, int]) -> dict[str, int]:
    return dict(sorted(counts.items()))


def _rounded(sums: Mapping[str, float]) -> dict[str, float]:
    return {key: round(value, 3) for key, value in sorted(sums.items())}


MOST_FINDINGS = 5
"""Maximum number of findings at the top of the page, or printed; all follow further down."""
STEP_M = 1e-4
"""Resolution of the quantile of expected errors."""
ADVICE: Mapping[str, str] = MappingProxyType(
    {
        Status.BEFORE_FIRST_LANDMARK.label: "start walks at a landmark",
        Status.AFTER_LAST_LANDMARK.label: "end walks at a landmark",
        Status.TRACKING_LOST.label: "walk there again from landmark to landmark, with good light and visible structure",
        Status.BREAK.label: "walk there again from landmark to landmark",
        Status.NO_MAPPING.label: "pass at least two landmarks on each walk",
        Status.AMBIGUOUS.label: "tap one known place on the plan, or walk longer through rooms and corridors",
        Status.FITS_NOWHERE.label: "check the plan, its scale and the floor of the session",
        Status.FITS_MIRROR.label: "tap a known place, or walk longer; check whether the plan is mirrored",
        Status.FITS_OTHER_FLOOR.label: "check the floor of the session, or tap a known place on it",
        Status.TOO_SHORT.label: "walk two minutes or longer, or tap known places",
        Status.PLAN_TOO_OPEN.label: "use landmarks in halls",
    }
)
"""Remedies for causes that a walker can avoid."""
_ELSE = "see the session's details"
MAPPED_TOGETHER = ("smoother", "floor-plan")
_BY_PLAN = (Status.AMBIGUOUS, Status.TOO_SHORT, Status.FITS_MIRROR, Status.FITS_OTHER_FLOOR)
"""Statuses of frames that a plan may place."""
OTHERS_HELP = (Status.UNCERTAIN, Status.NO_MAPPING, *_BY_PLAN)
"""Statuses of frames that other walks of the floor may make certain."""
MUCH = 0.1
"""Suggest joint processing from this share of uncertain frames."""
TOGETHER = "process the walks jointly (process --together)"


@dataclass(frozen=True)
class Problem:
    """A problem, its remedy, and an anchor of the page with details (may be empty)."""

    what: str
    todo: str
    anchor: str = ""


def expected_error(sigma: SigmaStatistics) -> tuple[float, float]:
    """Mean and 95 % quantile, metres, of errors drawn from circular normal distributions with the counted sigmas."""
    share, sigma_m = _shares(sigma)
    within = lambda steps: float((share * np.exp(-((steps * STEP_M) ** 2) / (2 * sigma_m**2))).sum()) <= 0.05
    p95_m = STEP_M * bisect_left(range(int(10 * sigma_m.max() / STEP_M)), True, key=within)
    return expected_mean_error(sigma), p95_m


def expected_mean_error(sigma: SigmaStatistics) -> float:
    """Only the mean of them, metres."""
    share, sigma_m = _shares(sigma)
    return float(np.sqrt(np.pi / 2) * (share * sigma_m).sum())


def _shares(sigma: SigmaStatistics) -> tuple[FloatArray, FloatArray]:
    """The share of the frames in each bin, and its middle sigma, metres."""
    bins = np.array(sorted(sigma.frames)).tolist()
    frames = np.array([sigma.frames[index] for index in bins], dtype=np.float64)
    return frames / frames.sum(), np.array([error_statistics.lower_edge_m(index + 0.5) for index in bins])


def counted_sessions(summary: Summary) -> str:
    """The sessions, and how many of them failed or have no position."""
    unplaced = f", {summary.unplaced} without a position" if summary.unplaced else ""
    return f"{counted(summary.sessions, 'session')} ({summary.failed} failed{unplaced})"


def accuracy_sentence(summary: Summary) -> str:
    """Position errors as expected and, with ground truth, as measured; empty if neither is known."""
    sentences = []
    if summary.sigma is not None and summary.sigma.frames:
        mean_m, p95_m = expected_error(summary.sigma)
        sentences.append(
            f"the expected mean position error is {mean_m:.2f} m, and 95 % of the errors are below "
            f"{p95_m:.2f} m" + (" if the surveyed landmark positions are correct" * bool(summary.contradictions))
        )
    curve = coverage_curve(summary.errors) if summary.errors is not None else None
    if curve is not None and summary.errors is not None:
        points = f"{count(summary.errors.points)} points with a known true position"
        sentences.append(f"at {points} the mean error is {curve.mean_m[-1]:.2f} m")
    text = "; ".join(sentences)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def problems(summary: Summary, findings: Sequence[Finding]) -> list[Problem]:
    """Problems of a run and of its site (``findings``), the most severe first, each with a remedy."""
    return [*_failures(summary), *_about_site(findings), *_contradicted(summary.contradictions), *_lost(summary)]


def _failures(summary: Summary) -> Iterator[Problem]:
    if summary.failed:
        what = f"{summary.failed} of {summary.sessions} sessions could not be read or mapped"
        yield Problem(what, "read the reasons and correct the files that they name", "failures")


def _about_site(findings: Sequence[Finding]) -> Iterator[Problem]:
    grave = [one for one in findings if one.severity is not Severity.INFO]
    for one in sorted(grave, key=lambda one: one.severity is not Severity.ERROR)[:MOST_FINDINGS]:
        what, _, todo = one.message.rpartition("; ")
        yield Problem(
            f"{one.file}: {what or todo}" if one.file else what or todo, todo if what else "", "site-findings"
        )
    if len(grave) > MOST_FINDINGS:
        yield Problem(
            f"{len(grave) - MOST_FINDINGS} more findings about the site", "see the full list", "site-findings"
        )


def _contradicted(found: Sequence[LandmarkContradiction]) -> Iterator[Problem]:
    for one in found:
        away_m = float(np.hypot(*one.offset_m))
        what = (
            f"{one.called}: {one.sessions} of {one.seen} sessions observe it {away_m:.2f} m from its surveyed position"
        )
        yield Problem(what, "measure it again, or enter its actual position in corrections.toml", "contradictions")


def _lost(summary: Summary) -> Iterator[Problem]:
    for time in lost_times(summary.frame_seconds):
        what = f"{duration(time.seconds)} ({percent(time.share)} of the time) without a position: {time.style.name}"
        todo = ADVICE.get(time.style.label, _ELSE)
        unmapped = time.style.label == Status.NO_MAPPING.label and may_join(summary)
        yield Problem(what, f"{TOGETHER}, or {todo}" if unmapped else todo, "details")
    if summary.sigma is not None and summary.sigma.uncertain_share > 0:
        share = percent(summary.sigma.uncertain_share)
        what = f"{share} of the positions are uncertain (wide band on the map)"
        more = "add a landmark nearby (vislam2tag check shows where it helps most)"
        yield Problem(what, f"{TOGETHER}, or {more}" if may_join(summary) else more, "uncertainty")


def may_join(summary: Summary) -> bool:
    """Whether walks were processed separately, but could constrain one another.

    They need a walk with a position, or one that a plan may place.
    """
    joined = "told_by_others" in summary.findings or "one_place_helps" in summary.site_findings
    placeable = summary.frames_placed or any(summary.frames.get(status.label) for status in _BY_PLAN)
    return summary.strategy in MAPPED_TOGETHER and summary.sessions > 1 and not joined and bool(placeable)


def joining_helps(summary: Summary) -> bool:
    """Whether so many frames are uncertain or not mapped that joint processing is worth trying."""
    unsure = sum(summary.frames.get(status.label, 0) for status in OTHERS_HELP)
    return may_join(summary) and unsure > MUCH * sum(summary.frames.values())


_NOT_LOST = (Status.OK.label, Status.UNCERTAIN.label, Status.DUPLICATE.label)


@dataclass(frozen=True)
class StatusTime:
    """Seconds of a walk, or of all, with one status; ``share`` of its whole time, 0 to 1."""

    style: StatusStyle
    seconds: float
    share: float


def status_times(seconds: dict[str, float]) -> list[StatusTime]:
    """Return the time spent in each status, in the palette's order, without statuses that do not occur."""
    total = sum(seconds.values())
    return [
        StatusTime(style, seconds[label], seconds[label] / total)
        for label, style in STATUS_STYLES.items()
        if seconds.get(label, 0.0) > 0
    ]


def lost_times(seconds: dict[str, float]) -> list[StatusTime]:
    """Return the time without a position by cause, the longest first."""
    lost = [time for time in status_times(seconds) if time.style.label not in _NOT_LOST]
    return sorted(lost, key=lambda time: -time.seconds)
