"""A format to export a data set in: where each fingerprint was taken, as one CSV file."""

from __future__ import annotations

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.model import Dataset

COLUMNS = ("building", "floor", "x", "y")


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``points.csv``; fingerprints without a position are left out, as a finding says."""
    points = dataset.fingerprints.select(COLUMNS).collect()
    placed = points.drop_nulls(["x", "y"])
    with folder.writing("points.csv") as file:
        placed.write_csv(file)
    context.progress("points.csv", 1)
    left_out = len(points) - len(placed)
    if not left_out:
        return ()
    return (Finding(kind="unlabelled_left_out", file="", count=left_out, message="fingerprints without a position"),)


register(writes=ExportFormat("points-csv", {"fingerprints": COLUMNS}, write=write))
