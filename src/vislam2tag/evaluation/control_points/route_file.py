"""``route.csv``: the control points in the order in which a session's walk passes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import IntArray
from vislam2tag.intake.ids import NamedIds, compare_ids
from vislam2tag.site.site_table import SiteTable, is_file, read_site_table

ROUTE_FILE = "route.csv"


def read_route(root: Path, session: Path, ids: Sequence[str]) -> IntArray | None:
    """Indices (r,) among the control points ``ids`` in walking order; None where no route is written down.

    The file in the ``session`` folder counts, else that of its floor (``floor_K/route.csv``). Its header is ``point``,
    then one id a line. Raises SurveyError where it cannot be read, has another header or names an unknown point.
    """
    path = next((folder / ROUTE_FILE for folder in (session, session.parent.parent) if _there(folder)), None)
    if path is None:
        return None
    try:
        table = read_site_table(root, path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror}); check its permissions") from error
    if table.header[:1] != ("point",) or not table.rows:
        raise SurveyError(f"{path}: expected the header 'point', then the ids of control points in walking order")
    return np.array([_index(path, table, row, ids) for row in range(len(table.rows))], dtype=np.int64)


def _counted_from_one(ids: Sequence[str]) -> set[str]:
    """The ids that the control points would have if they were counted from 1."""
    return {str(number) for number in range(1, len(ids) + 1)}


def _there(folder: Path) -> bool:
    return is_file(folder / ROUTE_FILE)


def _index(path: Path, table: SiteTable, row: int, ids: Sequence[str]) -> int:
    line, fields = table.rows[row]
    if fields[0] not in ids:
        named = tuple(dict.fromkeys(row[0] for _, row in table.rows))
        found = compare_ids(NamedIds("refmarker.csv", tuple(ids)), NamedIds("the route", named))
        counting = "; control points are counted from 0" if ids and set(named) <= _counted_from_one(ids) else ""
        raise SurveyError(
            f"{path}:{line}: there is no control point '{fields[0]}' on this floor: {found.text}{counting}; correct "
            "the route"
        )
    return list(ids).index(fields[0])
