"""Commands for sessions as they come in: ``receive`` and ``inspect``."""

from __future__ import annotations

import functools
import json
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.locks import lock
from tests.site.site import write_survey
from tests.studio.receiving.zips import SESSION, digest, session_files, session_zip, signed
from tests.views.browser import running_browser
from vislam2tag.cli.app import app
from vislam2tag.cli.exit_codes import ExitCode
from vislam2tag.studio.receiving.server import UPLOADS

PLACE = f"floor_4/LG/{SESSION}"


@dataclass
class Computer:
    """A running ``vislam2tag receive``."""

    process: subprocess.Popen[str]
    host: str
    token: str

    def address(self, name: str) -> str:
        return f"http://{self.host}{UPLOADS}/{name}"

    def state(self, name: str) -> dict[str, Any]:
        answer = httpx.get(self.address(name), headers=signed(self.token, "GET", name), timeout=20)
        content: dict[str, Any] = answer.json()
        return content

    def bring(self, data: bytes, offset: int, stop: int) -> httpx.Response:
        name, part = digest(data), data[offset:stop]
        headers = signed(self.token, "PATCH", name, part, offset, len(data))
        return httpx.patch(self.address(name), content=part, headers=headers, timeout=20)

    def end(self) -> tuple[int, str]:
        """End it by Ctrl-C; returns its exit code and what it told after its start."""
        self.process.send_signal(signal.SIGINT)
        told, errors = self.process.communicate(timeout=20)
        assert errors == ""
        return self.process.returncode, told


@contextmanager
def receiving(survey: Path, *options: str, before: Callable[[], None] | None = None) -> Iterator[Computer]:
    command = [sys.executable, "-m", "vislam2tag", "receive", str(survey), "--host", "127.0.0.1", "--port", "0"]
    command += options
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=before)
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
        opened.sendall(_head(computer, data).encode() + data[:sent])


def _head(computer: Computer, data: bytes) -> str:
    headers = signed(computer.token, "PATCH", digest(data), data, 0, len(data)) | {"Content-Length": str(len(data))}
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    return f"PATCH {UPLOADS}/{digest(data)} HTTP/1.1\r\nHost: x\r\n{lines}\r\n"


def _until_kept(computer: Computer, name: str, least: int) -> int:
    while (received := int(computer.state(name)["received"])) < least:
        time.sleep(0.05)
    return received


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
    with receiving(tmp_path, "--max-size-mb", "1") as computer:
        address, name = computer.address(digest(data)), digest(data)
        assert httpx.get(address, headers=signed("X" * 16, "GET", name)).status_code == 401
        headers = signed(computer.token, "PATCH", name, b"", 0, 1_000_001)
        assert httpx.patch(address, headers=headers).status_code == 413
    assert not (tmp_path / "floor_4").exists()


def test_ctrl_c_amid_an_upload_ends_it_and_keeps_what_came(tmp_path: Path) -> None:
    data = large_session()
    with receiving(tmp_path) as computer:
        host, port = computer.host.split(":")
        phone = socket.create_connection((host, int(port)), timeout=20)
        phone.sendall(_head(computer, data).encode() + data[:100_000])
        _until_kept(computer, digest(data), least=1)
        code, told = computer.end()
        phone.close()
    assert code == 0
    assert "0 sessions received" in told
    assert next((tmp_path / ".receiving").glob("*.part")).stat().st_size > 0


def test_a_second_receiver_of_a_survey_is_refused(tmp_path: Path) -> None:
    with receiving(tmp_path):
        error = the_error(vislam2tag("receive", tmp_path, "--host", "127.0.0.1", "--port", "0"), ExitCode.RETRY)
    assert "another 'vislam2tag receive'" in error


@pytest.mark.parametrize("addresses", [1, 250])
def test_others_are_served_while_strangers_hold_connections_open(tmp_path: Path, addresses: int) -> None:
    data, count = large_session(), 2000
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < count + 500:
        pytest.skip(f"this system lets a program open {hard} files, too few for {count} connections")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, count + 500), hard))
    few = functools.partial(resource.setrlimit, resource.RLIMIT_NOFILE, (256, hard))
    opened: list[socket.socket] = []
    try:
        with receiving(tmp_path, before=few) as computer:
            host, port = computer.host.split(":")
            for number in range(count):
                stranger = socket.socket()
                opened.append(stranger)
                stranger.bind((f"127.0.1.{number % addresses + 1}", 0))
                stranger.connect((host, int(port)))
                stranger.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX-Never: ")
                if number % 400 == 399:
                    assert computer.state(digest(data))["state"] == "none"
            assert computer.bring(data, 0, len(data)).json()["session"] == PLACE
            code, told = computer.end()
        assert code == 0
        assert len(told) < 1000
    finally:
        for stranger in opened:
            stranger.close()
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_zips_are_not_filed_beside_a_server(tmp_path: Path) -> None:
    path = tmp_path / "good.zip"
    path.write_bytes(session_zip())
    with receiving(tmp_path):
        assert "another 'vislam2tag receive'" in the_error(vislam2tag("receive", tmp_path, path), ExitCode.RETRY)


