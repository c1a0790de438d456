"""Results of a joint survey of landmarks, as rows by landmark and session, and as files."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.whole_output import file_to_write, output_errors
from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.fault_detection import CERTAIN_SIGMAS, FEWEST_OTHERS, LEAST_M
from vislam2tag.estimation.landmark_survey.comparison import GREATEST_HEADING_SIGMA_RAD, GREATEST_SIGMA_M
from vislam2tag.estimation.landmark_survey.landmark_map import LandmarkMap, predicted
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey, ReducedSession
from vislam2tag.pipeline.labels.odd_references import references
from vislam2tag.quality.diagnosis.record import References
from vislam2tag.site.landmark_file import MOST_LANDMARKS, SharedErrors, errors_file

SAME_PLACE_M = 0.5
"""A new id that was read only once within this distance of another landmark may be a misreading of it."""


class LandmarkRow(Record):
    """One landmark in the BCS; None for unknown values. ``z_m`` is above the floor."""

    floor: int
    landmark: str
    surveyed: bool
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    sigma_m: float | None = None
    heading_rad: float | None = None
    heading_sigma_rad: float | None = None
    sessions: int
    """Number of sessions, related to the survey, that observed it."""
    passes: int
    discrepancy_m: float | None = None
    """Distance of a surveyed landmark from its position according to all others; None if they do not determine it."""
    discrepancy_sigma_m: float | None = None
    """Standard deviation of that distance, per axis."""
    note: str = ""
    """Why it has no position, or a remark."""


class SessionRow(Record):
    """Contribution of one session."""

    floor: int
    device: str
    session: str
    landmarks: int
    """Number of landmarks observed."""
    used: bool
    note: str = ""
    """Why the session, or a part of it, was not used."""


class LandmarkSurvey(Record):
    """A joint survey of all landmarks."""

    version: str
    shift_m: float
    """Standard deviation, per axis, of errors of landmarks in walks beyond the uncertainty of each walk's map."""
    landmarks: tuple[LandmarkRow, ...]
    sessions: tuple[SessionRow, ...]
    findings: tuple[Finding, ...]
    """Findings about the site's own files."""
    references: References = References()
    """Each surveyed position and each session's observation, compared with all others."""


def landmark_survey(joint: JointSurvey) -> LandmarkSurvey:
    """Reduce a joint survey to its rows, landmarks by floor."""
    rows = [_landmark(joint, index) for index, place in enumerate(joint.places) if place.moved_to is None]
    tied = {session.key for session, used in zip(joint.mapped, joint.joined.tied.tolist(), strict=True) if used}
    return LandmarkSurvey(
        version=__version__,
        shift_m=round(joint.joined.doubts.shift_m, 4),
        landmarks=tuple(sorted(rows, key=lambda row: row.floor)),
        sessions=tuple(_session(session, used=session.key in tied) for session in joint.sessions),
        findings=(*joint.survey.findings, *_not_converged(joint)),
        references=references(joint),
    )


def _not_converged(joint: JointSurvey) -> list[Finding]:
    if joint.joined.converged:
        return []
    message = (
        "the joint map did not converge, because walks and survey contradict each other; measure the landmarks with "
        "the largest discrepancies again"
    )
    return [Finding(kind="not_converged", file="", count=1, message=message)]


def _session(session: ReducedSession, *, used: bool) -> SessionRow:
    note = session.error or ""
    if not note and session.local is None:
        note = "no landmark observed"
    elif not note and not used:
        note = (
            "not related to the survey: the walk shares fewer than two landmarks with it and with related walks, or "
            "contradicts them"
        )
    elif not session.converged:
        note = "its map did not converge, because its observations contradict each other; see vislam2tag process"
    elif session.unused:
        note = f"not used, because only other floors have these landmarks: {', '.join(session.unused)}"
    return SessionRow(
        **vars(session.key),
        landmarks=len(session.places),
        used=used,
        note=note,
    )


def _landmark(joint: JointSurvey, index: int) -> LandmarkRow:
    place, joined = joint.places[index], joint.joined
    surveyed = bool(joined.priors.surveyed[index])
    position, covariance = (
        (joined.priors.position, joined.priors.covariance)
        if surveyed
        else (joined.position, joined.position_covariance)
    )
    sigma_m = math.sqrt(float(np.trace(covariance[index])) / 2)
    seen = _passes(joined, index)
    reason = "" if surveyed else unplaced(joint, index)
    placed = surveyed or not reason
    heading, heading_sigma = _heading(joint, index)
    off = _discrepancy(joined, index) if surveyed and seen else None
    return LandmarkRow(
        floor=place.floor,
        landmark=place.landmark,
        surveyed=surveyed,
        x_m=round(float(position[index].real), 4) if placed else None,
        y_m=round(float(position[index].imag), 4) if placed else None,
        z_m=_z(joint, index),
        sigma_m=max(round(sigma_m, 4), 1e-4) if placed else None,
        heading_rad=heading if placed else None,
        heading_sigma_rad=heading_sigma if placed else None,
        sessions=len(seen),
        passes=sum(seen),
        discrepancy_m=None if off is None else round(off[0], 3),
        discrepancy_sigma_m=None if off is None else round(off[1], 3),
        note=reason or _oddity(joint, index, seen, contradicts=off is not None and off[2]),
    )


def _tied(joined: LandmarkMap) -> list[LocalMap]:
    """Maps of walks that are related to the survey."""
    return [one for one, used in zip(joined.maps, joined.tied.tolist(), strict=True) if used]


