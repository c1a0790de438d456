"""The report of a run, streamed session by session."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version as installed_version
from itertools import compress, groupby
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from vislam2tag.common.findings import Severity
from vislam2tag.common.palette import STATUS_STYLES, StatusStyle, style_of
from vislam2tag.core.status import Status, labelled_share
from vislam2tag.core.tracks import Landmarks
from vislam2tag.labeling.results import LandmarkContradiction, SessionResult, Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.quality.evaluation.reliability import coverage_curve
from vislam2tag.site.model import Floor, Survey, is_own_name
from vislam2tag.views.floor_map import drawn_plan, floor_figure, session_part, size_m, surveyed_on
from vislam2tag.views.layers import GRID, RED, Trace, chart, figure_json, plotly_text, scatter
from vislam2tag.views.page import embedded, moment, survey_title, write_page
from vislam2tag.views.run_summary import ADVICE, accuracy_sentence, lost_times, problems, status_times
from vislam2tag.views.uncertainty import event_style, uncertainty

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
    with their number. ``summary`` is their :func:`.summarise`; ``conflicts`` is the page of conflicting references in
    the same folder, if any. Equal input gives equal bytes. The page is written beside ``out_file`` and renamed when
    complete. Raises OutputError if it cannot be written.
    """
    write_page(out_file, "report.html.j2", _context(survey, settings, results, summary) | {"conflicts": conflicts})


@dataclass
class _Pages:
    """Iterates over the sessions once, floor by floor, and keeps only the overview column of each."""

    survey: Survey
    settings: ProcessSettings
    results: Iterable[SessionResult]
    summary: Summary
    bars: list[TimeBar] = field(default_factory=list)
    unplaced: list[Unplaced] = field(default_factory=list)
    floors_walked: set[int] = field(default_factory=set)
    """Floors visited by walks whose session belongs to another floor."""

    def floors(self) -> Iterator[dict[str, Any]]:
        shown = set()
        for number, results in groupby(self.results, key=lambda result: result.floor):
            shown.add(number)
            yield self._floor(number, self._views(results))
        for number in sorted(self.floors_walked - shown):
            yield self._floor(number, None)

    def _floor(self, number: int, sessions: Iterator[dict[str, Any]] | None) -> dict[str, Any]:
        site = self.survey.site
        here = [found for found in self.summary.contradictions if found.floor == number]
        return floor_view(site.floor(number), site.landmarks, sessions, here)

    def _views(self, results: Iterable[SessionResult]) -> Iterator[dict[str, Any]]:
        longest_s = self.settings.findings.scan_interval_s
        for result in results:
            interval_s = result.scans.median_interval_s if result.scans else None
            bar = TimeBar.of(result)
            self.bars.append(bar)
            if (unplaced := Unplaced.of(result, bar)) is not None:
                self.unplaced.append(unplaced)
            self.floors_walked |= result.elsewhere.keys() & {floor.number for floor in self.survey.site.floors}
            throttled = interval_s is not None and interval_s > longest_s
            yield _session_view(result, bar) | {"throttled": throttled, "unplaced": unplaced}

    def time_figure(self) -> Markup:
        return embedded(time_figure(self.bars))


def _context(
    survey: Survey, settings: ProcessSettings, results: Iterable[SessionResult], summary: Summary
) -> dict[str, Any]:
    pages = _Pages(survey, settings, results, summary)
    return {
        "title": survey_title(survey.root),
        "survey": survey,
        "names": {ref.slug: str(ref.key) for ref in survey.sessions},
        "summary": summary,
        "overview": _overview(summary),
        "accuracy": accuracy_sentence(summary),
        "problems": problems(summary, survey.findings),
        "uncertainty": uncertainty(summary, settings.labels.max_sigma_m),
        "event_style": event_style,
        "size_m": size_m,
        "infinity": math.inf,
        "styles": STATUS_STYLES,
        "style_of": style_of,
        "floors": pages.floors(),
        "time_figure": pages.time_figure,
        "unplaced": pages.unplaced,
        "figure_of": lambda view: embedded(view["figure"]),
        "part": _part,
        "settings": list(_flat(settings.of_labels())),
        "versions": _versions(summary),
    }


def _part(view: dict[str, Any], floor: int | None = None) -> Markup:
    """A session's layers on a floor for the page's map."""
    return embedded(json.dumps(session_part(view["result"], floor), separators=(",", ":")))


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


