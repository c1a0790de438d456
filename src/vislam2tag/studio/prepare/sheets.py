"""Sheets to print of a survey's landmarks, made as by ``vislam2tag sheets`` into a folder beside the survey."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.preparation.sheets.settings import SheetSettings
from vislam2tag.preparation.sheets.sheet_folder import PDF_FILE, SheetOptions, is_sheets, make_sheets
from vislam2tag.studio.prepare.messages import SheetsView, SheetsWish
from vislam2tag.studio.workspace import beside


def sheets_folder(root: Path) -> Path:
    """Where the sheets of a survey go: ``SURVEY-sheets`` beside it."""
    return beside(root, "sheets")


def made_sheets(root: Path, wish: SheetsWish, settings: SheetSettings) -> SheetsView:
    """Make them; raises what ``vislam2tag sheets`` raises."""
    out = sheets_folder(root)
    options = SheetOptions(root, wish.ids or None, None, wish.tag, settings.model_copy(update={"paper": wish.paper}))
    found = make_sheets(options, out)
    return SheetsView(folder=str(out), pages=len(found.pages), notes=[one.message for one in found.findings])


def sheets_pdf(root: Path) -> bytes:
    """The pages; raises KeyError where none were made."""
    folder = sheets_folder(root)
    if not is_sheets(folder):
        raise KeyError("sheet yet")
    return read_bytes(folder / PDF_FILE)
