from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.quality.evaluation.maps import straight_walk, without
from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import Status
from vislam2tag.quality.evaluation.metrics import summarise
from vislam2tag.quality.evaluation.trajectory_files import (
    find_truth,
    read_euroc,
    read_kitti,
    read_tum,
    tum_text,
    tum_text_of_truth,
)
from vislam2tag.quality.evaluation.truth import Truth, errors_at_frames

LATE_NS = 1_403_636_580_838_555_649
"""A time since 1970: a float of nanoseconds cannot hold it."""


def wavy_truth(count: int = 101, start_ns: int = 1_000_000_000) -> Truth:
    moments = np.linspace(0.0, 10.0, count)
    return Truth(start_ns + (moments * 1e9).astype(np.int64), np.column_stack((moments, np.sin(moments))))


def test_what_is_written_as_tum_is_read_back(tmp_path: Path) -> None:
    truth = wavy_truth()
    path = tmp_path / "truth.tum"
    path.write_text("# time x y z\n" + tum_text_of_truth(truth))
    read = read_tum(path)
    np.testing.assert_allclose(read.time_ns, truth.time_ns, atol=100)
    np.testing.assert_allclose(read.position_bcs, truth.position_bcs, atol=1e-6)


def test_only_labelled_frames_are_written_and_no_nanosecond_is_lost() -> None:
    walk = without(straight_walk(shift=(0.0, 0.5)), slice(1, 101), Status.BREAK)
    seconds, x, y, z, *turn = tum_text(walk).split()
    assert int(seconds.replace(".", "")) == walk.time_ns[0]
    assert (float(x), float(y), float(z)) == pytest.approx((0.0, 0.5, 0.0))
    assert turn == ["0.000000", "0.000000", "0.000000", "1.000000"]


def test_evo_finds_the_same_errors(tmp_path: Path) -> None:
    walk = without(straight_walk(shift=(0.1, -0.2)), slice(30, 50), Status.BREAK)
    truth = wavy_truth()
    ours = summarise(errors_at_frames(walk, truth))
    (tmp_path / "truth.tum").write_text(tum_text_of_truth(truth))
    (tmp_path / "walk.tum").write_text(tum_text(walk))
    evo_ape = Path(sys.executable).parent / "evo_ape"
    command = [str(evo_ape), "tum", "truth.tum", "walk.tum", "--project_to_plane", "xy", "--save_results", "ape.zip"]
    environment = os.environ | {"HOME": str(tmp_path), "MPLCONFIGDIR": str(tmp_path)}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, timeout=120)
    with zipfile.ZipFile(tmp_path / "ape.zip") as results:
        theirs = json.loads(results.read("stats.json"))
    assert ours.mean_m > 0.5
    found = (ours.mean_m, ours.median_m, ours.rmse_m, ours.max_m)
    assert found == pytest.approx([theirs[name] for name in ("mean", "median", "rmse", "max")], abs=1e-5)


def test_euroc_keeps_every_nanosecond(tmp_path: Path) -> None:
    path = tmp_path / "truth.euroc"
    path.write_text(f"#timestamp [ns], p_x, p_y, p_z, q_w\n{LATE_NS}, 1.5, -2, 3, 1, 0, 0, 0, 9, 9, 9\n")
    truth = read_euroc(path)
    assert truth.time_ns.tolist() == [LATE_NS]
    np.testing.assert_array_equal(truth.position_bcs, [[1.5, -2]])


def test_kitti_takes_its_times_from_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "truth.kitti"
    path.write_text("1 0 0 7.5 0 1 0 8.5 0 0 1 9\n1 0 0 8 0 1 0 9 0 0 1 9\n")
    with pytest.raises(SessionError, match=r"truth\.times"):
        read_kitti(path)
    path.with_suffix(".times").write_text("1e1\n")
    with pytest.raises(SessionError, match="1 times for the 2 poses"):
        read_kitti(path)
    path.with_suffix(".times").write_text("1e1\n10.5\n")
    truth = read_kitti(path)
    assert truth.time_ns.tolist() == [10_000_000_000, 10_500_000_000]
    np.testing.assert_array_equal(truth.position_bcs, [[7.5, 8.5], [8.0, 9.0]])


@pytest.mark.parametrize(
    ("read", "text", "message"),
    [
        (read_tum, "1 2 3 0 0 0 0 1\n2 2 3 0 0 0 1\n", r"truth:2: expected t tx ty tz"),
        (read_tum, "nan 2 3 0 0 0 0 1\n", r"truth:1: expected"),
        (read_tum, "1 2 nan 0 0 0 0 1\n", "no line has a finite position"),
        (read_euroc, "9e30, 2, 3, 0, 0, 0, 0, 1\n", "are not nanoseconds"),
        (read_tum, "# nothing\n", "contains no line"),
        (read_tum, f"{LATE_NS} 2 3 0 0 0 0 1\n", "whether they are nanoseconds"),
        (read_tum, "2 2 3 0 0 0 0 1\n1 2 3 0 0 0 0 1\n", "go backwards"),
        (read_euroc, "1 2 3 0 0 0 0 1\n", r"truth:1: expected time in ns"),
        (read_kitti, "1 0 0 1\n", r"truth:1: expected the 12 numbers"),
    ],
)
def test_other_files_are_refused_by_line(
    tmp_path: Path, read: Callable[[Path], Truth], text: str, message: str
) -> None:
    path = tmp_path / "truth"
    path.write_text(text)
    with pytest.raises(SessionError, match=message):
        read(path)


def test_of_equal_times_the_first_counts(tmp_path: Path) -> None:
    path = tmp_path / "truth.tum"
    path.write_text("1 2 3 0 0 0 0 1\n1 5 5 0 0 0 0 1\n2 4 4 0 0 0 0 1\n")
    assert find_truth(tmp_path, "truth") is not None
    assert read_tum(path).position_bcs.tolist() == [[2, 3], [4, 4]]


def test_the_programs_own_format_comes_first_and_none_is_none(tmp_path: Path) -> None:
    assert find_truth(tmp_path, "truth") is None
    (tmp_path / "truth.tum").write_text("no truth\n")
    (tmp_path / "truth.csv").write_text("time_ns,x,y\n5,1,2\n")
    truth = find_truth(tmp_path, "truth")
    assert truth is not None
    assert truth.time_ns.tolist() == [5]


def test_lines_where_motion_capture_saw_nothing_are_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "truth.tum"
    path.write_text("1 1 2 0 0 0 0 1\n# gap\n2 nan nan nan 0 0 0 1\n3 3 4 0 0 0 0 1\n4 1e300 0 0 0 0 0 1\n")
    truth = read_tum(path)
    assert truth.time_ns.tolist() == [1_000_000_000, 3_000_000_000]
    (finding,) = truth.findings
    assert (finding.kind, finding.file, finding.lines) == ("unusable_truth_rows", "truth.tum", (3, 5))
