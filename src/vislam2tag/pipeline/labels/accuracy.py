"""A session's labels against what is known of the truth; nothing here is ever used to map."""

from __future__ import annotations

import hashlib
from pathlib import Path

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.labeling.settings import USUAL_TRUTH, TruthSettings
from vislam2tag.quality.evaluation.reliability import reduce_errors
from vislam2tag.quality.evaluation.truth import (
    CONTROL_POINTS,
    MAX_GAP_S,
    Residuals,
    read_truth,
    residuals_at_presses,
    residuals_at_truth,
)
from vislam2tag.site.model import Floor

TRUTH_FILE = "truth.csv"
_UNREADABLE = (
    "expected a table with the header time_ns,x,y and a number in each of these; the session's errors are not known: "
    "correct or remove it"
)


def truth_mark(folder: Path) -> str:
    """Tell one truth of a session from another: the SHA-256 of its file; empty where none can be read."""
    try:
        return hashlib.sha256(read_bytes(folder / TRUTH_FILE)).hexdigest()
    except OSError:
        return ""


def error_record(
    folder: Path, trajectory: Trajectory, presses_ns: IntArray, floor: Floor, settings: TruthSettings = USUAL_TRUTH
) -> tuple[ErrorRecord | None, list[Finding]]:
    """Errors at ``truth.csv`` in the session's folder, else at the presses (k,) on the session's ``floor``.

    A press counts as its distance to the nearest control point there. None where neither is there; a truth file that
    cannot be read is a finding.
    """
    findings = []
    if (folder / TRUTH_FILE).is_file():
        try:
            truth = read_truth(folder / TRUTH_FILE)
            return _counted(TRUTH_FILE, residuals_at_truth(trajectory, truth, settings)), list(truth.findings)
        except SessionError:
            findings.append(Finding(kind="unreadable_truth", file=TRUTH_FILE, count=1, message=_UNREADABLE))
    presses_ns = _on_floor(floor.number, trajectory, presses_ns)
    if not len(presses_ns) or not len(floor.control_points.ids):
        return None, findings
    at_presses = residuals_at_presses(trajectory, presses_ns, floor.control_points.position_bcs, settings)
    return _counted(CONTROL_POINTS, at_presses), findings


def _counted(source: str, found: Residuals) -> ErrorRecord:
    return reduce_errors(source, found.error_m, found.covariance_m2, found.truth_covariance_m2)


def _on_floor(number: int, trajectory: Trajectory, presses_ns: IntArray) -> IntArray:
    """Keep the presses (k,) made on this floor, which is the session's own."""
    where = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S).floor
    return presses_ns[where == number] if len(where) else presses_ns
