"""Surveys of version 0.2, which did not say which landmarks were only planned: positions that look untouched."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.findings import Finding
from vislam2tag.survey.landmark_states import (
    PLANNED_HEADING_SIGMA_RAD,
    PLANNED_SIGMA_M,
    SAME_M,
    STATES_FILE,
    names_shown,
)
from vislam2tag.survey.names import landmark_id
from vislam2tag.survey.site_table import SiteTable, number_or_none

PLAN_FILE = "plan.json"
"""What ``vislam2tag plan`` keeps of a plan, in its output folder."""

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
    """Report rows of a floor's landmark table that are as a plan left them, but for those whose state is ``known``."""
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
        return abs(complex(x, y) - proposed) < SAME_M
    by_plan = sigma == PLANNED_SIGMA_M and heading_sigma == PLANNED_HEADING_SIGMA_RAD
    return by_plan and width is not None and bool(table.cell(fields, "sheet"))
