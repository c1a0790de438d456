"""Positions of landmark tables that a plan seems to have written, although no state says so."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.findings import Finding
from vislam2tag.site.landmark_states import (
    EXACT_M,
    PLANNED_HEADING_SIGMA_RAD,
    PLANNED_SIGMA_M,
    SAME_M,
    STATES_FILE,
    LandmarkState,
    StateRow,
    names_shown,
)
from vislam2tag.site.names import landmark_id
from vislam2tag.site.site_table import SiteTable, number_or_none
from vislam2tag.site.surveyed_landmark import SurveyedLandmark

PLAN_FILE = "plan.json"
"""What ``vislam2tag plan`` keeps of a plan, in its output folder."""

States = Mapping[tuple[int, str], StateRow]
"""States of landmarks by floor and id."""
Proposals = Mapping[tuple[int, str], complex]
"""Places that a plan proposes by floor and id, complex metres."""


def proposals_in(root: Path) -> Proposals:
    """What plans propose whose output folder lies in a survey; none where there is no plan that can be read."""
    found: dict[tuple[int, str], complex] = {}
    for path in sorted((*root.glob(PLAN_FILE), *root.glob(f"*/{PLAN_FILE}"))):
        try:
            for floor in read_json(path)["floors"]:
                for one in floor["landmarks"]:
                    found[int(one["floor"]), str(one["id"])] = complex(one["x_m"], one["y_m"])
        except (OSError, ValueError, KeyError, TypeError):
            continue  # something else of that name
    return found


def perhaps_planned(table: SiteTable, floor: int, known: Collection[str], proposals: Proposals) -> list[Finding]:
    """Report rows of a floor's landmark table that are as a plan left them, except those whose state is ``known``."""
    names, lines = [], []
    for line, fields in table.rows:
        name = landmark_id(fields[0])
        if name not in known and _is_untouched(table, fields, proposals.get((floor, name))):
            names.append(name)
            lines.append(line)
    if not names:
        return []
    message = (
        f"landmarks {names_shown(names)} are where vislam2tag plan proposed them, with the sigmas of a plan; they are "
        "used as measured positions. If they are not measured yet, do so (vislam2tag register); if someone has, write "
        f"the true sigma_m into these rows, and the state measured into {STATES_FILE} beside the file"
    )
    return [Finding.at_lines("perhaps_planned", table.file, lines, message)]


def nearly_planned(file: str, landmarks: Sequence[SurveyedLandmark], states: States) -> list[Finding]:
    """Report landmarks of a file whose positions are so close to planned ones that they may be rounded, not measured.

    A sigma that is not a plan's shows that someone measured them.
    """
    near = [
        one
        for one in landmarks
        if not one.planned
        and _has_no_sigma_of_its_own(one)
        and (state := states.get((one.floor, one.landmark))) is not None
        and state.nearly_plans(one.x_m, one.y_m)
    ]
    if not near:
        return []
    message = (
        f"landmarks {names_shown([one.landmark for one in near])} are 1 to 10 cm from where vislam2tag plan proposed "
        "them, without a sigma_m of their own: measured, or rounded? They are used as measured positions. If they are "
        "not measured yet, do so (vislam2tag register); if they are, write their sigma_m into these rows"
    )
    return [Finding.at_lines("perhaps_planned", file, [one.line for one in near], message)]


def copies_of_plan(
    landmarks: Sequence[SurveyedLandmark], states: States, proposals: Proposals
) -> list[SurveyedLandmark]:
    """Landmarks of a file from elsewhere, those marked as planned that repeat planned positions of the survey.

    Such a file has no states. A row with a sigma that is not a plan's is measured, unless it has the very place.
    """
    return [replace(one, planned=_is_copy(one, states, proposals)) for one in landmarks]


def _is_copy(one: SurveyedLandmark, states: States, proposals: Proposals) -> bool:
    key = (one.floor, one.landmark)
    rows = [states[key]] if key in states else []
    if any(row.state is LandmarkState.MEASURED and row.is_about(one.x_m, one.y_m) for row in rows):
        return False
    if key in proposals:
        place = proposals[key]
        rows.append(StateRow(one.landmark, LandmarkState.PLANNED, "plan", place.real, place.imag))
    within_m = SAME_M if _has_no_sigma_of_its_own(one) else EXACT_M
    return any(row.plans(one.x_m, one.y_m, within_m) for row in rows)


def _has_no_sigma_of_its_own(one: SurveyedLandmark) -> bool:
    return not one.sigma_given or one.sigma_m == PLANNED_SIGMA_M


def _is_untouched(table: SiteTable, fields: tuple[str, ...], proposed: complex | None) -> bool:
    """Whether a row has the place that a plan at hand proposed, or, without such a plan, all that a plan writes."""
    try:
        x, y, sigma, heading_sigma, width = (
            number_or_none(table.cell(fields, column))
            for column in ("x", "y", "sigma_m", "heading_sigma_rad", "width_m")
        )
    except ValueError:
        return False
    if x is None or y is None:
        return False
    if proposed is not None:
        return abs(complex(x, y) - proposed) < (SAME_M if sigma == PLANNED_SIGMA_M else EXACT_M)
    by_plan = sigma == PLANNED_SIGMA_M and heading_sigma == PLANNED_HEADING_SIGMA_RAD
    return by_plan and width is not None and bool(table.cell(fields, "sheet"))
