"""Every trap of the raw layout, by name, and the findings that must come of it."""

from __future__ import annotations

from collections.abc import Iterable

from vislam2tag.common.errors import UsageError
from vislam2tag.simulation.choices import TRAP_FINDINGS
from vislam2tag.simulation.writing.session import SimulatedSession
from vislam2tag.simulation.writing.table_traps import TABLE_TRAPS
from vislam2tag.simulation.writing.text_traps import TEXT_TRAPS
from vislam2tag.simulation.writing.writer import SessionText

SITE_TRAPS = {
    "missing_plan": "floorplan.jpg",
    "missing_dimensions": "floor_dimensions.csv",
    "missing_markers": "marker_dict.csv",
}
"""The site file that each of these traps leaves out."""


def check_traps(names: Iterable[str]) -> frozenset[str]:
    """Return the names as a set; raises UsageError for one that is no trap."""
    traps = frozenset(names)
    unknown = sorted(traps - TRAP_FINDINGS.keys())
    if unknown:
        raise UsageError(f"no such trap: {', '.join(unknown)}; known: {', '.join(TRAP_FINDINGS)}")
    return traps


def trap_tables(session: SimulatedSession, traps: frozenset[str]) -> SimulatedSession:
    """Put the chosen traps into a session's tables."""
    for name, change in TABLE_TRAPS.items():
        if name in traps:
            session = change(session)
    return session


def trap_text(text: SessionText, traps: frozenset[str]) -> SessionText:
    """Put the chosen traps into the text of a session's files."""
    for name, change in TEXT_TRAPS.items():
        if name in traps:
            text = change(text)
    return text


def left_out(path: str, traps: frozenset[str]) -> bool:
    """Tell whether a trap leaves out the site file at this path."""
    return any(path.endswith(name) for trap, name in SITE_TRAPS.items() if trap in traps)
