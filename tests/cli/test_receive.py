"""Receiving sessions by a server of its own process, over loopback, from real clients."""

from __future__ import annotations

import http.client
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.receiving.zips import SESSION, digest, session_files, session_zip
from tests.report.browser import running_browser

PLACE = f"floor_4/LG/{SESSION}"


@dataclass
class Computer:
    """A running ``vislam2tag receive``."""

    process: subprocess.Popen[str]
    host: str
    token: str

    @property
    def client(self) -> httpx.Client:
        headers = {"Authorization": f"Bearer {self.token}"}
        return httpx.Client(base_url=f"http://{self.host}", headers=headers, timeout=20)

    def state(self, name: str) -> dict[str, Any]:
        with self.client as client:
            content: dict[str, Any] = client.get(f"/v1/uploads/{name}").json()
            return content

    def bring(self, data: bytes, offset: int, stop: int) -> httpx.Response:
        headers = {"Upload-Offset": str(offset), "Upload-Length": str(len(data))}
        with self.client as client:
            return client.patch(f"/v1/uploads/{digest(data)}", content=data[offset:stop], headers=headers)

    def end(self) -> tuple[int, str]:
        """End it by Ctrl-C; returns its exit code and what it told after its start."""
        self.process.send_signal(signal.SIGINT)
        told, errors = self.process.communicate(timeout=20)
        assert errors == ""
        return self.process.returncode, told


@contextmanager
def receiving(survey: Path, *options: str) -> Iterator[Computer]:
    command = [sys.executable, "-m", "vislam2tag", "receive", str(survey), "--host", "127.0.0.1", "--port", "0"]
    command += options
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        told = ""
        while "Ctrl-C" not in told:
            line = process.stdout.readline()
            assert line, (told, process.stderr and process.poll())
            told += line
        match = re.search(r"http://([^/]+)/#(\w+)", told)
        assert match is not None
        yield Computer(process, match.group(1), match.group(2))
    finally:
        process.kill()
        process.communicate()


def large_session() -> bytes:
    """A zip of some megabytes that does not compress."""
    rows = np.random.default_rng(1).integers(0, 2**63 - 1, 150_000).tolist()
    return session_zip(session_files() | {"Sensors.csv": b"".join(b"%d,ACC\n" % row for row in rows)})


