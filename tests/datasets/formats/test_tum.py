"""TUM trajectories, read by evo."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from evo.tools import file_interface  # type: ignore[import-untyped]

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ExportContext, export_named
from vislam2tag.datasets.labelled import open_labelled

COVARIANCE = ("cov_xx", "cov_xy", "cov_yy")


def with_covariances(labels: Path) -> Path:
    """Give each frame of labels a covariance, which their strategy leaves out."""
    for file in (labels / "trajectory").iterdir():
        table = pl.read_parquet(file)
        rising = pl.int_range(pl.len()).cast(pl.Float64) * 1e-6
        table.with_columns(cov_xx=rising + 0.04, cov_xy=-rising, cov_yy=rising + 0.01).write_parquet(file)
    return labels


def exported(labels: Path, folder: Path) -> tuple[Finding, ...]:
    writer = export_named("tum").write_labels
    assert writer is not None
    return writer(labels, Folder.at(folder), ExportContext())


def test_evo_reads_every_walk(labels: Path, tmp_path: Path) -> None:
    shutil.copytree(labels, tmp_path / "labels")
    labels = with_covariances(tmp_path / "labels")
    assert exported(labels, tmp_path / "out") == ()
    sessions = open_labelled(labels).sessions
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == sorted(
        f"{each.slug}{end}" for each in sessions for end in (".tum", "_covariance.txt")
    )
    for session in sessions:
        known = session.table("trajectory", ("time_ns", "x", "y", "qw", *COVARIANCE)).filter(pl.col("x").is_not_null())
        read = file_interface.read_tum_trajectory_file(str(tmp_path / "out" / f"{session.slug}.tum"))
        assert read.num_poses == len(known) > 100
        assert read.positions_xyz[:, :2] == pytest.approx(known.select("x", "y").to_numpy(), abs=1e-6)
        assert read.timestamps * 1e9 == pytest.approx(known["time_ns"].to_numpy(), abs=1e5)
        covariance = np.loadtxt(tmp_path / "out" / f"{session.slug}_covariance.txt")
        assert covariance[:, 0] == pytest.approx(read.timestamps)
        assert covariance[:, 1:] == pytest.approx(known.select(COVARIANCE).to_numpy(), rel=1e-6)
        assert read.orientations_quat_wxyz[:, 0] == pytest.approx(known["qw"].to_numpy(), abs=1e-6)


def test_a_walk_without_a_position_is_counted_and_none_is_an_error(labels: Path, tmp_path: Path) -> None:
    shutil.copytree(labels, tmp_path / "labels")
    for number, file in enumerate(sorted((tmp_path / "labels" / "trajectory").iterdir())):
        table = pl.read_parquet(file).with_columns(status=pl.lit("no_mapping"))
        table.write_parquet(file)
        if number == 0:
            findings = exported(tmp_path / "labels", tmp_path / "some")
            assert [(finding.kind, finding.count) for finding in findings] == [("unmapped_sessions", 1)]
    with pytest.raises(DatasetError, match="none of its sessions has a position"):
        exported(tmp_path / "labels", tmp_path / "none")
