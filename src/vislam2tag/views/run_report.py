"""The report of a run: one HTML page that needs nothing else, streamed session by session."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version as installed_version
from itertools import compress, groupby
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.palette import STATUS_STYLES, style_of
from vislam2tag.core.status import Status, labelled_share
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import LandmarkContradiction, SessionResult, Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.quality.evaluation.reliability import CoverageCurve, coverage_curve
from vislam2tag.site.model import Floor, Survey
from vislam2tag.views.floor_map import drawn_plan, floor_figure, session_part, size_m, surveyed_on
from vislam2tag.views.layers import GRID, RED, Trace, chart, figure_json, plotly_text, scatter
from vislam2tag.views.page import embedded, write_page
from vislam2tag.views.run_summary import StatusTime, accuracy_sentence, lost_times, problems, status_times
from vislam2tag.views.uncertainty import UncertaintyView, event_style

_LIBRARIES = ("numpy", "scipy", "polars", "plotly", "pillow")


def write_report(
    out_file: Path,
    survey: Survey,
    settings: ProcessSettings,
    results: Iterable[SessionResult],
    summary: Summary,
    conflicts: str = "",
) -> None:
    """Write the page ``out_file`` about a run over a survey.

    ``results`` come in the survey's order (floor by floor) and are read once, one at a time, so memory does not grow
    with their number; ``summary`` is their :func:`.summarise`; ``conflicts`` is the page beside it, if any, that shows
    how references fit one another. Equal input gives equal bytes. The page is written beside ``out_file`` and renamed
    when whole. Raises OutputError where it cannot be.
    """
    write_page(out_file, "report.html.j2", _context(survey, settings, results, summary) | {"conflicts": conflicts})


@dataclass
class _Pages:
    """Lets the sessions pass once, floor by floor, and keeps of each only its column of the overview."""

    survey: Survey
    settings: ProcessSettings
    results: Iterable[SessionResult]
    summary: Summary
    bars: list[TimeBar] = field(default_factory=list)
    floors_walked: set[int] = field(default_factory=set)
    """Floors to which walks led that lie under another one."""

    def floors(self) -> Iterator[FloorView]:
        shown = set()
        for number, results in groupby(self.results, key=lambda result: result.floor):
            shown.add(number)
            yield self._floor(number, self._views(results))
        for number in sorted(self.floors_walked - shown):
            yield self._floor(number, None)

    def _floor(self, number: int, sessions: Iterator[SessionView] | None) -> FloorView:
        site = self.survey.site
        here = tuple(found for found in self.summary.contradictions if found.floor == number)
        return FloorView(site.floor(number), site.landmarks, sessions, here)

    def _views(self, results: Iterable[SessionResult]) -> Iterator[SessionView]:
        longest_s = self.settings.findings.scan_interval_s
        for result in results:
            interval_s = result.scans.median_interval_s if result.scans else None
            view = SessionView(result, throttled=interval_s is not None and interval_s > longest_s)
            self.bars.append(view.bar)
            self.floors_walked |= result.elsewhere.keys() & {floor.number for floor in self.survey.site.floors}
            yield view

    def time_figure(self) -> Markup:
        return embedded(time_figure(self.bars))


def _context(
    survey: Survey, settings: ProcessSettings, results: Iterable[SessionResult], summary: Summary
) -> dict[str, Any]:
    pages = _Pages(survey, settings, results, summary)
    return {
        "title": survey.root.resolve().name,
        "survey": survey,
        "names": {ref.slug: str(ref.key) for ref in survey.sessions},
        "summary": summary,
        "overview": _overview(summary),
        "accuracy": accuracy_sentence(summary),
        "problems": problems(summary, survey.findings),
        "uncertainty": UncertaintyView(summary, settings.labels.max_sigma_m),
        "event_style": event_style,
        "size_m": size_m,
        "infinity": math.inf,
        "styles": STATUS_STYLES,
        "style_of": style_of,
        "floors": pages.floors(),
        "time_figure": pages.time_figure,
        "figure_of": lambda view: embedded(view.figure),
        "part": lambda view, floor=None: embedded(json.dumps(session_part(view.result, floor), separators=(",", ":"))),
        "settings": list(_flat(settings.of_labels())),
        "versions": _versions(summary),
    }


def _flat(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each setting with its dotted name."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _versions(summary: Summary) -> list[tuple[str, str]]:
    return [
        ("vislam2tag", summary.version),
        ("Python", platform.python_version()),
        *((library, installed_version(library)) for library in _LIBRARIES),
    ]


_SEVERITIES = (Severity.ERROR, Severity.WARNING, Severity.INFO)


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


def _overview(summary: Summary) -> dict[str, Any]:
    """The whole run in a few numbers: shares labelled and uncertain of the time walked, of frames and of each table."""
    times = {time.style.label: time.share for time in status_times(summary.frame_seconds)}
    tables = {table: labelled_share(counts) for table, counts in summary.readings.items()}
    wifi_first = sorted(summary.readings, key=lambda table: (table != "wifi", table))
    return {
        "labelled_time": times.get("ok"),
        "uncertain_time": times.get(Status.UNCERTAIN.label, 0.0),
        "shares": {"frames": labelled_share(summary.frames), **tables},
        "readings": {table: sum(summary.readings[table].values()) for table in wifi_first},
        "lost": lost_times(summary.frame_seconds),
        "findings": sorted(summary.findings.items(), key=lambda item: (-item[1], item[0])),
    }


_TOLERANCE_M = 1.0
"""How far outside the plan a landmark may lie without a word: sheets hang on outer walls."""


@dataclass(frozen=True)
class FloorView:
    """A floor's map and its sessions, which pass by once."""

    floor: Floor
    landmarks: Landmarks
    sessions: Iterator[SessionView] | None
    """None where no session lies under this floor, though walks led to it."""
    contradictions: tuple[LandmarkContradiction, ...] = ()
    """Landmarks of this floor that contradict the rest."""

    @property
    def title(self) -> str:
        """The floor's name where it says more than its number."""
        number = self.floor.number
        return "" if self.floor.name.casefold() in (str(number), f"floor {number}") else self.floor.name

    @property
    def figure(self) -> str:
        """The map as Plotly's JSON, without the sessions."""
        return floor_figure(self.floor, self.landmarks, self._plan[0], self.contradictions)

    @property
    def notes(self) -> list[str]:
        """Sentences on what the map lacks and on what lies beside the plan."""
        visited = "No session starts here; walks from other floors led here." if self.sessions is None else ""
        return [note for note in (visited, self._plan[1], self._outside()) if note]

    @property
    def unplaced(self) -> list[str]:
        """Landmarks of this floor that nobody surveyed."""
        here = (self.landmarks.floor == self.floor.number) & ~self.landmarks.surveyed
        return list(compress(self.landmarks.ids, here))

    @cached_property
    def _plan(self) -> tuple[str | None, str]:
        """The plan as a data URI where it can be drawn, else a sentence that says why not."""
        return drawn_plan(self.floor)

    def _outside(self) -> str:
        """Name the surveyed landmarks beside the plan; empty where there is none."""
        if self.floor.extent_m is None:
            return ""
        low, high = self.floor.corners_m
        beside = np.maximum(low - self.landmarks.position_bcs, self.landmarks.position_bcs - high)
        wanted = surveyed_on(self.floor, self.landmarks) & (beside > _TOLERANCE_M).any(axis=1)
        ids = list(compress(self.landmarks.ids, wanted))
        if not ids:
            return ""
        size = f"{self.floor.width_m:g} m x {self.floor.height_m:g} m"
        return f"Surveyed landmarks outside the plan of {size}: {', '.join(ids)}. Check their positions or its size."


