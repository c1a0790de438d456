"""Object storage for tests: a bucket on a server of its own, which counts requests and fails where it is told to."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.request import Request, urlopen

import pytest

from vislam2tag.common.files.store import Store
from vislam2tag.pipeline.run.output_store import LOGS

HOST = "127.0.0.1"
ROOT = Path(__file__).parents[1]
SECRET = "a-secret-that-no-log-may-hold"
_LONGEST_START_S = 120.0


@dataclass(frozen=True)
class Fault:
    """How the next ``times`` requests that match the expression ``request`` (``PUT /bucket/name``) are answered.

    ``answer`` is a status with its code, ``503 SlowDown``; or ``torn``: the connection ends before anything is done; or
    ``lost``: all is done and the connection ends before the answer.
    """

    request: str
    answer: str
    times: int = 1


@dataclass(frozen=True)
class Bucket:
    """A server with one bucket."""

    endpoint: str
    process: subprocess.Popen[bytes]

    def store(self, name: str) -> Store:
        return Store(f"s3://bucket/{name}")

    def upload(self, folder: Path, name: str) -> Path:
        """Copy a folder into the bucket; return its address as a path."""
        store = self.store(name)
        for file in folder.rglob("*"):
            if file.is_file():
                store.put(file.relative_to(folder).as_posix(), file)
        return Path(store.address)

    def download(self, name: str, folder: Path) -> Path:
        """Copy a folder of the bucket, without the logs of single sessions."""
        store = self.store(name)
        for file in store.list():
            if not file.name.startswith(f"{LOGS}/"):
                (folder / file.name).parent.mkdir(parents=True, exist_ok=True)
                store.fetch(file.name, folder / file.name)
        return folder

    def fail(self, *faults: Fault) -> None:
        """Let requests go wrong from now on; none: no more."""
        self._request("POST", "/__faults", json.dumps([asdict(fault) for fault in faults]).encode())

    def seen(self) -> list[str]:
        """Requests since this was asked last."""
        requests: list[str] = json.loads(self._request("GET", "/__seen"))
        return requests

    def _request(self, method: str, path: str, data: bytes | None = None) -> bytes:
        with urlopen(Request(self.endpoint + path, method=method, data=data)) as answer:
            content: bytes = answer.read()
            return content


@contextmanager
def bucket(host: str = HOST) -> Iterator[Bucket]:
    """Start a server, point the environment at it, make the bucket."""
    port = free_port(host)
    process = subprocess.Popen([sys.executable, "-m", "tests.store_server", str(port), host], cwd=ROOT)
    made = Bucket(f"http://{host}:{port}", process)
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in os.environ if name.startswith("AWS_")]:
            patch.delenv(name)
        patch.setenv("AWS_ACCESS_KEY_ID", "someone")
        patch.setenv("AWS_SECRET_ACCESS_KEY", SECRET)
        patch.setenv("AWS_REGION", "us-east-1")
        patch.setenv("AWS_ENDPOINT_URL", made.endpoint)
        try:
            wait_for(host, port, process)
            made._request("PUT", "/bucket")
            yield made
        finally:
            process.kill()
            process.wait()


def free_port(host: str = HOST) -> int:
    with socket.socket() as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
        return port


def wait_for(host: str, port: int, process: subprocess.Popen[bytes]) -> None:
    """Wait until a server answers; fails where its process ends."""
    deadline = time.monotonic() + _LONGEST_START_S
    while time.monotonic() < deadline:
        assert process.poll() is None, "the server ended"
        try:
            socket.create_connection((host, port)).close()
            return
        except OSError:
            time.sleep(0.05)
    raise AssertionError("the server does not answer")
