"""The files of a fleet by name, so that tests compare whole trees and not only what a command reports."""

from __future__ import annotations

from pathlib import Path

from tests.surveys import bytes_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.stored_folder import any_store_at
from vislam2tag.pipeline.fleet.catalogue import FLEET_FILE, SNAPSHOTS, SOURCES
from vislam2tag.pipeline.run.output import LOGS

COLUMNS_OF_TIMES = ("inputs", "labels")
"""Columns of the catalogue that follow from when files were written."""
_DIFFERENT = (FLEET_FILE, SNAPSHOTS, SOURCES, "reduced")
"""What counts snapshots, or keeps when files were written. Tests compare the catalogue as a table."""


def tree_of(fleet: Path, scratch: Path) -> dict[str, str]:
    """SHA-256 of each file of a fleet, by its name; hidden files and logs are left out."""
    store = any_store_at(fleet)
    for file in store.list():
        first, name = file.name.split("/")[0], file.name.split("/")[-1]
        if first not in _DIFFERENT and not name.startswith(".") and f"/{LOGS}/" not in file.name:
            store.fetch(file.name, Folder.at(scratch), file.name)
    return bytes_of(scratch)