@dataclass(frozen=True)
class TimeBar:
    """One session's column in the overview: what it is called, where its row is, and its seconds by status."""

    floor: str
    name: str
    anchor: str
    seconds: dict[str, float]
    failed: bool


def time_figure(bars: Sequence[TimeBar]) -> str:
    """Return, as JSON, stacked columns of minutes by status, one for each session, floor beside floor."""
    traces: list[Trace] = []
    for label, style in STATUS_STYLES.items():
        minutes = [round(bar.seconds.get(label, 0.0) / 60, 3) for bar in bars]
        if any(minutes):
            columns = _columns(bars, range(len(bars)), f"{style.name}: %{{y:.2f}} min")
            traces.append(
                {"type": "bar", "y": minutes, "name": style.name, "marker": {"color": style.colour}, **columns}
            )
    failed = [index for index, bar in enumerate(bars) if bar.failed]
    if failed:
        look: dict[str, Any] = {
            "y": [0.0] * len(failed),
            "marker": {"symbol": "x", "size": 11, "color": RED},
            "cliponaxis": False,
        }
        traces.append(scatter("markers", "failed session", **look, **_columns(bars, failed, "failed")))
    names = [plotly_text(bar.name) for bar in bars]
    x: dict[str, Any] = {"tickvals": list(range(len(bars))), "ticktext": names, "range": [-0.6, len(bars) - 0.4]}
    x |= {"tickangle": -90, "fixedrange": True, "automargin": True, "showgrid": False, "zeroline": False}
    y = {"title": "minutes", "gridcolor": GRID, "fixedrange": True, "rangemode": "tozero", "automargin": True}
    figure = chart(traces, x, y, barmode="stack", bargap=0.35, hovermode="closest", dragmode=False)
    _name_floors(figure, bars)
    return figure_json(figure)


def _columns(bars: Sequence[TimeBar], places: Sequence[int], hover: str) -> dict[str, Any]:
    """Return where a trace of the overview stands, what its hover says and which rows its columns lead to."""
    return {
        "x": list(places),
        "hovertext": [plotly_text(f"{bars[place].floor}, {bars[place].name}") for place in places],
        "hovertemplate": f"%{{hovertext}}<br>{hover}<extra></extra>",
        "customdata": [bars[place].anchor for place in places],
    }


def _name_floors(figure: go.Figure, bars: Sequence[TimeBar]) -> None:
    """Write each floor's name above its columns, and a line between floors."""
    for floor, group in groupby(enumerate(bars), key=lambda item: item[1].floor):
        places = [place for place, _ in group]
        figure.add_annotation(
            x=(places[0] + places[-1]) / 2, y=1, yref="paper", yanchor="bottom", text=floor, showarrow=False
        )
        if places[0] > 0:
            figure.add_vline(x=places[0] - 0.5, line={"color": "#8c959f", "width": 1})
