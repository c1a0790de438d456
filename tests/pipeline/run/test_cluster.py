"""Clusters: what their file may say, and what each kind's class of Dask is asked for."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.pipeline.run import dask as module
from vislam2tag.pipeline.run.dask import cluster_of, connected, read_cluster


def described(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "cluster.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "pbs"', "kind: Input should be 'local', 'ssh' or 'slurm'"),
        ('kind = ["slurm"]', "kind: Input should be 'local', 'ssh' or 'slurm'"),
        (
            'kind = "kubernetes"\nworkers = 3',
            "the cluster kind kubernetes was removed; use one Kubernetes Job for each survey, see "
            "`vislam2tag docs how-to/many-surveys`",
        ),
        ('kind = "local"\nworkers = 0', "workers: Input should be greater than or equal to 1"),
        ('kind = "local"\nworker = 2', "worker: "),
        ("kind = ", "the cluster file cannot be read"),
    ],
)
def test_a_file_that_cannot_be_used_is_told_by_entry(tmp_path: Path, text: str, said: str) -> None:
    file = described(tmp_path, text)
    with pytest.raises(UsageError) as told:
        read_cluster(file)
    assert str(told.value).startswith(f"{file}: {said}")


def test_slurm_is_asked_by_its_interface(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def make(**given: object) -> SimpleNamespace:
        asked["made"] = given
        return SimpleNamespace(scale=lambda **given: asked.update(scaled=given))

    fake = ModuleType("dask_jobqueue")
    monkeypatch.setattr(fake, "SLURMCluster", make, raising=False)
    monkeypatch.setitem(sys.modules, "dask_jobqueue", fake)
    text = 'kind = "slurm"\nworkers = 40\n[options]\nqueue = "long"\nmemory = "4GB"\nwalltime = "04:00:00"'
    cluster_of(read_cluster(described(tmp_path, text)))
    arguments = {"cores": 2, "processes": 1, "job_cpu": 1, "queue": "long", "memory": "4GB", "walltime": "04:00:00"}
    assert asked == {"made": arguments, "scaled": {"jobs": 40}}


def test_slurm_is_handed_scripts_that_start_a_worker_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By dask-jobqueue itself; in the place of Slurm's own commands stand some that keep what they are given."""
    for name, does in (("sbatch", f'cp "$1" {tmp_path}/job.$$ && echo Submitted batch job $$'), ("scancel", ":")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{does}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    options = 'queue = "long"\nmemory = "4GB"\nwalltime = "04:00:00"\ninterface = "lo"'
    options += '\nscheduler_options = { dashboard_address = ":0" }'
    with cluster_of(read_cluster(described(tmp_path, f'kind = "slurm"\nworkers = 2\n[options]\n{options}'))) as made:
        deadline = time.monotonic() + 60
        while len(list(tmp_path.glob("job.*"))) < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
        address = made.scheduler_address
    scripts = [path.read_text().splitlines() for path in tmp_path.glob("job.*")]
    assert len(scripts) == 2
    asked = {"-p long", "-n 1", "--cpus-per-task=1", "--mem=4G", "-t 04:00:00"}
    for script in scripts:
        assert {f"#SBATCH {option}" for option in asked} <= set(script)
        assert f"-m distributed.cli.dask_worker {address} " in script[-1]
        assert "--nthreads 2 --memory-limit 3.73GiB --nanny" in script[-1]


def test_a_package_that_lacks_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    file = described(tmp_path, 'kind = "slurm"')
    with (
        pytest.raises(
            UsageError, match="a cluster of the kind slurm needs the package dask-jobqueue; install it with pip"
        ),
        connected(None, file, print),
    ):
        pass


def test_a_scheduler_that_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CONNECT_S", 0.5)
    with (
        pytest.raises(OutputError, match=r"tcp://127\.0\.0\.1:9: no Dask scheduler answers"),
        connected("tcp://127.0.0.1:9", None, print),
    ):
        pass


@pytest.mark.parametrize(("scheduler", "file"), [(None, None), ("tcp://a:1", Path("cluster.toml"))])
def test_one_of_scheduler_and_cluster_is_needed(scheduler: str | None, file: Path | None) -> None:
    with (
        pytest.raises(UsageError, match="needs either --scheduler ADDRESS or --cluster FILE"),
        connected(scheduler, file, print),
    ):
        pass
