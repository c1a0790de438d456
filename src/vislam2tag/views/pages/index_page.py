"""The page that leads to all others of a survey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.core.status import labelled_share
from vislam2tag.labeling.results import Summary
from vislam2tag.self_check.record import SurveyCheck
from vislam2tag.views.page import write_page


@dataclass(frozen=True)
class IndexLink:
    """A page to go to."""

    href: str
    """Relative to the index."""
    title: str
    about: str


def write_index_page(
    out_file: Path,
    title: str,
    summary: Summary,
    check: SurveyCheck,
    faults: Sequence[str],
    links: Sequence[IndexLink],
) -> None:
    """Write the page: how good the labels are, what is wrong, and where to read on.

    Raises OutputError where it cannot be written.
    """
    context = {
        "title": title,
        "summary": summary,
        "share": labelled_share(summary.frames),
        "check": check,
        "faults": faults,
        "links": links,
    }
    write_page(out_file, "index.html.j2", context)
