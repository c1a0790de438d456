from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.maps import straight_walk, without
from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import Status
from vislam2tag.evaluation.truth import Truth, errors_at_frames, errors_at_truth, read_truth


def truth_along_x(seconds: list[float]) -> Truth:
    moments = np.array(seconds)
    return Truth((1_000_000_000 + moments * 1e9).astype(np.int64), np.column_stack((moments, np.zeros(len(moments)))))


def test_reads_what_the_simulator_and_the_real_walks_have(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text("time_ns,x,y,z,floor\n20,3,4,1,0\n10,1.5,2,1,0\n20,3,4,1,0\n")
    truth = read_truth(path)
    assert truth.time_ns.tolist() == [10, 20]
    np.testing.assert_array_equal(truth.position_bcs, [[1.5, 2], [3, 4]])
    path.write_text("time_ns,x,y\n5,1,2\n")
    assert len(read_truth(path).time_ns) == 1


@pytest.mark.parametrize("content", ["", "t,x,y\n1,2,3\n", "time_ns,x,y\n1,a,3\n"])
def test_another_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(content)
    with pytest.raises(SessionError, match=r"truth\.csv: expected"):
        read_truth(path)


def test_errors_at_truth_interpolate_the_labels() -> None:
    walk = without(straight_walk(shift=(0.3, 0.4)), slice(50, 60), Status.BREAK)
    errors = errors_at_truth(walk, truth_along_x([1.0, 2.55, 5.5, 20.0]))
    np.testing.assert_allclose(errors, [0.5, 0.5, np.nan, np.nan], atol=1e-9)


def test_errors_at_frames_interpolate_the_truth() -> None:
    walk = without(straight_walk(shift=(0.0, 2.0)), slice(0, 20), Status.BEFORE_FIRST_LANDMARK)
    errors = errors_at_frames(walk, truth_along_x([1.0, 4.0, 8.0]))
    assert np.isnan(errors[:20]).all()
    assert np.isnan(errors[81:]).all()
    np.testing.assert_allclose(errors[20:81], 2.0)
