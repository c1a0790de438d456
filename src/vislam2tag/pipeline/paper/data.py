"""The surveys of the paper's data, found in all subfolders of one folder.

The paper's own data set (section VII): the walks for collecting fingerprints, labelled and counted.

All walks of the paper's evaluation: those over control points, and those before a total station.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from vislam2tag.common.errors import SessionError, SurveyError, Vislam2tagError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.progress import Progress, counted, silent
from vislam2tag.core.tracks import Landmarks
from vislam2tag.datasets.fingerprints import access_points_of, tables_of
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.labelled import LabelledSession, LabelledSurvey, open_labelled
from vislam2tag.datasets.model import Dataset, DatasetInfo
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import DatasetStatistics
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.datasets.sources import SessionJob, build_session
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.selection import Selection, session_task
from vislam2tag.quality.evaluation.paper import (
    PaperWalk,
    map_all,
    press_walk,
    station_settings,
    station_walks,
)
from vislam2tag.quality.evaluation.station_frame import TRACK_FILE, fit_frame, read_station_track, shot_points
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.discover import floor_folders, subfolders
from vislam2tag.site.model import SessionKey, SessionRef, Survey

DEPTH = 2
"""Surveys are searched in the folder itself and this many levels below."""


@dataclass(frozen=True)
class PaperData:
    """All surveys below a folder, sorted by path; if two contain the same session, the first counts."""

    root: Path
    surveys: tuple[Survey, ...]

    def find(self, key: SessionKey) -> tuple[Survey, SessionRef]:
        """Return a session and its survey; raises SessionError if there is none of this key."""
        for survey in self.surveys:
            for ref in survey.sessions:
                if ref.key == key:
                    return survey, ref
        raise SessionError(f"{key} does not exist in this data")

    def refs(self) -> list[tuple[Survey, SessionRef]]:
        """Every session once, with its survey, except those that corrections exclude."""
        found: dict[SessionKey, tuple[Survey, SessionRef]] = {}
        for survey in self.surveys:
            corrections = read_corrections(survey.root)
            for ref in survey.sessions:
                if not corrections.excludes(ref.key):
                    found.setdefault(ref.key, (survey, ref))
        return list(found.values())


def open_paper_data(root: Path) -> PaperData:
    """Find surveys in ``root`` and below; raises SurveyError if there is none."""
    # Opening a folder without a survey reports what is wrong with it.
    return PaperData(root, tuple(open_survey(folder) for folder in _survey_folders(root, DEPTH) or [root]))


def _survey_folders(folder: Path, depth: int) -> list[Path]:
    """The folder itself if it contains floors, otherwise the surveys in its subfolders."""
    try:
        floor_folders(folder)
    except SurveyError:
        inside: list[Path] = []
        with suppress(OSError):
            inside = subfolders(folder) if depth else []
        return [found for below in inside for found in _survey_folders(below, depth - 1)]
    return [folder]


def read_mappable(survey: Survey, ref: SessionRef, settings: ProcessSettings) -> tuple[Session, Landmarks]:
    """Read a session and the landmarks that it may use, corrected; raises SessionError if it cannot be read."""
    prepared = prepared_session(session_task(ref, survey, read_corrections(survey.root), settings))
    return prepared.session, prepared.landmarks


STRATEGY = "local-corrected"
"""The strategy that labelled giaIndoorLoc."""
EVALUATED = ("_ref", "_tachy", "_split")
"""Suffixes of device folders of the published evaluation; their walks do not collect fingerprints."""


@dataclass(frozen=True)
class Collection:
    """Results of the collecting walks, and one sentence for each that could not be labelled."""

    statistics: DatasetStatistics | None
    """None if there is no such walk, or none with Wi-Fi readings."""
    failed: tuple[str, ...]


def paper_collection(
    data: PaperData,
    settings: ProcessSettings,
    progress: Progress[int] = silent,
    keep: Path | None = None,
) -> Collection:
    """Label the walks of all devices outside the evaluation, group their Wi-Fi readings by scan, and count.

    The data set is written to ``keep``, with its splits, if there is such a walk.
    """
    own = settings.model_copy(update={"strategy": STRATEGY})
    chosen = [(survey, devices) for survey in data.surveys if (devices := _devices(survey))]
    total = sum(ref.key.device in devices for survey, devices in chosen for ref in survey.sessions)
    advance = counted(progress, total)
    with scratch_folder() as scratch:
        labelled = []
        for number, (survey, devices) in enumerate(chosen):
            out = scratch / f"labels-{number}"
            process(survey.root, out, own, selection=Selection(devices=devices), progress=advance)
            labelled.append(open_labelled(out, follow_links=True))
        sessions = list(_distinct_sessions(labelled))
        if not sessions:
            return Collection(None, ())
        failed = tuple(filter(None, (session.result().error for session, _ in sessions)))
        dataset = _dataset(sessions, scratch.folder("tables"))
        statistics = dataset_statistics(dataset)
        if keep is not None:
            write_dataset(replace(dataset, splits=standard_splits(dataset)), keep)
    return Collection(statistics if "wifi" in statistics.technologies else None, failed)


def _devices(survey: Survey) -> tuple[str, ...]:
    """Devices with a walk outside the evaluation."""
    corrections = read_corrections(survey.root)
    keys = [ref.key for ref in survey.sessions if not corrections.excludes(ref.key)]
    return tuple(sorted({key.device for key in keys if not key.device.endswith(EVALUATED)}))


def _distinct_sessions(surveys: list[LabelledSurvey]) -> Iterator[tuple[LabelledSession, float]]:
    """Each session with its survey's limit of sigma; if two surveys contain the same session, the first counts."""
    found: set[SessionKey] = set()
    for survey in surveys:
        for session in survey.sessions:
            result = session.result()
            key = SessionKey(result.floor, result.device, result.session)
            if key not in found:
                found.add(key)
                yield session, survey.max_sigma_m


