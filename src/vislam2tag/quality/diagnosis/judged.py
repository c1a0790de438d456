"""Whether walks could show that something is wrong with a survey, and how much of it they cover."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.judgement import Answer, Judgement, counted, none_mapped
from vislam2tag.quality.diagnosis.evidence import MIN_OTHERS, Evidence, Mark

NO_SESSION = "the survey has no session that is not excluded"
MIN_FIXES = 3
"""Known positions of a walk without poses: of fewer the others do not show which one is wrong."""
_TOO_FEW = f"no walk passes {MIN_OTHERS + 1} surveyed landmarks, and one shows nothing without the others"


def judgement_of(evidence: Evidence, sessions: int, failed: int, faults: int, fixes: int = 0) -> Judgement:
    """The answer of a diagnosis of so many sessions; ``fixes`` are known positions compared in walks without poses."""
    if not sessions:
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=NO_SESSION)
    marks = [known for walk in evidence.walks if len(known := _known(walk.marks, walk.target)) > MIN_OTHERS]
    judged = {mark for known in marks for mark in known}
    parts = [f"{counted(len(judged), 'landmark')} in {counted(len(marks), 'walk')}"] if judged else []
    parts += [counted(fixes, "known position")] if fixes else []
    if not parts:
        return Judgement.of(faults, 0, "", none_mapped(sessions) if failed == sessions else _TOO_FEW)
    return Judgement.of(faults, len(parts), " and ".join(parts), _rest(evidence, judged, failed))


def _known(marks: tuple[Mark, ...], target: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> set[Mark]:
    return {marks[i] for i in np.flatnonzero(np.isfinite(target)).tolist()}


def _rest(evidence: Evidence, judged: set[Mark], failed: int) -> str:
    """What is left out of the answer."""
    missed = len(evidence.table.place.keys() - judged)
    parts = [f"{counted(missed, 'landmark')} could not be judged, no walk passes enough others there"] if missed else []
    parts += [f"{counted(failed, 'session')} cannot be read or mapped"] if failed else []
    return "; ".join(parts)
