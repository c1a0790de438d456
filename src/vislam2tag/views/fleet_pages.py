"""The report of a fleet as a tree of small pages without scripts: the fleet, each survey, each session.

Tables with more than :data:`ROWS` rows continue on further pages, and lines are thinned, so that no page grows with the
fleet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from markupsafe import Markup

from vislam2tag.common.palette import STATUS_STYLES, style_of
from vislam2tag.core.status import labelled_share
from vislam2tag.labeling.results import Drawing, Polyline, SessionResult, Summary
from vislam2tag.site.model import Survey
from vislam2tag.views.page import page_text
from vislam2tag.views.run_summary import accuracy_sentence, problems

ROWS = 1000
"""Rows of a table on one page."""
MOST_POINTS = 5000
"""Maximum number of points of a line on a floor; longer lines are thinned evenly."""
MOST_FINDINGS = 200
_WIDTH_PX = 900
_Row = Mapping[str, Any]


def fleet_pages(title: str, totals: Mapping[str, Any], rows: Sequence[_Row]) -> Iterator[tuple[str, str]]:
    """Name and text of each page about the fleet; ``rows`` are its catalogue's, ``totals`` their sums."""
    sites = _sums(rows)
    for part, name, of in _parts(rows):
        context = {"title": title, "totals": totals, "rows": part, "pages": of, "page": name, "sites": sites[:ROWS]}
        yield name, page_text("fleet.html.j2", context)


def survey_pages(survey: Survey, summary: Summary, rows: Sequence[_Row]) -> Iterator[tuple[str, str]]:
    """Name and text of each page about a survey; ``rows`` are its part of the fleet's table ``sessions``."""
    for part, name, of in _parts(rows):
        context = {
            "title": survey.root.resolve().name,
            "summary": summary,
            "share": labelled_share(summary.frames),
            "accuracy": accuracy_sentence(summary),
            "problems": problems(summary, survey.findings)[:MOST_FINDINGS],
            "rows": part,
            "pages": of,
            "page": name,
        }
        yield name, page_text("fleet_survey.html.j2", context)


def session_page(survey: Survey, result: SessionResult) -> str:
    """Text of the page about a session."""
    walked = {result.floor: result.drawing, **result.elsewhere}
    names = {floor.number: floor.name for floor in survey.site.floors}
    context = {
        "title": f"{result.device} {result.session}",
        "survey": survey.root.resolve().name,
        "floor": names.get(result.floor, f"Floor {result.floor}"),
        "result": result,
        "share": labelled_share(result.frames),
        "maps": [(names.get(number, f"Floor {number}"), _map(each)) for number, each in sorted(walked.items())],
        "styles": STATUS_STYLES,
        "style_of": style_of,
        "findings": result.findings[:MOST_FINDINGS],
        "more": len(result.findings) - MOST_FINDINGS,
    }
    return page_text("fleet_session.html.j2", context)


def _parts(rows: Sequence[_Row]) -> Iterator[tuple[Sequence[_Row], str, list[str]]]:
    """Rows of each page, its name and those of all."""
    count = max(1, -(-len(rows) // ROWS))
    names = ["index.html", *(f"index_{number}.html" for number in range(2, count + 1))]
    for number, name in enumerate(names):
        yield rows[number * ROWS : (number + 1) * ROWS], name, names


def _sums(rows: Sequence[_Row]) -> list[dict[str, Any]]:
    """Each site's number of surveys and their totals; the site with the most sessions first."""
    sites: dict[str, dict[str, Any]] = {}
    for row in rows:
        nothing = {"site": row["site"], "surveys": 0, "sessions": 0, "failed": 0, "distance_m": 0.0}
        site = sites.setdefault(row["site"], nothing)
        site["surveys"] += 1
        for name in ("sessions", "failed", "distance_m"):
            site[name] += row[name]
    return sorted(sites.values(), key=lambda site: (-site["sessions"], site["site"]))


def _map(drawing: Drawing) -> Markup | None:
    """A floor's walk as SVG, y up; None without positions."""
    lines = [(stretch.status, stretch.points) for stretch in (*drawing.discarded, *drawing.mapped) if stretch.points]
    points = [point for _, line in lines for point in line]
    if not points:
        return None
    every = -(-len(points) // MOST_POINTS)
    left, low = (min(point[axis] for point in points) for axis in (0, 1))
    right, high = (max(point[axis] for point in points) for axis in (0, 1))
    margin = 0.03 * max(right - left, high - low, 1.0)
    box = (left - margin, -high - margin, right - left + 2 * margin, high - low + 2 * margin)
    drawn = Markup("").join(
        Markup('<polyline points="{}" stroke="{}"/>').format(_points(line[::every]), style_of(status).colour)
        for status, line in lines
    )
    frame = Markup('<svg class="drawing" role="img" aria-label="The walk" viewBox="{}" width="{}" fill="none" {}>')
    stroke = Markup('stroke-width="1.5"')
    head = frame.format(" ".join(f"{each:.2f}" for each in box), _WIDTH_PX, stroke)
    style = Markup("<style>.drawing polyline { vector-effect: non-scaling-stroke; }</style>")
    return head + style + drawn + Markup("</svg>")


def _points(line: Polyline) -> str:
    return " ".join(f"{x:.2f},{-y:.2f}" for x, y in line)