def test_a_session_is_handed_over_in_pieces_through_kills_of_both_sides(tmp_path: Path) -> None:
    data = large_session()
    name, half = digest(data), len(data) // 2
    with receiving(tmp_path) as computer:
        assert computer.state(name)["state"] == "none"
        _break_off(computer, data, sent=half)
        kept = _until_kept(computer, name, least=half // 2)
        computer.process.kill()
    assert not (tmp_path / "floor_4").exists()
    with receiving(tmp_path) as computer:
        again = computer.state(name)
        assert (again["state"], again["length"]) == ("partial", len(data))
        assert kept <= again["received"] <= half
        answer = computer.bring(data, again["received"], len(data))
        assert (answer.status_code, answer.json()["session"]) == (200, PLACE)
        code, told = computer.end()
    assert code == 0
    assert f"filed {PLACE}" in told
    assert "1 session received" in told
    assert sorted(path.name for path in (tmp_path / PLACE).iterdir()) == sorted(
        [*session_files(), "Sensors.csv", "SHA256SUMS"]
    )


def _break_off(computer: Computer, data: bytes, sent: int) -> None:
    """A phone that dies amid a request: it announces everything and sends a part."""
    host, port = computer.host.split(":")
    with socket.create_connection((host, int(port))) as opened:
        head = (
            f"PATCH /v1/uploads/{digest(data)} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {computer.token}\r\n"
            f"Upload-Offset: 0\r\nUpload-Length: {len(data)}\r\nContent-Length: {len(data)}\r\n\r\n"
        )
        opened.sendall(head.encode() + data[:sent])


def _until_kept(computer: Computer, name: str, least: int) -> int:
    for _ in range(100):
        received = int(computer.state(name)["received"])
        if received >= least:
            return received
        time.sleep(0.05)
    raise AssertionError("what came was not kept")


def test_the_same_session_again_and_one_damaged_on_the_way(tmp_path: Path) -> None:
    data = session_zip()
    damaged = session_zip(CameraPose_csv=b"other")
    with receiving(tmp_path) as computer:
        assert computer.bring(data, 0, len(data)).json()["session"] == PLACE
        assert computer.bring(data, 0, len(data)).json()["state"] == "filed"
        refused = computer.bring(damaged, 0, len(damaged))
        assert refused.status_code == 422
        code, told = computer.end()
    assert code == 0
    assert told.count(f"filed {PLACE}") == 1
    assert "refused 127.0.0.1: the checksum of CameraPose.csv is wrong" in told


def test_wrong_tokens_and_oversized_sessions_are_refused(tmp_path: Path) -> None:
    data = session_zip()
    with receiving(tmp_path, "--max-size", "1") as computer:
        wrong = httpx.get(f"http://{computer.host}/v1/uploads/{digest(data)}", headers={"Authorization": "Bearer X"})
        assert wrong.status_code == 401
        headers = {"Upload-Offset": "0", "Upload-Length": "1000001"}
        with computer.client as client:
            assert client.patch(f"/v1/uploads/{digest(data)}", headers=headers).status_code == 413
    assert not (tmp_path / "floor_4").exists()


def test_ctrl_c_amid_an_upload_ends_it_and_keeps_what_came(tmp_path: Path) -> None:
    data = large_session()
    with receiving(tmp_path) as computer:
        host, port = computer.host.split(":")
        phone = http.client.HTTPConnection(host, int(port), timeout=20)
        phone.putrequest("PATCH", f"/v1/uploads/{digest(data)}")
        for header, value in {
            "Authorization": f"Bearer {computer.token}",
            "Upload-Offset": "0",
            "Upload-Length": str(len(data)),
            "Content-Length": str(len(data)),
        }.items():
            phone.putheader(header, value)
        phone.endheaders(data[:100_000])
        _until_kept(computer, digest(data), least=1)
        code, told = computer.end()
        phone.close()
    assert code == 0
    assert "0 sessions received" in told
    assert next((tmp_path / ".receiving").glob("*.part")).stat().st_size > 0


def test_a_second_receiver_of_a_survey_is_refused(tmp_path: Path) -> None:
    with receiving(tmp_path):
        error = the_error(vislam2tag("receive", tmp_path, "--host", "127.0.0.1", "--port", "0"))
    assert "another 'vislam2tag receive'" in error


def test_zips_are_filed_without_a_server(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.zip", tmp_path / "bad.zip"
    good.write_bytes(session_zip())
    bad.write_bytes(b"no zip")
    survey = tmp_path / "survey"
    survey.mkdir()
    done = vislam2tag("receive", survey, good, bad)
    assert (done.returncode, done.stdout) == (1, f"{PLACE}: filed\n")
    assert done.stderr.startswith(f"refused {bad}: ")
    again = vislam2tag("receive", survey, good)
    assert (again.returncode, again.stdout) == (0, f"{PLACE}: was there already\n")


def test_no_folder_and_a_missing_zip_are_told(tmp_path: Path) -> None:
    assert "not a folder" in the_error(vislam2tag("receive", tmp_path / "none"))
    assert "none.zip" in the_error(vislam2tag("receive", tmp_path, tmp_path / "none.zip"))


@pytest.mark.parametrize("token_from", ["fragment", "typed"])
def test_a_browser_hands_a_zip_over_by_hand(tmp_path: Path, token_from: str) -> None:
    data = large_session()
    (tmp_path / "session.zip").write_bytes(data)
    survey = tmp_path / "survey"
    survey.mkdir()
    problems: list[str] = []
    with receiving(survey) as computer, running_browser() as browser:
        page = browser.new_page()
        page.on("console", lambda message: problems.append(message.text))
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.goto(f"http://{computer.host}/" + (f"#{computer.token}" if token_from == "fragment" else ""))
        if token_from == "typed":
            assert not page.is_visible("#app")
            page.fill("#token", "-".join(re.findall("....", computer.token.lower())))
        else:
            assert page.get_attribute("#app", "href") == f"vislam2tag://{computer.host}/#{computer.token}"
        page.set_input_files("#file", tmp_path / "session.zip")
        page.click("#send")
        page.locator("#told", has_text="Done").wait_for(timeout=30_000)
        assert page.text_content("#told") == f"Done: {PLACE}"
    assert [problem for problem in problems if "favicon" not in problem and "404" not in problem] == []
    assert (survey / PLACE / "Sensors.csv").is_file()
