"""Trajectories in the TUM format, one file for each session, from the output of ``process``."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding, finding_if
from vislam2tag.core.status import has_position
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.datasets.writing import UNMAPPED, shared_labels
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY, trajectory_of
from vislam2tag.quality.evaluation.trajectory_files import covariance_text, tum_text

HOLDS = {
    TRAJECTORY: (
        *("time_ns", "x", "y", "z", "qx", "qy", "qz", "qw", "cov_xx", "cov_xy", "cov_yy"),
        *("session", "device", "floor"),
    )
}


def write(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write the frames that have a position; sessions without any are skipped and counted.

    Raises DatasetError if ``labels`` is not a finished output of ``process``, or no session has a position.
    """
    opened, left_out = shared_labels(labels, context)
    sessions = opened.sessions
    unmapped = 0
    for session in sessions:
        unmapped += not _write(session, folder)
        context.progress(session.slug, len(sessions))
    if unmapped == len(sessions):
        raise DatasetError(f"{labels}: none of its sessions has a position; report.html gives the reason")
    return (*left_out, *finding_if(unmapped, "unmapped_sessions", UNMAPPED))


def _write(session: LabelledSession, folder: Folder) -> bool:
    trajectory = trajectory_of(session.table(TRAJECTORY, SCHEMAS[TRAJECTORY]))
    if not has_position(trajectory.status).any():
        return False
    folder.write(f"{session.slug}.tum", tum_text(trajectory))
    folder.write(f"{session.slug}_covariance.txt", covariance_text(trajectory))
    return True


register(writes=ExportFormat("tum", HOLDS, write_labels=write))
