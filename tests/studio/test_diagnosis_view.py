"""Faults of an earlier search that are still open are an answer, whatever the labels or their absence say."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vislam2tag.common.judgement import Answer, Judgement
from vislam2tag.diagnosis.record import Diagnosis, Fault, FaultKind
from vislam2tag.studio import corrections_view
from vislam2tag.studio.outputs import LABELS

FAULT = Fault(kind=FaultKind.PLANNED, floor=0, summary="a landmark is only planned", evidence="its table")
SOUND = Judgement(answer=Answer.NOTHING_WRONG, looked_at="3 landmarks in 1 walk")


def workspace_of(root: Path, *, labelled: bool, faults: list[Fault]) -> Any:
    """A workspace whose survey has changed since the last search."""
    landmarks = SimpleNamespace(ids=(), floor=np.zeros(0, dtype=np.int64), position_bcs=np.zeros((0, 2)))
    survey = SimpleNamespace(sessions=[], site=SimpleNamespace(landmarks=landmarks))
    return SimpleNamespace(
        root=root,
        out=root / "labels",
        now=SimpleNamespace(survey=survey, corrections=None, id_of_key={}),
        diagnosis=(Diagnosis(faults=faults), "before"),
        outputs={LABELS: SimpleNamespace(stamp=lambda: "made" if labelled else "")},
        refresh=lambda: SimpleNamespace(sessions="now"),
    )


@pytest.mark.parametrize("labelled", [False, True])
def test_open_faults_are_something_wrong(labelled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(corrections_view, "kept_faults", lambda *_: ([], SOUND))
    view = corrections_view.Diagnoses(workspace_of(tmp_path, labelled=labelled, faults=[FAULT])).view()
    assert [fault.kind for fault in view.faults] == ["planned"]
    assert view.judgement.answer is Answer.WRONG
    none = corrections_view.Diagnoses(workspace_of(tmp_path, labelled=labelled, faults=[])).view()
    assert none.judgement.answer is (Answer.NOTHING_WRONG if labelled else Answer.NOT_LOOKED_AT)
