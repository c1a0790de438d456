"""What the page shows of each session and of the whole run, derived from their results."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.palette import STATUS_STYLES, StatusStyle
from vislam2tag.core.status import Status, labelled_share
from vislam2tag.evaluation.reliability import CoverageCurve, coverage_curve
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.views.floor_map.figures import TimeBar

_NOT_LOST = (Status.OK.label, Status.UNCERTAIN.label, Status.DUPLICATE.label)
_SEVERITIES = (Severity.ERROR, Severity.WARNING, Severity.INFO)


@dataclass(frozen=True)
class StatusTime:
    """Seconds of a walk, or of all, with one status; ``share`` of its whole time, 0 to 1."""

    style: StatusStyle
    seconds: float
    share: float


@dataclass(frozen=True)
class SessionView:
    """One session as a row of its floor's table with details below."""

    result: SessionResult
    throttled: bool
    """The median scan interval is above the setting's."""

    @property
    def name(self) -> str:
        """Device and folder name."""
        return f"{self.result.device} / {self.result.session}"

    @property
    def anchor(self) -> str:
        """Id of the row in the page."""
        return f"session-{self.result.slug}"

    @property
    def speed_m_s(self) -> float | None:
        """Mean speed over the whole session, m/s; None for an empty one."""
        return self.result.distance_m / self.result.duration_s if self.result.duration_s > 0 else None

    @cached_property
    def shares(self) -> dict[str, float | None]:
        """Share labelled of the frames and of each table, 0 to 1; None where it has no rows."""
        tables = {table: labelled_share(counts) for table, counts in self.result.readings.items()}
        return {"frames": labelled_share(self.result.frames), **tables}

    @cached_property
    def times(self) -> list[StatusTime]:
        """Time by status, labelled first."""
        return status_times(self.result.frame_seconds)

    @cached_property
    def lost(self) -> list[StatusTime]:
        """Time without a position, the longest first."""
        return lost_times(self.result.frame_seconds)

    @property
    def lost_s(self) -> float:
        """Seconds without a position."""
        return sum(time.seconds for time in self.lost)

    @cached_property
    def findings(self) -> list[Finding]:
        """Findings, the gravest first."""
        return sorted(self.result.findings, key=lambda finding: _SEVERITIES.index(finding.severity))

    @property
    def worst(self) -> str:
        """Severity of the gravest finding; empty where there is none."""
        return self.findings[0].severity.value if self.findings else ""

    @cached_property
    def accuracy(self) -> CoverageCurve | None:
        """Errors at the true points, all labels last; None where no truth is known or nothing is labelled."""
        return coverage_curve(self.result.errors) if self.result.errors else None

    @property
    def bar(self) -> TimeBar:
        """The session's column in the overview."""
        return TimeBar(
            floor=f"floor {self.result.floor}",
            name=self.name,
            anchor=self.anchor,
            seconds=self.result.frame_seconds,
            failed=self.result.error is not None,
        )


@dataclass(frozen=True)
class Overview:
    """The whole run in a few numbers."""

    summary: Summary

    @property
    def labelled_time(self) -> float | None:
        """Share of the walked time with a label, 0 to 1; None where nothing was walked."""
        return next((time.share for time in status_times(self.summary.frame_seconds) if time.style.label == "ok"), None)

    @property
    def uncertain_time(self) -> float:
        """Share of the walked time with an uncertain position, 0 to 1."""
        shares = {time.style.label: time.share for time in status_times(self.summary.frame_seconds)}
        return shares.get(Status.UNCERTAIN.label, 0.0)

    @property
    def shares(self) -> dict[str, float | None]:
        """Share labelled of the frames and of each table, 0 to 1."""
        tables = {table: labelled_share(counts) for table, counts in self.summary.readings.items()}
        return {"frames": labelled_share(self.summary.frames), **tables}

    @property
    def readings(self) -> dict[str, int]:
        """Number of rows of each table, Wi-Fi first."""
        tables = sorted(self.summary.readings, key=lambda table: (table != "wifi", table))
        return {table: sum(self.summary.readings[table].values()) for table in tables}

    @property
    def lost(self) -> list[StatusTime]:
        """Time without a position over all sessions, the longest first."""
        return lost_times(self.summary.frame_seconds)

    @property
    def findings(self) -> list[tuple[str, int]]:
        """Kinds of findings with their counts, the most frequent first."""
        return sorted(self.summary.findings.items(), key=lambda item: (-item[1], item[0]))


def status_times(seconds: dict[str, float]) -> list[StatusTime]:
    """Return the time spent in each status, in the palette's order; statuses without time are left out."""
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
