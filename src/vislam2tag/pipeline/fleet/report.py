"""The pages about a fleet as a whole, made of its catalogue alone."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.files.folder_store import any_store_at
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.pipeline.fleet.catalogue import Fleet, totals_of
from vislam2tag.pipeline.fleet.layout import REPORT
from vislam2tag.views.fleet_pages import fleet_pages


def write_fleet_report(fleet: AnyPath) -> int:
    """Write ``report/index.html`` and, for many surveys, the pages after it; return how many there are.

    Raises UsageError where there is no fleet, StoreError where it cannot be written.
    """
    fleet = Path(fleet)
    table = Fleet(fleet).catalogue()
    store = any_store_at(fleet / REPORT)
    pages = list(fleet_pages(fleet.name, totals_of(table).model_dump(), table.to_dicts()))
    for name, text in pages:
        store.put(name, text.encode("utf-8", errors="replace"))
    return len(pages)
