"""Sheets that a landmark table has twice: planned under one id, and measured under another."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.intake.ids import NamedIds, compare_ids
from vislam2tag.site.landmark_states import names_shown
from vislam2tag.site.surveyed_landmark import SurveyedLandmark

CLOSE_M = 5.0
"""A sheet hangs within a few metres of its planned place; other sheets of the floor are farther away, most of them."""
_DIGITS = re.compile(r"\d+")


def planned_twice(file: str, landmarks: Sequence[SurveyedLandmark]) -> list[Finding]:
    """Report measured landmarks of a floor that are named like planned ones, by a pattern, and hang where these are."""
    planned = {one.landmark: one for one in landmarks if one.planned}
    series: dict[str, dict[str, SurveyedLandmark]] = defaultdict(dict)
    for one in landmarks:
        if not one.planned and one.is_surveyed:
            series[_DIGITS.sub("#", one.landmark)][one.landmark] = one
    line = {one.landmark: one.line for one in landmarks}
    pairs: dict[str, str] = {}
    for measured in series.values():
        found = compare_ids(NamedIds("planned", tuple(planned)), NamedIds("measured", tuple(measured)))
        if found.pattern is not None and _are_close(found.pattern.mapping, measured, planned):
            pairs |= found.pattern.mapping
    if not pairs:
        return []
    message = (
        f"landmarks {names_shown(list(pairs))} are measured where landmarks {names_shown(list(pairs.values()))} are "
        "planned, and have similar names: the same sheets? Give each sheet one id, that of the plan if walks log it, "
        "and remove the other row"
    )
    return [Finding.at_lines("duplicate_landmarks", file, [line[name] for name in pairs], message, Severity.ERROR)]


def _are_close(
    pairs: Mapping[str, str], measured: Mapping[str, SurveyedLandmark], planned: Mapping[str, SurveyedLandmark]
) -> bool:
    close = sum(measured[one].distance_m(planned[other]) < CLOSE_M for one, other in pairs.items())
    return close > len(pairs) / 2
