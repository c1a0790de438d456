"""The page of conflicts: which measurements of landmarks agree, contradict or cannot be compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.quality.diagnosis.record import Reference, References
from vislam2tag.site.model import Survey
from vislam2tag.views.floor_map import drawn_plan, site_figure
from vislam2tag.views.layers import GREEN, RED, Trace, arrows, plotly_text, scatter
from vislam2tag.views.page import survey_title, write_page


def write_conflict_page(out_file: Path, survey: Survey, found: References) -> None:
    """Write the page ``out_file`` about the agreement of a survey's references; equal input, equal bytes.

    It is written beside ``out_file`` and renamed when complete. Raises OutputError if it cannot be written.
    """
    counts = Counter(one.verdict for one in found.compared)
    context = {
        "title": survey_title(survey.root),
        "found": found,
        "agree": counts[Verdict.AGREES],
        "nothing": counts[Verdict.NOTHING],
        "floors": _floors(survey, found),
        "what": named,
    }
    write_page(out_file, "conflicts.html.j2", context)


def named(one: Reference) -> str:
    """The name of a reference."""
    if one.day is not None:
        return f"{one.landmark} as observed on {one.day}"
    return f"survey of {one.landmark}" if one.session is None else f"{one.landmark} as observed by {one.session}"


def _floors(survey: Survey, found: References) -> Iterator[dict[str, Any]]:
    """Each floor's map of references; ``note`` says why there is no plan, empty if there is one."""
    numbers = {one.floor for one in found.compared}
    for floor in survey.site.floors:
        if floor.number in numbers:
            here = found.on_floor(floor.number)
            plan, note = drawn_plan(floor)
            figure = site_figure(floor, survey.site.landmarks, plan, [], [*_landmarks(here), _contradicting(here)])
            yield {"floor": floor, "figure": figure, "note": note, "references": here}


def _landmarks(references: Sequence[Reference]) -> list[Trace]:
    """A dot on each landmark: whether its references could be compared, and how many agree."""
    verdicts: dict[str, Counter[Verdict]] = {}
    place: dict[str, tuple[float, float]] = {}
    for one in references:
        verdicts.setdefault(one.landmark, Counter())[one.verdict] += 1
        place[one.landmark] = (one.x_m, one.y_m)
    compared = {name for name, count in verdicts.items() if count[Verdict.AGREES] or count[Verdict.CONTRADICTS]}
    kinds = (
        ("agree", GREEN, [name for name in place if name in compared]),
        ("not compared", "#6e7781", [name for name in place if name not in compared]),
    )
    return [
        scatter(
            "markers",
            label,
            [place[name] for name in names],
            "%{hovertext}",
            marker={"symbol": "circle", "size": 11, "color": colour, "line": {"color": "white", "width": 1}},
            hovertext=[plotly_text(f"landmark {name}: {_counted(verdicts[name])}") for name in names],
        )
        for label, colour, names in kinds
    ]


def _counted(verdicts: Counter[Verdict]) -> str:
    return ", ".join(f"{verdicts[kind]} {_SAID[kind]}" for kind in Verdict if verdicts[kind])


_SAID = {Verdict.AGREES: "agree", Verdict.CONTRADICTS: "contradict", Verdict.NOTHING: "not compared"}


def _contradicting(references: Sequence[Reference]) -> Trace:
    """A true-to-scale arrow from the position according to the others to that of each contradicting reference."""
    drawn = []
    for one in references:
        if one.verdict is Verdict.CONTRADICTS and one.offset_m is not None:
            label = f"{named(one)}: {one.size_m:.2f} m"
            drawn.append(
                ((one.x_m, one.y_m), one.offset_m, f"{label} from the others (sigma {one.sigma_m:.2f} m)", label)
            )
    font = {"size": 12, "color": RED}
    return arrows("contradicts", RED, 2.5, drawn, textfont=font, textposition="middle right")