def test_zips_are_filed_without_a_server(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.zip", tmp_path / "bad.zip"
    good.write_bytes(session_zip())
    bad.write_bytes(b"no zip")
    survey = tmp_path / "survey"
    survey.mkdir()
    done = vislam2tag("receive", survey, good, bad)
    step = f"next: vislam2tag inspect {survey}\n"
    assert (done.returncode, done.stdout) == (1, f"{PLACE}: filed\n{step}")
    assert done.stderr.startswith(f"refused {bad}: ")
    again = vislam2tag("receive", survey, good)
    assert (again.returncode, again.stdout) == (0, f"{PLACE}: already filed\n{step}")


def test_no_folder_and_a_missing_zip_are_told(tmp_path: Path) -> None:
    assert "not a folder" in the_error(vislam2tag("receive", tmp_path / "none"))
    assert "none.zip" in the_error(vislam2tag("receive", tmp_path, tmp_path / "none.zip"))


@pytest.mark.slow
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
        page.locator("#state", has_text="Done").wait_for(timeout=30_000)
        assert page.text_content("#state") == f"Done: {PLACE}"
    assert [problem for problem in problems if "favicon" not in problem and "404" not in problem] == []
    assert (survey / PLACE / "Sensors.csv").is_file()


def test_tables_and_findings_of_a_survey(tmp_path: Path) -> None:
    write_survey(tmp_path, {"floor_1/floorplan.jpg": None})
    with (tmp_path / "floor_1/One Plus/walk/sensors.csv").open("a") as file:
        file.write("cut o")
    result = CliRunner().invoke(app, ["inspect", str(tmp_path)])
    assert result.exit_code == 0, result.output
    for text in ("60 m x 32.5 m", "none (metric grid)", "One Plus", "2 of 2 surveyed", "30.0 Hz"):
        assert text in result.output
    assert "partial_last_line sensors.csv lines 301: the last line is incomplete" in result.output
    assert "missing_control_points 3 x floor 4 has no control points" in result.output
    assert "sessions: 3, findings: 6\n" in result.output
    assert "nothing is wrong, 1 warning (looked at: the site's files and 3 sessions, not mapped)\n" in result.output
    assert "next: vislam2tag run " in result.output


def test_landmarks_outside_the_plan_are_diagnosed_next(tmp_path: Path) -> None:
    write_survey(tmp_path, {"floor_1/marker_dict.csv": "id,x,y\n10,1.5,2.5\n7,300,4\n"})
    result = CliRunner().invoke(app, ["inspect", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "landmarks_off_plan" in result.output
    assert f"next: vislam2tag diagnose {tmp_path}\n" in result.output


def test_warnings_make_nothing_wrong_and_errors_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write_survey(tmp_path)
    path = root / "floor_1/One Plus/walk/sensors.csv"
    path.write_text(path.read_text() + "not a row\n")
    warned = CliRunner().invoke(app, ["inspect", str(root), "--json"])
    judgement = json.loads(warned.stdout)["judgement"]
    assert (warned.exit_code, judgement["answer"], judgement["warnings"]) == (0, "nothing_wrong", 1)
    (root / "floor_4/refmarker.csv").write_text("id,x,y\n1,1,1\n")
    lock(monkeypatch, root / "floor_4/refmarker.csv")
    wrong = CliRunner().invoke(app, ["inspect", str(root)])
    assert "unreadable_file floor_4/refmarker.csv" in wrong.output
    assert "something is wrong, 1 warning (looked at: " in wrong.output
    assert wrong.exit_code == 1
    assert "next: correct the problems above" in wrong.output


def test_a_header_that_cannot_be_understood_is_told_and_its_walks_lack_landmarks(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey", {"floor_1/marker_dict.csv": "\nmarke,links,oben\n10,1,2\n7,3,4\n"})
    done = vislam2tag("inspect", root)
    assert done.returncode == 1
    assert "floor_1/marker_dict.csv" in done.stdout
    assert "the first line must be: id,x,y (then optional columns" in done.stdout
    assert "it does not contain x and y and is: id,links,oben" in done.stdout
    done = vislam2tag("process", root, "--out", tmp_path / "out", "--jobs", "1")
    assert "warning: floor_1/marker_dict.csv:2: the first line must be: id,x,y" in done.stderr