def _passes(joined: LandmarkMap, index: int) -> list[int]:
    """Number of observations of a landmark by each related map that observed it."""
    counts = (int(one.passes[one.landmark == index].sum()) for one in _tied(joined))
    return [count for count in counts if count]


def unplaced(joint: JointSurvey, index: int) -> str:
    """Why an unsurveyed landmark gets no position; empty if it gets one."""
    sigma_m = math.sqrt(float(np.trace(joint.joined.position_covariance[index])) / 2)
    if not any(joint.places[index] in session.places for session in joint.mapped):
        return "no walk observed it"
    if not _passes(joint.joined, index):
        return "observed only by walks that are not related to the survey"
    if not sigma_m <= GREATEST_SIGMA_M:
        return f"too uncertain (one standard deviation is {sigma_m:.1f} m): survey it or a landmark nearby"
    return ""


def _oddity(joint: JointSurvey, index: int, seen: list[int], *, contradicts: bool) -> str:
    if contradicts:
        return "contradicts the others: measure it again"
    if index < len(joint.survey.site.landmarks.ids):
        return ""
    if sum(seen) != 1:
        return "not in any landmark file"
    apart = np.abs(joint.joined.position - joint.joined.position[index])
    apart[[place.floor != joint.places[index].floor for place in joint.places]] = np.inf
    apart[index] = np.inf
    nearest = int(apart.argmin())
    if apart[nearest] < SAME_PLACE_M:
        return (
            f"not in any landmark file, observed only once; maybe a misread landmark {joint.places[nearest].landmark}"
        )
    return "not in any landmark file, observed only once"


def _heading(joint: JointSurvey, index: int) -> tuple[float | None, float | None]:
    """Heading and its standard deviation: as surveyed, or as estimated if walks logged any."""
    site, joined = joint.survey.site.landmarks, joint.joined
    if index < len(site.ids) and np.isfinite(site.heading_rad[index]):
        sigma = float(site.heading_sigma_rad[index])
        return round(float(site.heading_rad[index]), 6), sigma if np.isfinite(sigma) else None
    sigma = float(joined.heading_sigma_rad[index])
    if not sigma < GREATEST_HEADING_SIGMA_RAD:
        return None, None
    heading = math.remainder(float(joined.heading_rad[index]), math.tau)
    return round(heading, 4), max(round(sigma, 4), 1e-4)


def _z(joint: JointSurvey, index: int) -> float | None:
    """Height above the floor: as surveyed, or the median over walks."""
    site, place = joint.survey.site.landmarks, joint.places[index]
    if index < len(site.ids) and np.isfinite(site.z_m[index]):
        return float(site.z_m[index])
    heights = [
        float(session.z_m[session.places.index(place)])
        for session in joint.mapped
        if session.z_m is not None and place in session.places
    ]
    finite = [z for z in heights if math.isfinite(z)]
    return round(float(np.median(finite)), 3) if finite else None


def _discrepancy(joined: LandmarkMap, index: int) -> tuple[float, float, bool] | None:
    """Distance of a landmark from its position according to the others, its sigma, and whether it is too large."""
    passed = {int(number) for one in _tied(joined) for number in one.landmark[joined.priors.surveyed[one.landmark]]}
    if len(passed - {index}) < FEWEST_OTHERS:
        return None
    trial = predicted(joined, index)
    offset = complex(trial.position[index] - joined.priors.position[index])
    covariance = trial.position_covariance[index] + joined.priors.covariance[index]
    sigma_m = math.sqrt(float(np.trace(covariance)) / 2)
    if not sigma_m <= GREATEST_SIGMA_M:
        return None
    way = np.array([offset.real, offset.imag])
    sigmas = math.sqrt(float(way @ np.linalg.solve(covariance, way)))
    return abs(offset), sigma_m, sigmas > CERTAIN_SIGMAS and abs(offset) > LEAST_M


COLUMNS = ("id", "x", "y", "z", "floor", "sigma_m", "heading_rad", "heading_sigma_rad")


def check_targets(survey_root: Path, *targets: Path) -> None:
    """Raise OutputError early if an output file has no folder, is among the survey's own, or is named twice."""
    root = survey_root.resolve()
    for target in targets:
        place = target.resolve()
        if sum(place == other.resolve() for other in targets) > 1:
            raise OutputError(f"{target}: landmarks and report need two different files; choose another name")
        if not target.parent.is_dir() or target.is_dir():
            reason = "is a folder" if target.is_dir() else "its folder does not exist"
            raise OutputError(f"{target}: cannot be written ({reason}); choose another name")
        if root not in place.parents:
            continue
        first = place.relative_to(root).parts[0]
        if first.startswith("floor_") or first == "corrections.toml":
            raise OutputError(f"{target}: this path is among the survey's own files; choose another name")


def shared_errors(joint: JointSurvey) -> SharedErrors | None:
    """The errors that landmarks of the completed file share; None if walks placed none, or there are too many.

    Errors of landmarks in walks are part of the covariance. Errors of surveyed positions that the walks contradict are
    independent.
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
    """Write the landmark file (docs/reference/formats.md), the errors that its landmarks share and, if wanted, the
    whole result as JSON; each appears complete or not at all.

    Raises OutputError if one cannot be written.
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
    """The landmark file's text: all landmarks of all floors, with empty x and y without a position."""
    return csv_rows((COLUMNS, *(_fields(row) for row in survey.landmarks)))


def _fields(row: LandmarkRow) -> tuple[str, ...]:
    numbers = (row.x_m, row.y_m, row.z_m, row.floor, row.sigma_m, row.heading_rad, row.heading_sigma_rad)
    return (row.landmark, *("" if number is None else str(number) for number in numbers))