def _session_view(result: SessionResult, bar: TimeBar) -> dict[str, Any]:
    """One session as a row of its floor's table with details below; the most severe findings come first."""
    tables = {table: labelled_share(counts) for table, counts in result.readings.items()}
    lost = lost_times(result.frame_seconds)
    findings = sorted(result.findings, key=lambda finding: _SEVERITIES.index(finding.severity))
    return {
        "result": result,
        "name": bar.name,
        "anchor": bar.anchor,
        "speed_m_s": result.distance_m / result.duration_s if result.duration_s > 0 else None,
        "shares": {"frames": labelled_share(result.frames), **tables},
        "times": status_times(result.frame_seconds),
        "lost": lost,
        "lost_s": sum(time.seconds for time in lost),
        "findings": findings,
        "worst": findings[0].severity.value if findings else "",
        "accuracy": coverage_curve(result.errors) if result.errors else None,
    }


def _overview(summary: Summary) -> dict[str, Any]:
    """The run in a few numbers: shares labelled and uncertain of the walking time, of frames and of each table."""
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
"""Landmarks up to this far outside the plan are not reported, because sheets hang on outer walls."""


def floor_view(
    floor: Floor,
    landmarks: Landmarks,
    sessions: Iterator[dict[str, Any]] | None,
    contradictions: Sequence[LandmarkContradiction] = (),
) -> dict[str, Any]:
    """A floor's map and an iterator over its sessions; None if the floor has no session, only visits from other floors.

    The figure is Plotly's JSON without the sessions; notes name what is missing on the map or outside the plan.
    """
    plan, note = drawn_plan(floor)
    visited = "No session starts on this floor, but walks from other floors visit it." if sessions is None else ""
    unplaced = (landmarks.floor == floor.number) & ~landmarks.surveyed
    return {
        "floor": floor,
        "sessions": sessions,
        "title": floor.name if is_own_name(floor.name, floor.number) else "",
        "figure": floor_figure(floor, landmarks, plan, contradictions),
        "notes": [text for text in (visited, note, _outside(floor, landmarks)) if text],
        "unplaced": list(compress(landmarks.ids, unplaced)),
    }


def _outside(floor: Floor, landmarks: Landmarks) -> str:
    """Name the surveyed landmarks outside the plan; empty if there are none."""
    if floor.extent_m is None:
        return ""
    low, high = floor.corners_m
    beside = np.maximum(low - landmarks.position_bcs, landmarks.position_bcs - high)
    wanted = surveyed_on(floor, landmarks) & (beside > _TOLERANCE_M).any(axis=1)
    ids = list(compress(landmarks.ids, wanted))
    if not ids:
        return ""
    size = f"{floor.width_m:g} m x {floor.height_m:g} m"
    return f"Surveyed landmarks outside the plan of {size}: {', '.join(ids)}. Check their positions or its size."


@dataclass(frozen=True)
class TimeBar:
    """One session's column in the overview: its name, the anchor of its row, and its seconds by status."""

    floor: str
    name: str
    anchor: str
    seconds: dict[str, float]
    failed: bool

    @classmethod
    def of(cls, result: SessionResult) -> TimeBar:
        """The column of a session's result."""
        name, anchor = f"{result.device} / {result.session}", f"session-{result.slug}"
        return cls(f"floor {result.floor}", name, anchor, result.frame_seconds, failed=result.error is not None)


@dataclass(frozen=True)
class Unplaced:
    """A session of which nothing is placed on the plan by its shape: its name, its row, why, and what helps."""

    name: str
    anchor: str
    style: StatusStyle
    todo: str

    @classmethod
    def of(cls, result: SessionResult, bar: TimeBar) -> Unplaced | None:
        """What a session's result says; None if anything is placed, or it was not tried."""
        placing = result.placing
        if placing is None or not placing.refused:
            return None
        tap_s = None if result.start_ns is None else placing.best_tap_s(result.start_ns)
        tap = "" if tap_s is None else f"in the studio, tap the plan where the walk was at {moment(tap_s)}"
        return cls(bar.name, bar.anchor, style_of(placing.reason), tap or ADVICE[placing.reason])


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
    """Return the positions of a trace of the overview, its hover texts and the rows that its columns link to."""
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
