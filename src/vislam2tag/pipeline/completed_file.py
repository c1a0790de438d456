"""Writing a completed landmark file, which ``process --landmarks`` reads, and its report."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from vislam2tag.csv_rows import csv_rows
from vislam2tag.errors import OutputError
from vislam2tag.pipeline.landmark_results import LandmarkRow, LandmarkSurvey
from vislam2tag.whole_file import whole_file

COLUMNS = ("id", "x", "y", "z", "floor", "sigma_m", "heading_rad", "heading_sigma_rad")


def check_targets(survey_root: Path, *targets: Path) -> None:
    """Raise OutputError where a file to be written has no folder, lies among the survey's own, or is named twice.

    Before the work rather than after it.
    """
    root = survey_root.resolve()
    for target in targets:
        place = target.resolve()
        if sum(place == other.resolve() for other in targets) > 1:
            raise OutputError(f"{target}: one file cannot hold both the landmarks and the report; choose another name")
        if not target.parent.is_dir() or target.is_dir():
            reason = "is a folder" if target.is_dir() else "there is no such folder"
            raise OutputError(f"{target}: cannot be written ({reason}); choose another name")
        if root not in place.parents:
            continue
        first = place.relative_to(root).parts[0]
        if first.startswith("floor_") or first == "corrections.toml":
            raise OutputError(f"{target}: lies among the survey's own files; choose another name")


def write_completed(survey: LandmarkSurvey, out: Path, report: Path | None = None) -> None:
    """Write the landmark file (docs/formats.md) and, where wanted, the whole result as JSON; each whole or not at all.

    Raises OutputError where one cannot be written.
    """
    texts = {out: completed_text(survey)}
    if report is not None:
        texts[report] = survey.model_dump_json(indent=1) + "\n"
    with ExitStack() as stack:
        for target, text in texts.items():
            stack.enter_context(whole_file(target)).write_text(text, encoding="utf-8", newline="")


def completed_text(survey: LandmarkSurvey) -> str:
    """The landmark file's text: all landmarks of all floors, x and y empty where there is no position."""
    return csv_rows((COLUMNS, *(_fields(row) for row in survey.landmarks)))


def _fields(row: LandmarkRow) -> tuple[str, ...]:
    numbers = (row.x_m, row.y_m, row.z_m, row.floor, row.sigma_m, row.heading_rad, row.heading_sigma_rad)
    return (row.landmark, *("" if number is None else str(number) for number in numbers))
