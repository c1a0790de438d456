"""A fleet on a Dask cluster, a worker of which is killed meanwhile: labels, tables and pages as from one process."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.dask_processes import dask_processes
from tests.pipeline.fleet.conftest import SmallFleet
from tests.surveys import bytes_of
from vislam2tag.pipeline.fleet.add import add_surveys
from vislam2tag.pipeline.fleet.process import FleetOutcome, process_fleet
from vislam2tag.pipeline.run.dask import DaskExecutor, connected
from vislam2tag.settings import Settings

pytest.importorskip("distributed")


def test_a_fleet_on_a_cluster_is_as_from_one_process(fleet: SmallFleet, tmp_path: Path) -> None:
    other = Path(fleet.s3.store("dask/small-fleet").address)
    add_surveys(other, list(fleet.surveys.values()))
    told: list[FleetOutcome] = []
    with dask_processes(workers=2) as cluster, connected(cluster.address, None, lambda _: None) as client:

        def note(outcome: FleetOutcome, _: int) -> None:
            told.append(outcome)
            if len(told) == 1:
                cluster.kill_worker()

        executor = DaskExecutor(client, lambda _: None)
        totals = process_fleet(other, lambda _: Settings(strategy="local-corrected"), executor=executor, progress=note)
    assert (totals.states, totals.failed) == ({"done": 2}, 0)
    assert len(told) == 4 + 2, "each session and each survey once"
    for part in ("labels/hall", "labels/ward", "tables", "report"):
        alone = bytes_of(fleet.s3.download(f"{fleet.name}/{part}", tmp_path / "alone" / part))
        assert bytes_of(fleet.s3.download(f"dask/small-fleet/{part}", tmp_path / part)) == alone
        assert alone
