"""What lies where in a fleet.

fleet.json                                             which snapshot of the catalogue counts; totals
catalogue/NUMBER-RANDOM.parquet                        a snapshot: one row for each survey
surveys/SURVEY/                                        raw survey
labels/SURVEY/                                         what process makes of it
tables/TABLE/survey=SURVEY/floor=FLOOR/TABLE.parquet   tables of all surveys (tables.py)
report/                                                pages: index.html, SURVEY/index.html, SURVEY/SESSION.html
reduced/SURVEY.json                                    what its summary, tables and pages follow from; gone while they
                                                       are made
sources/SURVEY.json                                    where its raw survey came from, and its files' SHA-256
replaced/SURVEY/FILE/SHA256                            former versions of raw files
"""

from __future__ import annotations

import re

from vislam2tag.common.errors import UsageError

FLEET_FILE = "fleet.json"
SNAPSHOTS, SURVEYS, LABELS, TABLES, REPORT = "catalogue", "surveys", "labels", "tables", "report"
REDUCED, SOURCES, REPLACED = "reduced", "sources", "replaced"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def survey_name(name: str) -> str:
    """The name of a survey in a fleet, which is part of addresses; raises UsageError where it cannot be."""
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name}: cannot be a survey's name in a fleet: letters, digits, '.', '_' and '-' only; rename its folder "
            "or give another --name"
        )
    return name
