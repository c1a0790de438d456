"""Scheduler, worker and client on hosts of their own, which share no folder: only the store's network reaches them."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.network_hosts import SSH_SERVER, Host, network_hosts, ssh_servers
from tests.stores import Bucket, bucket, wait_for
from tests.surveys import bytes_of, make_survey
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.run.output import LOGS
from vislam2tag.settings import Settings

pytest.importorskip("distributed")
PORT = 8786


class Hosts(NamedTuple):
    """Three hosts beside a store that has a survey."""

    s3: Bucket
    scheduler: Host
    worker: Host
    client: Host
    labels: dict[str, str]

    def process(self, out: str, *options: str) -> None:
        """Process on the client's host."""
        command = ("process", "s3://bucket/hosts/walks", "--out", f"s3://bucket/hosts/{out}", "--strategy")
        python = (sys.executable, "-m", "vislam2tag", *command, "local-corrected", "--executor", "dask")
        assert self.client.start(*python, *options).wait(timeout=300) == 0


@pytest.fixture(scope="module")
def hosts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hosts]:
    folder = tmp_path_factory.mktemp("hosts")
    with (
        network_hosts(tmp_path_factory.getbasetemp(), "scheduler", "worker", "client") as (here, made),
        bucket(here) as s3,
    ):
        local = make_survey(folder / "walks", devices=("LG",), seconds=60.0)
        process(local, folder / "labels", Settings(strategy="local-corrected"))
        s3.upload(local, "hosts/walks")
        scheduler, worker, client = made
        yield Hosts(s3, scheduler, worker, client, bytes_of(folder / "labels"))


def test_hosts_see_the_checkout_wherever_it_is_and_no_files_of_tests(hosts: Hosts, tmp_path: Path) -> None:
    seen = "import os, sys; sys.exit([os.path.exists(path) for path in sys.argv[1:]] != [True, False])"
    with tempfile.TemporaryDirectory() as checkout:
        assert hosts.worker.start(sys.executable, "-c", seen, checkout, tmp_path).wait(timeout=60) == 0


def test_processes_of_dask(hosts: Hosts, tmp_path: Path) -> None:
    address = f"tcp://{hosts.scheduler.address}:{PORT}"
    dask = (sys.executable, "-m")
    scheduler = hosts.scheduler.start(*dask, "distributed.cli.dask_scheduler", "--port", str(PORT), "--no-dashboard")
    wait_for(hosts.scheduler.address, PORT, scheduler)
    hosts.worker.start(*dask, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard")
    hosts.process("processes", "--scheduler", address)
    made_by_the_worker(hosts, "processes", tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(not SSH_SERVER.exists(), reason="sshd is not installed: apt-get install openssh-server")
def test_a_cluster_by_ssh(hosts: Hosts, tmp_path: Path) -> None:
    own = {name: value for name, value in os.environ.items() if name.startswith(("AWS_", "PYTHONPATH"))}
    with ssh_servers((hosts.scheduler, hosts.worker), own) as connect:
        file = Path(connect["known_hosts"]).with_name("cluster.toml")
        options = ", ".join(f"{name} = {toml_value(value)}" for name, value in connect.items())
        file.write_text(
            f'kind = "ssh"\n[options]\nhosts = ["{hosts.scheduler.address}", "{hosts.worker.address}"]\n'
            f'remote_python = "{sys.executable}"\nconnect_options = {{ {options} }}\n'
        )
        hosts.process("ssh", "--cluster", str(file))
    made_by_the_worker(hosts, "ssh", tmp_path)


def made_by_the_worker(hosts: Hosts, out: str, folder: Path) -> None:
    """The labels are as from disk to disk, and the worker's host made them."""
    assert bytes_of(hosts.s3.download(f"hosts/{out}", folder)) == hosts.labels
    store = hosts.s3.store(f"hosts/{out}")
    logs = [store.get(file.name) for file in store.list(LOGS)]
    lines = [json.loads(line) for log in logs if log is not None for line in log.data.splitlines()]
    assert {line["host"] for line in lines if "host" in line} == {"worker"}
