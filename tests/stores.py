"""Object storage for tests: buckets on servers of their own; S3's counts requests and fails where it is told to."""

from __future__ import annotations

import base64
import hmac
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from email.utils import formatdate
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest

from tests.azurite import SERVER
from tests.gcs_server import command as gcs_server
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.store import Store, connection_to
from vislam2tag.pipeline.run.output import LOGS

HOST = "127.0.0.1"
ROOT = Path(__file__).parents[1]
SECRET = "a-secret-that-no-log-may-hold"
AZURE_SECRET = base64.b64encode(SECRET.encode()).decode()
_LONGEST_START_S = 120.0


@dataclass(frozen=True)
class Fault:
    """How the next ``times`` requests that match the expression ``request`` (``PUT /bucket/name``) are answered.

    ``answer`` is a status with its code, ``503 SlowDown``; or ``torn``: the connection ends before anything is done; or
    ``lost``: all is done and the connection ends before the answer; or ``silent``: nothing is answered for seconds.
    """

    request: str
    answer: str
    times: int = 1


@dataclass(frozen=True)
class Bucket:
    """A server with one bucket."""

    endpoint: str
    process: subprocess.Popen[bytes]
    address: str = "s3://bucket"

    def store(self, name: str) -> Store:
        return Store(f"{self.address}/{name}")

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
                store.fetch(file.name, Folder.at(folder), file.name)
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
    environment = {
        "AWS_ACCESS_KEY_ID": "someone",
        "AWS_SECRET_ACCESS_KEY": SECRET,
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": made.endpoint,
    }
    with _running(process, host, port, "AWS_", environment):
        made._request("PUT", "/bucket")
        yield made


@contextmanager
def azure_container() -> Iterator[Bucket]:
    """Start Azurite, point the environment at it, make the container; skips where it is not installed."""
    if not SERVER.exists():
        pytest.skip("Azurite is not installed: run make azurite (it needs npm)")
    port = free_port()
    options = (
        "--blobPort",
        str(port),
        "--inMemoryPersistence",
        "--silent",
        "--disableTelemetry",
        "--skipApiVersionCheck",
    )
    account = {"AZURITE_ACCOUNTS": f"someone:{AZURE_SECRET}"}
    process = subprocess.Popen([SERVER, *options], env={**os.environ, **account}, stdout=subprocess.DEVNULL)
    made = Bucket(f"http://{HOST}:{port}/someone", process, "az://container")
    environment = {
        "AZURE_STORAGE_ACCOUNT_NAME": "someone",
        "AZURE_STORAGE_ACCOUNT_KEY": AZURE_SECRET,
        "AZURE_STORAGE_ENDPOINT": made.endpoint,
    }
    with _running(process, HOST, port, "AZURE_", environment):
        urlopen(_signed(f"{made.endpoint}/container?restype=container")).close()
        yield made


@contextmanager
def google_bucket() -> Iterator[Bucket]:
    """Start fake-gcs-server, point the environment at it, make the bucket; skips where it is not installed."""
    port, behind = free_port(), free_port()
    server = subprocess.Popen(gcs_server(behind), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_for(HOST, behind, server)
        command = [sys.executable, "-m", "tests.gcs_server", str(port), str(behind)]
        made = Bucket(f"http://{HOST}:{port}", subprocess.Popen(command, cwd=ROOT), "gs://bucket")
        nobody = dict.fromkeys(("client_email", "private_key", "private_key_id"), "")
        account = json.dumps({"gcs_base_url": made.endpoint, "disable_oauth": True} | nobody)
        environment = {"GOOGLE_BASE_URL": made.endpoint, "GOOGLE_SERVICE_ACCOUNT_KEY": account}
        with _running(made.process, HOST, port, "GOOGLE_", environment):
            made._request("POST", "/storage/v1/b?project=none", b'{"name": "bucket"}')
            yield made
    finally:
        server.kill()
        server.wait()


@contextmanager
def _running(
    process: subprocess.Popen[bytes], host: str, port: int, prefix: str, environment: dict[str, str]
) -> Iterator[None]:
    """Let a server's variables be the only ones of their prefix as long as it runs."""
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in os.environ if name.startswith(prefix)]:
            patch.delenv(name)
        for name, value in environment.items():
            patch.setenv(name, value)
        connection_to.cache_clear()
        try:
            wait_for(host, port, process)
            yield
        finally:
            process.kill()
            process.wait()
            connection_to.cache_clear()


def _signed(url: str) -> Request:
    """The request that makes a container, which no client of ours does, with the signature of a shared key."""
    headers = {"x-ms-date": formatdate(usegmt=True), "x-ms-version": "2021-08-06"}
    parts = urlsplit(url)
    own = "".join(f"{name}:{value}\n" for name, value in headers.items())
    text = "PUT" + "\n" * 12 + f"{own}/someone{parts.path}\nrestype:container"
    signature = hmac.digest(base64.b64decode(AZURE_SECRET), text.encode(), "sha256")
    headers["Authorization"] = f"SharedKey someone:{base64.b64encode(signature).decode()}"
    return Request(url, method="PUT", headers=headers)


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
