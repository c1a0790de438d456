"""Two walks of the campaign of benchmarks/floor_plan.py, and how it counts.

The building was chosen because both of its walks were placed when the test was written: of ten walks in five buildings
59 % of the frames had labels. A failure shows a change; the campaign measures the share.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from floor_plan import Found, Job, at_frames, jobs, measured, read, row

from vislam2tag.quality.evaluation.truth import Truth

SEED = 653
FOUND = Found("default_3min", "3 min 5-0", "abc", 4.0, 0.1, 500.0, 100, 50, 0.2, 0.4, 0.5, (30, 45), 10, 5, (1, 0))


@pytest.mark.slow
@pytest.mark.campaign
def test_walks_are_placed_on_their_plan_and_not_on_its_mirror_image() -> None:
    found = [one for number in (0, 1) for one in measured(Job("3 min", SEED, number, ("default_3min", "mirrored")))]
    right, mirrored = ([one for one in found if one.case == case] for case in ("default_3min", "mirrored"))
    assert sum(one.labelled for one in right) >= 0.65 * sum(one.frames for one in right)
    assert [one.wrong[1] for one in right] == [0, 0]
    assert [one.labelled for one in mirrored] == [0, 0]


def test_stretches_are_parts_of_the_true_way() -> None:
    seconds = np.arange(31)
    truth = Truth(seconds * 10**9, np.column_stack((seconds.clip(max=24.0), np.zeros(31))))
    true, stretch = at_frames(truth, np.array([0, 6, 18, 30]) * 10**9)
    assert true[:, 0] == pytest.approx([0, 6, 18, 24])
    assert stretch.tolist() == [0, 0, 1, 1]


def test_lines_of_other_code_and_cut_off_lines_do_not_count(tmp_path: Path) -> None:
    line = json.dumps(asdict(FOUND))
    (tmp_path / "results.jsonl").write_text(f"{line}\n{line.replace('abc', 'abd')}\n{line[:50]}\n{line}")
    assert [one.walk for one in read(tmp_path / "results.jsonl", "abc")] == [FOUND.walk]


def test_one_hall_is_enough_and_cases_of_a_survey_share_its_walks() -> None:
    planned = jobs(["default_3min", "mirrored", "hall"], range(5, 8), walks=2)
    assert [job.walk for job in planned if job.survey == "hall"] == ["hall 5-0"]
    assert {job.cases for job in planned if job.survey == "3 min"} == {("default_3min", "mirrored")}
    assert len(planned) == 7


def test_a_row_has_no_errors_of_a_wrong_plan() -> None:
    cells = ["2", "20", "50.0%", "0.20", "0.40", "10", "2", "0", "60.0%", "90.0%", "4.00", "40.0", "> 4096"]
    walks = [FOUND, replace(FOUND, memory_mb=np.inf)]
    assert row(walks, right=True).split(" | ") == cells
    cells[3:5] = cells[8:10] = ["-", "-"]
    assert row(walks, right=False).split(" | ") == cells
