"""The page of conflicts: which references agree, which contradict, and which nothing can be compared with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.diagnosis.references import Reference, References
from vislam2tag.landmark_survey.comparison import Verdict
from vislam2tag.survey.model import Floor, Survey
from vislam2tag.views.floor_map import Columns, Trace, arrow_line, drawn_plan, plotly_text, site_figure
from vislam2tag.views.page import write_page

_RED, _GREEN, _GREY = "#b00020", "#00664a", "#6e7781"
_EDGE = {"color": "white", "width": 1}


@dataclass(frozen=True)
class FloorOfConflicts:
    """A floor's map of references."""

    floor: Floor
    figure: str
    note: str
    """Why there is no plan; empty where there is one."""
    references: tuple[Reference, ...]


def write_conflict_page(out_file: Path, survey: Survey, found: References) -> None:
    """Write the page ``out_file`` about how the references of a survey fit one another; equal input, equal bytes.

    It is written beside ``out_file`` and renamed when whole. Raises OutputError where it cannot be.
    """
    counts = Counter(one.verdict for one in found.compared)
    context = {
        "title": survey.root.resolve().name,
        "found": found,
        "agree": counts[Verdict.AGREES],
        "nothing": counts[Verdict.NOTHING],
        "floors": _floors(survey, found),
        "what": named,
    }
    write_page(out_file, "conflicts.html.j2", context)


def named(one: Reference) -> str:
    """What a reference is called."""
    if one.day is not None:
        return f"{one.landmark} as seen on {one.day}"
    return f"survey of {one.landmark}" if one.session is None else f"{one.landmark} as seen by {one.session}"


def _floors(survey: Survey, found: References) -> Iterator[FloorOfConflicts]:
    numbers = {one.floor for one in found.compared}
    for floor in survey.site.floors:
        if floor.number in numbers:
            here = found.on_floor(floor.number)
            plan, note = drawn_plan(floor)
            figure = site_figure(floor, survey.site.landmarks, plan, [], [*_landmarks(here), *_contradicting(here)])
            yield FloorOfConflicts(floor, figure, note, here)


def _landmarks(references: Sequence[Reference]) -> list[Trace]:
    """A dot on each landmark: whether anything said of it could be compared, and how many agree."""
    verdicts: dict[str, Counter[Verdict]] = {}
    place: dict[str, tuple[float, float]] = {}
    for one in references:
        verdicts.setdefault(one.landmark, Counter())[one.verdict] += 1
        place[one.landmark] = (one.x_m, one.y_m)
    compared = {name for name, count in verdicts.items() if count[Verdict.AGREES] or count[Verdict.CONTRADICTS]}
    return [
        _dots("agree", _GREEN, [name for name in place if name in compared], place, verdicts),
        _dots("nothing to compare", _GREY, [name for name in place if name not in compared], place, verdicts),
    ]


def _dots(
    label: str,
    colour: str,
    names: Sequence[str],
    place: dict[str, tuple[float, float]],
    verdicts: dict[str, Counter[Verdict]],
) -> Trace:
    """Dots (one a name) with what they stand for."""
    return {
        "type": "scatter",
        "mode": "markers",
        "name": label,
        "x": [place[name][0] for name in names],
        "y": [place[name][1] for name in names],
        "marker": {"symbol": "circle", "size": 11, "color": colour, "line": _EDGE},
        "hovertext": [plotly_text(f"landmark {name}: {_counted(verdicts[name])}") for name in names],
        "hovertemplate": "%{hovertext}<extra></extra>",
    }


def _counted(verdicts: Counter[Verdict]) -> str:
    return ", ".join(f"{verdicts[kind]} {_SAID[kind]}" for kind in Verdict if verdicts[kind])


_SAID = {Verdict.AGREES: "agree", Verdict.CONTRADICTS: "contradict", Verdict.NOTHING: "with nothing to compare"}


def _contradicting(references: Sequence[Reference]) -> list[Trace]:
    """An arrow, true to scale, from where the others have a landmark to where each that contradicts has it."""
    columns: Columns = {"x": [], "y": [], "text": [], "hovertext": []}
    for one in references:
        if one.verdict is not Verdict.CONTRADICTS or one.offset_m is None:
            continue
        line = arrow_line(complex(one.x_m, one.y_m), complex(*one.offset_m))
        columns["x"] += [*line.real.round(3).tolist(), None]
        columns["y"] += [*line.imag.round(3).tolist(), None]
        told = plotly_text(f"{named(one)}: {one.size_m:.2f} m")
        columns["text"] += ["", told, *[""] * 4]
        columns["hovertext"] += [f"{told} off, usual are {one.sigma_m:.2f} m"] * 6
    return [
        {
            "type": "scatter",
            "mode": "lines+text",
            "name": "contradicts",
            "line": {"color": _RED, "width": 2.5},
            "textfont": {"size": 12, "color": _RED},
            "textposition": "middle right",
            "hovertemplate": "%{hovertext}<extra></extra>",
            **columns,
        }
    ]
