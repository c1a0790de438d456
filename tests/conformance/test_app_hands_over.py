"""The app's own upload code against `vislam2tag receive`, over loopback."""

from __future__ import annotations

import http.client
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from tests.conformance.java import compiled_core
from tests.receiving.zips import SESSION, digest, session_files, session_zip

CLIENT = "org.vislam2tag.tools.UploadMain"
PLACE = f"floor_4/LG/{SESSION}"
NOISE = random.Random(1).randbytes(3_000_000).hex().encode()


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_core(tmp_path_factory.mktemp("core"))


@pytest.fixture
def zipped(tmp_path: Path) -> Path:
    path = tmp_path / f"{SESSION}.zip"
    path.write_bytes(session_zip({**session_files(), "Sensors.csv": b"time_ns\n" + NOISE + b"\n"}))
    return path


@contextmanager
def receiving(survey: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A running `vislam2tag receive`, and the link that it shows."""
    survey.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "vislam2tag", "receive", str(survey), "--host", "127.0.0.1", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            link = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+#[A-Z2-7]{16}", line)))
            yield link, server
        finally:
            server.kill()


def hand_over(core: Path, link: str, zipped: Path) -> subprocess.CompletedProcess[str]:
    command = ["java", "-cp", str(core), CLIENT, link, str(zipped)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_session_is_handed_over_whole(core: Path, zipped: Path, tmp_path: Path) -> None:
    with receiving(tmp_path / "survey") as (link, _):
        for _ in ("new", "there already"):
            done = hand_over(core, link, zipped)
            assert (done.returncode, done.stdout, done.stderr) == (0, PLACE + "\n", "")
    assert (tmp_path / "survey" / PLACE / "Sensors.csv").read_bytes() == b"time_ns\n" + NOISE + b"\n"


def test_it_goes_on_after_the_computer_was_switched_off(core: Path, zipped: Path, tmp_path: Path) -> None:
    data = zipped.read_bytes()
    half = len(data) // 2
    with receiving(tmp_path / "survey") as (link, server):
        address, token = urlsplit(link).netloc, urlsplit(link).fragment
        sizes = {"Upload-Offset": "0", "Upload-Length": str(len(data)), "Content-Type": "application/octet-stream"}
        headers = {"Authorization": f"Bearer {token}"} | sizes
        with closing(http.client.HTTPConnection(address)) as connection:
            connection.request("PATCH", f"/v1/uploads/{digest(data)}", data[:half], headers)
            assert connection.getresponse().status == 200
        server.kill()
    with receiving(tmp_path / "survey") as (link, server):
        assert server.stdout is not None
        waits = next(line for line in server.stdout if "waits" in line)
        assert waits == f"an upload waits to go on: {half:,} of {len(data):,} bytes are here\n"
        assert hand_over(core, link, zipped).stdout == PLACE + "\n"
    assert (tmp_path / "survey" / PLACE / "Sensors.csv").stat().st_size == len(NOISE) + len("time_ns\n\n")


def test_refusals_reach_the_collector(core: Path, zipped: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.zip"
    broken.write_bytes(zipped.read_bytes()[:-100])
    with receiving(tmp_path / "survey") as (link, _):
        wrong = hand_over(core, link.partition("#")[0] + "#AAAAAAAAAAAAAAAA", zipped)
        assert (wrong.returncode, wrong.stderr) == (
            1,
            "WRONG_TOKEN: the token is missing or wrong; scan the code again\n",
        )
        refused = hand_over(core, link, broken)
        assert refused.returncode == 1
        assert refused.stderr.startswith("REFUSED: ")
    assert not (tmp_path / "survey" / "floor_4").exists()
