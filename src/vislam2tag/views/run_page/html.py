"""Writes the report: one HTML page that needs nothing else, streamed session by session."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import version as installed_version
from itertools import groupby
from pathlib import Path
from typing import Any

from markupsafe import Markup

from vislam2tag.common.palette import STATUS_STYLES, style_of
from vislam2tag.labeling.results import SessionResult, Summary
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.survey.model import Survey
from vislam2tag.views.floor_map.arrows import size_m
from vislam2tag.views.floor_map.figures import TimeBar, time_figure
from vislam2tag.views.floor_map.layers import session_part
from vislam2tag.views.page import embedded, write_page
from vislam2tag.views.run_page.floor_view import FloorView
from vislam2tag.views.run_page.uncertainty_view import UncertaintyView, event_style
from vislam2tag.views.run_page.verdict import accuracy_sentence, problems
from vislam2tag.views.run_page.views import Overview, SessionView

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
        "overview": Overview(summary),
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
