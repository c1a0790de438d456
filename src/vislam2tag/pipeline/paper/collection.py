"""The paper's own data set (section VII): the walks that were made to collect fingerprints, labelled and counted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.progress import Progress, silent
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
from vislam2tag.pipeline.paper.data import PaperData
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.model import SessionKey, Survey

STRATEGY = "local-corrected"
"""The strategy that labelled giaIndoorLoc."""
EVALUATED = ("_ref", "_tachy", "_split")
"""Device folders of the published evaluation end like this; their walks collect nothing."""


@dataclass(frozen=True)
class Collection:
    """What the collecting walks give, and one sentence for each that could not be labelled."""

    statistics: DatasetStatistics | None
    """None where there is no such walk, or none heard any Wi-Fi."""
    failed: tuple[str, ...]


def paper_collection(
    data: PaperData,
    settings: ProcessSettings,
    progress: Progress[int] = silent,
    keep: Path | None = None,
) -> Collection:
    """Label the walks of all devices that do not evaluate, group their Wi-Fi readings by scan, and count.

    The data set is written to ``keep``, with its splits, where there is such a walk.
    """
    own = settings.model_copy(update={"strategy": STRATEGY})
    chosen = [(survey, devices) for survey in data.surveys if (devices := _devices(survey))]
    total = sum(ref.key.device in devices for survey, devices in chosen for ref in survey.sessions)
    done = 0

    def advance(_outcome: object, _total: int) -> None:
        nonlocal done
        progress(done := done + 1, total)

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
    """Devices with a walk to label that is no evaluation's."""
    corrections = read_corrections(survey.root)
    keys = [ref.key for ref in survey.sessions if not corrections.excludes(ref.key)]
    return tuple(sorted({key.device for key in keys if not key.device.endswith(EVALUATED)}))


def _distinct_sessions(surveys: list[LabelledSurvey]) -> Iterator[tuple[LabelledSession, float]]:
    """Each session with its survey's limit of sigma; where two surveys hold one session, the first counts."""
    found: set[SessionKey] = set()
    for survey in surveys:
        for session in survey.sessions:
            result = session.result()
            key = SessionKey(result.floor, result.device, result.session)
            if key not in found:
                found.add(key)
                yield session, survey.max_sigma_m


def _dataset(sessions: list[tuple[LabelledSession, float]], folder: Folder) -> Dataset:
    """Make fingerprints of the sessions; the tables lie below ``folder``."""
    for number, (session, max_sigma_m) in enumerate(sessions):
        build_session(SessionJob(session, f"{number:06d}", "", number, folder, DatasetSettings(), max_sigma_m))
    tables = {name: rows for name, rows in tables_of(folder.path).items() if name in (FINGERPRINTS, READINGS, SESSIONS)}
    access_points = access_points_of(folder.path, tables[FINGERPRINTS], tables[READINGS]).lazy()
    return Dataset(DatasetInfo(name="giaIndoorLoc", floors=()), tables | {ACCESS_POINTS: access_points})
