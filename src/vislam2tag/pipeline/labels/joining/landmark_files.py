"""The files of a joint survey of the landmarks: all landmarks, the errors that they share, and the whole report."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.whole_file import file_to_write, output_errors
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.similarity import as_points
from vislam2tag.pipeline.labels.joining.landmark_results import LandmarkRow, LandmarkSurvey, unplaced
from vislam2tag.pipeline.labels.joining.landmark_survey import JointSurvey
from vislam2tag.site.landmark_file import MOST_LANDMARKS, SharedErrors, errors_file

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


def shared_errors(joint: JointSurvey) -> SharedErrors | None:
    """The errors that landmarks of the completed file share; None where walks placed none, or there are too many.

    How far walks see a landmark off its place is part of the covariance. Surveyed places that the walks contradict err
    by themselves.
    """
    joined = joint.joined
    surveyed, agreed = joined.priors.surveyed, joined.agreed
    rows = np.array(
        [
            index
            for index, place in enumerate(joint.places)
            if place.moved_to is None and (agreed[index] if surveyed[index] else not unplaced(joint, index))
        ],
        dtype=np.int64,
    )
    if surveyed[rows].all() or len(rows) > MOST_LANDMARKS:
        return None
    return SharedErrors(
        floor=np.array([joint.places[index].floor for index in rows.tolist()], dtype=np.int64),
        ids=tuple(joint.places[index].landmark for index in rows.tolist()),
        position_bcs=as_points(np.where(surveyed, joined.priors.position, joined.position)[rows]),
        covariance=joined.shared_covariance(rows),
    )


def write_completed(
    survey: LandmarkSurvey, out: Path, report: Path | None = None, shared: SharedErrors | None = None
) -> None:
    """Write the landmark file (docs/reference/formats.md), beside it the errors that its landmarks share and, where
    wanted, the whole result as JSON; each whole or not at all.

    Raises OutputError where one cannot be written.
    """
    contents = {out: landmark_file_text(survey).encode()}
    if report is not None:
        contents[report] = (survey.model_dump_json(indent=1) + "\n").encode()
    beside, errors = Folder.at(out.parent), errors_file(out)
    with ExitStack() as stack:
        for target, content in contents.items():
            stack.enter_context(file_to_write(target)).write(content)
        stack.enter_context(output_errors(errors))
        if shared is not None:
            stack.enter_context(beside.writing(errors.name)).write(shared.as_bytes())
        else:
            beside.remove(errors.name)  # of another run


def landmark_file_text(survey: LandmarkSurvey) -> str:
    """The landmark file's text: all landmarks of all floors, x and y empty where there is no position."""
    return csv_rows((COLUMNS, *(_fields(row) for row in survey.landmarks)))


def _fields(row: LandmarkRow) -> tuple[str, ...]:
    numbers = (row.x_m, row.y_m, row.z_m, row.floor, row.sigma_m, row.heading_rad, row.heading_sigma_rad)
    return (row.landmark, *("" if number is None else str(number) for number in numbers))
