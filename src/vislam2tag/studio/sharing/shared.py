"""What is given away of a survey, made beside it: a data set as by ``dataset``, a page as by ``studio --export``."""

from __future__ import annotations

import secrets
from pathlib import Path

from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import FiniteRecord
from vislam2tag.datasets.folder import is_dataset
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.labeling.results import RESULTS
from vislam2tag.pipeline.datasets.build import BuildOptions, SessionStep, build_dataset
from vislam2tag.pipeline.datasets.finish import PAGE_FILE
from vislam2tag.studio.sharing.export import EXPORT_FILE, export_survey
from vislam2tag.studio.workspace import Workspace, beside

DATASET, PAGE = "dataset", "page"


class SharedFolder(FiniteRecord):
    """A folder that can be given away."""

    folder: str
    file: str
    """What in it a browser opens."""
    files: int
    size_bytes: int
    stale: bool
    """Labels have been made since."""


class SharedView(FiniteRecord):
    """What was made of the survey; None where nothing was."""

    dataset: SharedFolder | None
    page: SharedFolder | None


def make_dataset(
    workspace: Workspace, no_ssid: bool, hash_bssid: bool, jobs: int, progress: Progress[SessionStep] = silent
) -> None:
    """Make the data set, after the labels where these are old; addresses are hashed with a key that nobody keeps.

    Raises what ``vislam2tag dataset`` raises.
    """
    settings = workspace.settings
    options = BuildOptions(
        labels=workspace.out,
        labelling=settings,
        walkable=settings.walkable,
        privacy=Privacy(hash_key=secrets.token_bytes(32) if hash_bssid else None, keep_ssids=not no_ssid),
    )
    build_dataset(
        workspace.root, beside(workspace.root, DATASET), settings.dataset, options, jobs=jobs, progress=progress
    )


def make_page(workspace: Workspace, progress: Progress[str] = silent) -> None:
    """Make the page; raises what ``vislam2tag studio --export`` raises."""
    export_survey(workspace, beside(workspace.root, PAGE), progress=progress)


def shared_view(workspace: Workspace) -> SharedView:
    """What lies beside the survey."""
    dataset, page = (beside(workspace.root, name) for name in (DATASET, PAGE))
    results = (workspace.out / RESULTS).glob("*.json")
    newest_ns = max((file.stat().st_mtime_ns for file in results), default=0)
    return SharedView(
        dataset=_shared(dataset, PAGE_FILE, newest_ns) if is_dataset(dataset) else None,
        page=_shared(page, "index.html", newest_ns) if (page / EXPORT_FILE).is_file() else None,
    )


def _shared(folder: Path, file: str, newest_ns: int) -> SharedFolder:
    found = [path.stat() for path in folder.rglob("*") if path.is_file()]
    return SharedFolder(
        folder=str(folder),
        file=file,
        files=len(found),
        size_bytes=sum(stat.st_size for stat in found),
        stale=(folder / file).stat().st_mtime_ns < newest_ns,
    )
