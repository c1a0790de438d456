"""Whether one walk contradicts its landmark table: what a diagnosis of the survey would find from it alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from vislam2tag.common.findings import FaultKind, Finding, Severity, counted
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.pipeline.labels.survey_evidence import faults_of, kept_walk, passes_record
from vislam2tag.quality.diagnosis.evidence import Evidence, PlacedWalk
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.search import LEAST_GAIN
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.site.model import Survey

_TABLE = "landmarks"
_WHOLE = (FaultKind.MIRRORED, FaultKind.UNITS, FaultKind.SHIFTED_IDS)
"""Faults of a whole table, with which every position is wrong."""
_CURES = {
    FaultKind.MIRRORED: "Check whether its columns x and y are exchanged, or one axis points the other way",
    FaultKind.UNITS: "Convert its coordinates to metres",
}
MIN_LANDMARKS = 4
"""Of fewer landmarks a right walk with a poor tracker may fit none."""
MIN_FITS = 0.5
"""With a right table at least this share of a walk's observations fits."""


def contradicted(prepared: PreparedSession, walk: LabelledWalk, range_m: float) -> tuple[LabelledWalk, list[Finding]]:
    """Diagnose a mapped walk; if its landmark table is wrong as a whole, no frame stays ``ok``.

    ``range_m`` is that of sightings, metres. Faults of single landmarks are only reported.
    """
    record = passes_record(prepared, range_m)
    if record is None:
        return walk, []
    ref = prepared.task.ref
    faults, evidence = faults_of(Survey(Path(), prepared.task.site, (ref,), ()), [kept_walk(ref.key, record)])
    whole = any(fault.kind in _WHOLE for fault in faults)
    findings = [_finding(fault) for fault in faults if fault.kind not in (FaultKind.SHIFTED_IDS, FaultKind.PLANNED)]
    if not whole:
        misfits = _misfits(evidence.walks[0])
        findings += misfits
        whole = bool(misfits)
    if not findings and (walk.mapped.status == Status.OK).any():
        findings = _unverified(evidence)
    return (_none_ok(walk) if whole else walk), findings


def _finding(fault: Fault) -> Finding:
    cure = _CURES.get(fault.kind, "Correct the table")
    severity = Severity.ERROR if fault.kind in _WHOLE else Severity.WARNING
    message = f"{fault.summary}: {fault.evidence}. {cure}"
    return Finding(kind="survey_fault", file=_TABLE, count=1, message=message, severity=severity)


def _misfits(walk: PlacedWalk) -> list[Finding]:
    """Report that a walk contradicts most of its landmarks, without a fault that would explain it."""
    known = np.isfinite(walk.target)
    fits, count = int(walk.alignment.fits[known].sum()), int(known.sum())
    landmarks = len({walk.marks[i] for i in np.flatnonzero(known)})
    if landmarks < MIN_LANDMARKS or fits >= MIN_FITS * count:
        return []
    message = (
        f"the walk contradicts its landmark table: {fits} of {counted(count, 'observation')} of "
        f"{counted(landmarks, 'landmark')} fit. Check the table's positions, and whether its ids are those of the walk"
    )
    return [Finding(kind="walk_contradicts_table", file=_TABLE, count=count, message=message, severity=Severity.ERROR)]


def _unverified(evidence: Evidence) -> list[Finding]:
    """Report that the walk would fit a mirrored table as well, as with two landmarks, or with all on one line."""
    mirrored = evidence.with_targets({0: evidence.walks[0].target.conj()}).walks[0]
    if mirrored.alignment.cost - evidence.walks[0].alignment.cost >= LEAST_GAIN:
        return []
    message = (
        "the landmark table could not be verified: the walk would fit one with x and y exchanged equally well, because "
        "its landmarks are too few or on one line. Check the path with plot(), or pass more landmarks"
    )
    return [Finding(kind="table_not_verified", file=_TABLE, count=1, message=message, severity=Severity.INFO)]


def _none_ok(walk: LabelledWalk) -> LabelledWalk:
    return replace(walk, mapped=_uncertain(walk.mapped), trajectory=_uncertain(walk.trajectory))


def _uncertain(trajectory: Trajectory) -> Trajectory:
    status = np.where(trajectory.status == Status.OK, np.int8(Status.UNCERTAIN), trajectory.status).astype(np.int8)
    return replace(trajectory, status=status)
