"""The report's first screen: how good the labels are to be expected, what is wrong, and what to do about it."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from vislam2tag.common import log_bins
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.status import Status
from vislam2tag.evaluation.reliability import coverage_curve
from vislam2tag.labeling.results import LandmarkContradiction, SigmaStatistics, Summary
from vislam2tag.views.run_page.views import lost_times
from vislam2tag.views.wording import count, duration, percent

MOST_FINDINGS = 5
"""Findings about the site named on the first screen; all stand further down."""
STEP_M = 1e-4
"""To this the quantile of expected errors is found."""
ADVICE: Mapping[str, str] = MappingProxyType(
    {
        Status.BEFORE_FIRST_LANDMARK.label: "begin walks at a landmark",
        Status.AFTER_LAST_LANDMARK.label: "end walks at a landmark",
        Status.TRACKING_LOST.label: "walk there again, in light and past something to see, from landmark to landmark",
        Status.BREAK.label: "walk there again from landmark to landmark",
        Status.NO_MAPPING.label: "pass at least two landmarks on each walk",
    }
)
"""What to do about the causes that a walker can avoid."""
_ELSE = "see the session's details"
MUCH = 0.1
"""From this share of unsure frames on walks should be mapped together."""
TOGETHER = "let the walks tell one another where they were: process --together"


@dataclass(frozen=True)
class ExpectedError:
    """What the stated sigmas say of the errors of all positions, metres; ``p95_m``: 95 % are smaller."""

    mean_m: float
    p95_m: float


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, what to do about it, and an anchor of the page that tells more (may be empty)."""

    what: str
    todo: str
    anchor: str = ""


def expected_error(sigma: SigmaStatistics) -> ExpectedError:
    """Mean and quantile of errors drawn from circular normal distributions with the sigmas that were counted."""
    bins = np.array(sorted(sigma.frames))
    frames = np.array([sigma.frames[index] for index in bins.tolist()], dtype=np.float64)
    sigma_m = np.array([log_bins.lower_edge_m(index + 0.5) for index in bins.tolist()])
    share = frames / frames.sum()
    mean_m = float(np.sqrt(np.pi / 2) * (share * sigma_m).sum())
    within = lambda steps: float((share * np.exp(-((steps * STEP_M) ** 2) / (2 * sigma_m**2))).sum()) <= 0.05
    return ExpectedError(mean_m, STEP_M * bisect_left(range(int(10 * sigma_m.max() / STEP_M)), True, key=within))


def accuracy_sentence(summary: Summary) -> str:
    """How far positions are off: as expected and, where a truth is known, as measured; empty where nothing tells."""
    sentences = []
    if summary.sigma is not None and summary.sigma.frames:
        expected = expected_error(summary.sigma)
        sentences.append(
            f"Positions are expected to be {expected.mean_m:.2f} m off on average, 95 % of them less than "
            f"{expected.p95_m:.2f} m" + (", if landmarks hang where the survey has them" * bool(summary.contradictions))
        )
    curve = coverage_curve(summary.errors) if summary.errors is not None else None
    if curve is not None and summary.errors is not None:
        points = f"{count(summary.errors.points)} points whose true place is known"
        sentences.append(f"at {points} they are {curve.mean_m[-1]:.2f} m off on average")
    text = "; ".join(sentences)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def problems(summary: Summary, findings: Sequence[Finding]) -> list[Problem]:
    """What is wrong with a run and with its site (``findings``), the gravest first, each with what to do."""
    return [*_failures(summary), *_about_site(findings), *_contradictions(summary.contradictions), *_lost(summary)]


def _failures(summary: Summary) -> Iterator[Problem]:
    if summary.failed:
        what = f"{summary.failed} of {summary.sessions} sessions could not be read or mapped"
        yield Problem(what, "read why, and correct the file that is named", "failures")


def _about_site(findings: Sequence[Finding]) -> Iterator[Problem]:
    grave = [one for one in findings if one.severity is not Severity.INFO]
    for one in sorted(grave, key=lambda one: one.severity is not Severity.ERROR)[:MOST_FINDINGS]:
        what, _, todo = one.message.rpartition("; ")
        yield Problem(
            f"{one.file}: {what or todo}" if one.file else what or todo, todo if what else "", "site-findings"
        )
    if len(grave) > MOST_FINDINGS:
        yield Problem(f"{len(grave) - MOST_FINDINGS} more findings about the site", "read them", "site-findings")


def _contradictions(found: Sequence[LandmarkContradiction]) -> Iterator[Problem]:
    for one in found:
        away_m = float(np.hypot(*one.offset_m))
        what = f"{one.called}: {one.sessions} of {one.seen} sessions put it {away_m:.2f} m from where the survey has it"
        yield Problem(what, "measure it again, or say in corrections.toml where it hung", "contradictions")


def _lost(summary: Summary) -> Iterator[Problem]:
    for time in lost_times(summary.frame_seconds):
        what = f"{duration(time.seconds)} ({percent(time.share)} of the time) without a position: {time.style.name}"
        todo = ADVICE.get(time.style.label, _ELSE)
        unmapped = time.style.label == Status.NO_MAPPING.label and may_join(summary)
        yield Problem(what, f"{TOGETHER}; or {todo}" if unmapped else todo, "details")
    if summary.sigma is not None and summary.sigma.uncertain_share > 0:
        share = percent(summary.sigma.uncertain_share)
        what = f"{share} of the positions are uncertain: the band on the map is wide there"
        more = "one more landmark near; vislam2tag check tells where it helps most"
        yield Problem(what, f"{TOGETHER}; or {more}" if may_join(summary) else more, "uncertainty")


def may_join(summary: Summary) -> bool:
    """Whether walks were mapped each alone that could tell one another something."""
    return summary.strategy == "smoother" and summary.sessions > 1 and "told_by_others" not in summary.findings


def joining_helps(summary: Summary) -> bool:
    """Whether so much is unsure or not mapped of walks mapped each alone that telling one another is worth a try."""
    unsure = sum(summary.frames.get(status.label, 0) for status in (Status.UNCERTAIN, Status.NO_MAPPING))
    return may_join(summary) and unsure > MUCH * sum(summary.frames.values())
