"""All walks of the paper's evaluation: those over control points, and those before a total station."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.similarity import Similarity2
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.paper.data import PaperData, read_mappable
from vislam2tag.quality.evaluation.paper import (
    PaperWalk,
    StationWalks,
    map_all,
    press_walk,
    station_settings,
    station_walks,
)
from vislam2tag.quality.evaluation.station_frame import TRACK_FILE, fit_frame, read_station_track, shot_points
from vislam2tag.site.model import SessionKey, SessionRef, Survey

Phone = tuple[int, str]
"""Floor and device: what shares a clock offset."""
Refs = Sequence[tuple[Survey, SessionRef]]


@dataclass(frozen=True)
class StationPhone:
    """What one phone's walks on one floor before the total station show."""

    bcs_t_station: Similarity2
    found: StationWalks


@dataclass
class PaperWalks:
    """The walks of the paper's Tables I and II, sorted by key."""

    pressed: list[PaperWalk] = field(default_factory=list)
    phones: dict[Phone, StationPhone] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)
    """One sentence for each session or phone that could not be evaluated."""

    @property
    def tracked(self) -> list[PaperWalk]:
        """The walks before the total station."""
        return [walk for phone in self.phones.values() for walk in phone.found.walks]


def paper_walks(data: PaperData, settings: ProcessSettings, progress: Progress[int] = silent) -> PaperWalks:
    """Evaluate every walk over control points and every walk with a ``tachy.csv``; what fails is only reported."""
    pressed, phones = _sorted_out(data)
    total = len(pressed) + sum(map(len, phones.values()))
    walks = PaperWalks()
    done = 0
    for survey, ref in pressed:
        _add_pressed(walks, survey, ref, settings)
        progress(done := done + 1, total)
    for phone, refs in phones.items():
        try:
            walks.phones[phone] = _station_phone(refs, settings)
        except Vislam2tagError as error:
            walks.failed.append(f"floor {phone[0]} / {phone[1]}: {error}")
        progress(done := done + len(refs), total)
    return walks


def _sorted_out(data: PaperData) -> tuple[Refs, dict[Phone, list[tuple[Survey, SessionRef]]]]:
    """Sessions on floors with control points, and those with a station's track by phone; the others show no error."""
    pressed = []
    phones: dict[Phone, list[tuple[Survey, SessionRef]]] = defaultdict(list)
    for survey, ref in data.refs():
        if (ref.folder / TRACK_FILE).is_file():
            phones[ref.key.floor, ref.key.device].append((survey, ref))
        elif len(survey.site.floor(ref.key.floor).control_points.ids):
            pressed.append((survey, ref))
    return pressed, phones


def _add_pressed(walks: PaperWalks, survey: Survey, ref: SessionRef, settings: ProcessSettings) -> None:
    try:
        session, landmarks = read_mappable(survey, ref, settings)
    except Vislam2tagError as error:
        walks.failed.append(str(error))
        return
    if len(session.presses_ns):
        mapped = map_all(session, landmarks, settings.mapping)
        walks.pressed.append(press_walk(session, survey.site.floor(ref.key.floor), mapped, settings.labels.max_sigma_m))


def _station_phone(refs: Refs, settings: ProcessSettings) -> StationPhone:
    """Evaluate the walks of one phone; raises SurveyError or SessionError where something of it cannot be used."""
    strict = station_settings(settings.mapping)
    survey, first = refs[0]
    number = first.key.floor
    frame = fit_frame(shot_points(survey.root / f"floor_{number}", number, survey.site.landmarks))
    sessions = []
    for at, ref in refs:
        session, landmarks = read_mappable(at, ref, settings)
        sessions.append((session, map_all(session, landmarks, strict), read_station_track(ref.folder / TRACK_FILE)))
    found = station_walks(sessions, frame.bcs_t_station, settings.labels.max_sigma_m)
    return StationPhone(frame.bcs_t_station, found)


def walk_of(walks: Sequence[PaperWalk], key: SessionKey) -> PaperWalk | None:
    """Find a walk by its session; None where it is not among them."""
    return next((walk for walk in walks if walk.key == key), None)
