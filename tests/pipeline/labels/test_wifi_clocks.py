"""Scans that are late on all walks of a phone, on all phones or on one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from vislam2tag.common.findings import FaultKind
from vislam2tag.pipeline.labels.diagnose import diagnose
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import simulate

LATE_S = 5.0


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("clocks") / "survey"
    simulate(regular_survey(5, "default", (0,), sessions=2), root)
    return root


@pytest.mark.slow
@pytest.mark.parametrize("late", [(), ("LG",), ("LG", "OnePlus")])
def test_scans_of_a_phone_that_are_late_are_named_by_as_much(
    survey: Path, tmp_path: Path, late: tuple[str, ...]
) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    entries = (f'[[shift_clock]]\ndevice = "{device}"\ntable = "wifi"\noffset_s = {LATE_S}\n' for device in late)
    (copy / "corrections.toml").write_text("".join(entries))
    clocks = [fault for fault in diagnose(copy).faults if fault.kind is FaultKind.CLOCK]
    told = {entry.values["device"]: entry.values["offset_s"] for fault in clocks for entry in fault.corrections}
    assert told == pytest.approx(dict.fromkeys(late, -LATE_S), abs=0.7)
