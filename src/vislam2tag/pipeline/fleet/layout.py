"""What lies where in a fleet.

fleet.json                                             which snapshot of the catalogue counts; totals
catalogue/NUMBER-RANDOM.parquet                        a snapshot: one row for each survey
surveys/SURVEY/                                        raw survey
labels/SURVEY/                                         what process makes of it
tables/TABLE/survey=SURVEY/floor=FLOOR/TABLE.parquet   tables of all surveys (tables.py)
report/                                                pages: index.html, SURVEY/index.html, SURVEY/SESSION.html
"""

from __future__ import annotations

import re

from vislam2tag.common.errors import UsageError

FLEET_FILE = "fleet.json"
SNAPSHOTS, SURVEYS, LABELS, TABLES, REPORT = "catalogue", "surveys", "labels", "tables", "report"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def survey_name(name: str) -> str:
    """The name of a survey in a fleet, which is part of addresses; raises UsageError where it cannot be."""
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name}: cannot be a survey's name in a fleet: letters, digits, '.', '_' and '-' only; rename its folder"
        )
    return name