def _dataset(sessions: list[tuple[LabelledSession, float]], folder: Folder) -> Dataset:
    """Build fingerprints of the sessions, with tables in ``folder``."""
    for number, (session, max_sigma_m) in enumerate(sessions):
        build_session(SessionJob(session, f"{number:06d}", "", number, folder, DatasetSettings(), max_sigma_m))
    tables = {name: rows for name, rows in tables_of(folder.path).items() if name in (FINGERPRINTS, READINGS, SESSIONS)}
    access_points = access_points_of(folder.path, tables[FINGERPRINTS], tables[READINGS]).lazy()
    return Dataset(DatasetInfo(name="giaIndoorLoc", floors=()), tables | {ACCESS_POINTS: access_points})


Phone = tuple[int, str]
"""Floor and device, which share a clock offset."""
Refs = Sequence[tuple[Survey, SessionRef]]


@dataclass
class PaperWalks:
    """The walks of the paper's Tables I and II, sorted by key."""

    pressed: list[PaperWalk] = field(default_factory=list)
    tracked: list[PaperWalk] = field(default_factory=list)
    """Those before the total station."""
    failed: list[str] = field(default_factory=list)
    """One sentence for each session or phone that could not be evaluated."""


def paper_walks(data: PaperData, settings: ProcessSettings, progress: Progress[int] = silent) -> PaperWalks:
    """Evaluate every walk over control points and every walk with a ``tachy.csv``; failures are only reported."""
    pressed, phones = _sorted_out(data)
    total = len(pressed) + sum(map(len, phones.values()))
    walks = PaperWalks()
    done = 0
    for survey, ref in pressed:
        _add_pressed(walks, survey, ref, settings)
        progress(done := done + 1, total)
    for phone, refs in phones.items():
        try:
            walks.tracked += _before_station(refs, settings)
        except Vislam2tagError as error:
            walks.failed.append(f"floor {phone[0]} / {phone[1]}: {error}")
        progress(done := done + len(refs), total)
    return walks


def _sorted_out(data: PaperData) -> tuple[Refs, dict[Phone, list[tuple[Survey, SessionRef]]]]:
    """Sessions on floors with control points, and those with a station's track by phone."""
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


def _before_station(refs: Refs, settings: ProcessSettings) -> list[PaperWalk]:
    """Evaluate the walks of one phone; raises SurveyError or SessionError if its data cannot be used."""
    strict = station_settings(settings.mapping)
    survey, first = refs[0]
    number = first.key.floor
    frame = fit_frame(shot_points(survey.root / f"floor_{number}", number, survey.site.landmarks))
    sessions = []
    for at, ref in refs:
        session, landmarks = read_mappable(at, ref, settings)
        sessions.append((session, map_all(session, landmarks, strict), read_station_track(ref.folder / TRACK_FILE)))
    return station_walks(sessions, frame.bcs_t_station, settings.labels.max_sigma_m)


def walk_of(walks: Sequence[PaperWalk], key: SessionKey) -> PaperWalk | None:
    """Find a walk by its session; None if there is none."""
    return next((walk for walk in walks if walk.key == key), None)
