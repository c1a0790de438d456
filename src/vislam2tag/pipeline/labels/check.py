"""The check without ground truth: accuracy of labels, bad landmarks, and best places for another landmark.

Each session is checked against itself in a worker process: landmarks are left out in turn and predicted from the
others; for sessions without poses, known positions are. The check includes the coverage of the plans.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, SessionError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.whole_output import output_errors
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.dead_reckoning.walk import LeftOut as LeftOutFixes
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk
from vislam2tag.estimation.heights import estimate_heights
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.settings import HeightSettings
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk
from vislam2tag.estimation.strategies.dead_reckoning import DeadReckoning
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.walked_floors import FloorWalked, WalkPlaces, walked_floors
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.pipeline.run.selection import OpenedSurvey, RunChoices
from vislam2tag.quality.landmark_gain import GainMap, gains, positions_each_metre, session_gains
from vislam2tag.quality.self_check import (
    LeftOut,
    bad_landmarks,
    error_factor,
    estimate_accuracy,
    expected_error_m,
    judgement_of,
    leave_out,
)
from vislam2tag.quality.self_check_record import DoubtfulFix, FloorCheck, LeftOutMark, SessionCheck, SurveyCheck
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, mappable_session
from vislam2tag.site.links import left_out_of, shared_survey
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.plan_costs import plan_fault
from vislam2tag.views.quality_pages import write_check_page


def checked_by_fixes(prepared: PreparedSession, settings: ProcessSettings) -> dict[str, Any]:
    """Return the session's numbers under their names in its record; raises SessionError if it cannot be mapped."""
    walk, camera = reckoned(prepared, settings), prepared.session.camera
    time_s = np.asarray((camera.time_ns[camera.usable] - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    covariance = walk.at(time_s)[1]
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    labelled = sigma_m <= settings.labels.max_sigma_without_poses_m
    left_out = LeftOutFixes.of(walk)
    marks = _left_out(walk, left_out, prepared.session.key.floor)
    found = [LeftOut(mark.landmark, 1, np.array(mark.offset_m), mark.covariance_m2[0] * np.eye(2)) for mark in marks]
    details: dict[str, Any] = {
        "fixes": len(walk.names),
        "left_out": marks,
        "doubtful_fixes": doubtful_fixes(walk, left_out),
        "frames": len(sigma_m),
        "labelled": int(labelled.sum()),
    }
    if (estimate := estimate_accuracy(covariance[labelled], found)) is not None:
        details |= estimate.rounded()
    return details


def reckoned(prepared: PreparedSession, settings: ProcessSettings) -> ReckonedWalk:
    """Map a session without poses; raises SessionError if it cannot be."""
    strategy = DeadReckoning(settings.mapping.dead_reckoning, settings.mapping.heights)
    walk = strategy.reckoned(prepared.session.camera, prepared.landmarks)
    if walk is None:
        raise SessionError(f"{prepared.session.key}: the session could not be mapped; it needs {strategy.needs}")
    return walk


def doubtful_fixes(walk: ReckonedWalk, left_out: LeftOutFixes) -> list[DoubtfulFix]:
    """The fixes that the others contradict, in order of time."""
    return [
        DoubtfulFix(
            name=walk.names[fix],
            fix_m=_rounded(walk.fixes.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            size_m=round(float(np.linalg.norm(left_out.error_m[fix])), 4),
            sigma_m=round(float(left_out.sigma_m[fix]), 4),
        )
        for fix in np.flatnonzero(left_out.doubtful).tolist()
    ]


def _rounded(place: complex) -> tuple[float, float]:
    """A place or an offset, x + iy, to a tenth of a millimetre."""
    return round(float(place.real), 4), round(float(place.imag), 4)


def _left_out(walk: ReckonedWalk, left_out: LeftOutFixes, floor: int) -> list[LeftOutMark]:
    """The fixes that the others can predict."""
    scatter_m2 = walk.fix_scatter_m**2
    return [
        LeftOutMark(
            floor=floor,
            landmark=walk.names[fix],
            passes=1,
            surveyed_m=_rounded(walk.fixes.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            covariance_m2=(float(left_out.sigma_m[fix] ** 2), 0.0, float(left_out.sigma_m[fix] ** 2)),
            survey_covariance_m2=(float(scatter_m2[fix]), 0.0, float(scatter_m2[fix])),
        )
        for fix in np.flatnonzero(np.isfinite(left_out.sigma_m)).tolist()
    ]


@dataclass(frozen=True)
class CheckedSession:
    """Result of a worker, without ``gains`` and ``places`` if the session could not be mapped."""

    record: SessionCheck
    gains: GainMap = field(default_factory=GainMap)
    places: Sequence[WalkPlaces] = ()


def check_session(settings: ProcessSettings, task: SessionTask) -> CheckedSession:
    """Read, map and check one session; one that cannot be read or mapped becomes a record with an error."""
    failed = lambda error: CheckedSession(_record(task, error=error))
    return done_or_failed(task.ref.key, lambda: _check(settings, task), failed)


def _check(settings: ProcessSettings, task: SessionTask) -> CheckedSession:
    whole = mappable_session(task, inertial=settings.inertial)
    if whole.session.camera.without_poses:
        return CheckedSession(_record(task, **checked_by_fixes(whole, settings)))
    prepared = whole.longest_section()
    _, smoothed = solved(prepared, settings.mapping.smoother.sighting_range_m)
    if smoothed is None:
        return _checked_on_plan(prepared, settings)
    left_out = leave_out(smoothed)
    path, covariance, _ = mapped_path(smoothed)
    odometry = smoothed.model.observations.odometry
    floor = _floors(prepared, settings.mapping.heights, odometry)[odometry.frame]
    positions = positions_each_metre(smoothed)
    found = session_gains(
        gains(smoothed, positions, floor[positions.at]), error_factor(left_out), floor, expected_error_m(covariance)
    )
    record = _record(task, **_accuracy(prepared, smoothed, covariance, left_out, settings.labels.max_sigma_m))
    return CheckedSession(record, found, [_places(prepared, odometry.frame, path, floor)])


def _checked_on_plan(prepared: PreparedSession, settings: ProcessSettings) -> CheckedSession:
    """Check a walk that no landmarks connect to the building by its sigma alone, if its floor's plan may place it."""
    session, strategy = prepared.session, strategy_named(settings.strategy, settings.mapping)
    mapped = strategy.map(session.camera, session.landmarks, prepared.landmarks)
    frame = np.flatnonzero(mapped.status == Status.OK)
    if mapped.placing is None or (session.landmarks.ids and not len(frame)):
        fault = plan_fault(prepared.task.floor)
        why = "vislam2tag inspect shows what it has" if fault is None else f"the plan of its floor: {fault}"
        raise SessionError(f"{session.key}: the session could not be mapped; it needs {strategy.needs} ({why})")
    covariance = mapped.covariance_bcs[frame]
    labelled = mapped.sigma_m[frame] <= settings.labels.max_sigma_m
    details: dict[str, Any] = {"frames": int(session.camera.usable.sum()), "labelled": int(labelled.sum())}
    if (estimate := estimate_accuracy(covariance[labelled], ())) is not None:
        details |= estimate.rounded()
    floor = mapped.floor[frame] if len(mapped.floor) else np.full(len(frame), session.key.floor)
    places = [_places(prepared, frame, mapped.position_bcs[frame, :2], floor)] if len(frame) else []
    return CheckedSession(_record(prepared.task, **details), places=places)


_FAR_NS = 1_000_000_000
"""A scan so long before the next mapped frame was received where the walk has no position."""


def _places(prepared: PreparedSession, at: IntArray, path: FloatArray, floor: IntArray) -> WalkPlaces:
    """Positions of a session about every metre, and at its Wi-Fi scans; ``path`` (n, 2), ``floor`` (n,)
    of the mapped frames ``at`` (n,).
    """
    time_ns = prepared.session.camera.time_ns[at]
    _, each = np.unique(np.floor(arc_lengths(path)), return_index=True)
    heard_ns = np.unique(prepared.session.tables["wifi"]["time_ns"].to_numpy())
    heard_ns = heard_ns[(heard_ns >= time_ns[0]) & (heard_ns <= time_ns[-1])]
    frame = np.searchsorted(time_ns, heard_ns)
    frame = frame[time_ns[frame] - heard_ns < _FAR_NS]
    return WalkPlaces(path[each], floor[each], path[frame], floor[frame])


def solved(prepared: PreparedSession, range_m: float) -> tuple[WalkObservations, SolvedWalk | None]:
    """A session's observations, sightings within ``range_m``, and the smoother's result, if any."""
    session, landmarks = prepared.session, prepared.landmarks
    surveyed = landmarks.surveyed_ids
    observations = bridged_observations(session.camera, session.landmarks, range_m, surveyed=surveyed)
    return observations, solve_walk(observations, LandmarkPriors.of(observations.ids, landmarks))


def _floors(prepared: PreparedSession, settings: HeightSettings, odometry: Odometry) -> IntArray:
    """Floor (n,) of each camera frame."""
    session = prepared.session
    floor = estimate_heights(session.camera, session.landmarks, prepared.landmarks, settings, odometry).floor
    return floor if len(floor) else np.full(len(session.camera.time_ns), session.key.floor)


def _accuracy(
    prepared: PreparedSession,
    smoothed: SolvedWalk,
    covariance: FloatArray,
    left_out: tuple[LeftOut, ...],
    max_sigma_m: float,
) -> dict[str, Any]:
    """The session's numbers under their names in its record; ``covariance`` (n, 2, 2) of its frames, m^2."""
    observations, priors = smoothed.model.observations, smoothed.priors
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    labelled = sigma_m <= max_sigma_m
    estimate = estimate_accuracy(covariance[labelled], left_out)
    details: dict[str, Any] = {
        "landmarks": int(priors.surveyed[np.unique(observations.passes.landmark)].sum()),
        "left_out": [_mark(error, prepared.landmarks) for error in left_out],
        "frames": len(sigma_m),
        "labelled": int(labelled.sum()),
    }
    return details if estimate is None else details | estimate.rounded()


def _mark(error: LeftOut, landmarks: Landmarks) -> LeftOutMark:
    row = landmarks.index[error.landmark]
    x, y = landmarks.position_bcs[row].tolist()
    return LeftOutMark(
        floor=int(landmarks.floor[row]),
        landmark=error.landmark,
        passes=error.passes,
        surveyed_m=(round(x, 4), round(y, 4)),
        offset_m=(round(float(error.offset_m[0]), 4), round(float(error.offset_m[1]), 4)),
        covariance_m2=_entries(error.covariance_m2),
        survey_covariance_m2=_entries(landmarks.covariance_bcs[row]),
    )


def _entries(covariance: FloatArray) -> tuple[float, float, float]:
    """xx, xy and yy of a covariance (2, 2)."""
    return float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])


def _record(task: SessionTask, **details: Any) -> SessionCheck:
    """Add the session's identity."""
    return SessionCheck(slug=task.ref.slug, **vars(task.ref.key), **details)


CHECK_FILE, PAGE_FILE = "check.json", "check.html"


def check(
    survey_root: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    out: AnyPath | None = None,
    walkable: WalkableSettings | None = None,
    follow_links: bool = False,
    progress: Progress[SessionCheck] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    **choices: Unpack[RunChoices],
) -> SurveyCheck:
    """Check a survey against itself: leave out each landmark or fix in turn, session by session.

    See docs/explanation/truth.md.

    ``walkable`` sets how the walkable space of the plans is found for the coverage. Plans and other site files that
    links lead to outside the survey are not shown, unless ``follow_links`` is given; ``tell`` is called with their
    names. With ``out`` everything is written there as ``check.json`` and ``check.html``. ``landmarks``, ``selection``
    and ``jobs`` are as :class:`RunChoices` says. Raises SurveyError if ``survey_root`` is not a survey or ``landmarks``
    not a landmark file for it. Raises UsageError for a selection that matches nothing, OutputError if ``out`` cannot be
    written; a bad session is only counted in ``SurveyCheck.failed``.
    """
    opened, out = OpenedSurvey.at(survey_root, settings, **choices), path_or_none(out)
    survey, settings, refs = opened.survey, opened.settings, opened.refs
    if out is not None:
        opened.refuse_output(out, _checked_before(out))
        _make_folder(out)
    early: dict[str, CheckedSession] = {}
    sessions: list[SessionCheck] = []
    gains, places = GainMap(), list[WalkPlaces]()

    def report(checked: CheckedSession) -> None:
        """Add sessions up as they end, in the survey's order, so that sums do not depend on the workers."""
        early[checked.record.slug] = checked
        while len(sessions) < len(refs) and (following := early.pop(refs[len(sessions)].slug, None)):
            sessions.append(following.record)
            gains.add(following.gains)
            places.extend(following.places)
        progress(checked.record, len(refs))

    opened.run_all(partial(check_session, settings), opened.tasks(refs), report=report)
    shown = shared_survey(survey, follow_links=follow_links)
    tell(left_out_of(shown.findings))
    walked = walked_floors(shown.root, shown.site, places, walkable)
    bad = bad_landmarks([session for session in sessions if not session.fixes])
    doubtful = sum(len(session.doubtful_fixes) for session in sessions)
    found = SurveyCheck(
        version=__version__,
        max_sigma_m=settings.labels.model_dump(mode="json")["max_sigma_m"],
        sessions=sessions,
        floors=[_with_rooms(floor, walked) for floor in gains.floors(survey.site.landmarks)],
        bad_landmarks=[one.model_copy(update={"room": _room(walked, one.floor, one.surveyed_m)}) for one in bad],
        judgement=judgement_of(sessions, len(bad) + doubtful),
        walked=[floor.record for floor in walked.values()],
    )
    if out is not None:
        folder = Folder.at(out)
        with output_errors(out / CHECK_FILE):
            folder.write(CHECK_FILE, json.dumps(found.model_dump(mode="json"), indent=1) + "\n")
        spaces = {number: floor.space for number, floor in walked.items()}
        with output_errors(out / PAGE_FILE):
            page = folder.without_links(PAGE_FILE)
        write_check_page(page, shown, found, gains, spaces)
    return found


def _with_rooms(floor: FloorCheck, walked: Mapping[int, FloorWalked]) -> FloorCheck:
    """Add to each proposed place the name of its room, if the plan has names."""
    rooms = [_room(walked, floor.number, (place.x_m, place.y_m)) for place in floor.places]
    places = [
        place.model_copy(update={"near": ", ".join(filter(None, (room and f"in {room}", place.near)))})
        for place, room in zip(floor.places, rooms, strict=True)
    ]
    return floor.model_copy(update={"places": places})


def _room(walked: Mapping[int, FloorWalked], floor: int, place_m: tuple[float, float]) -> str:
    """Name of the room or corridor at a place; empty if it has none."""
    space = walked[floor].space if floor in walked else None
    return "" if space is None else space.areas.of_place(place_m)


def _checked_before(out: Path) -> list[str]:
    """Slugs of the sessions of the check in a folder; none if it contains no readable check."""
    try:
        before = SurveyCheck.model_validate_json(read_bytes(out / CHECK_FILE))
    except (OSError, ValidationError):
        return []
    return [session.slug for session in before.sessions]


def _make_folder(out: Path) -> None:
    try:
        Folder.at(out).make()
    except OSError as error:
        reason = "a file, not a folder" if out.is_file() else error.strerror
        raise OutputError(f"{out}: cannot be used as the output folder ({reason}); choose another --out") from error
