"""The app's own upload client against ``vislam2tag receive``, over loopback."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.cli.test_commands_collection import large_session, receiving
from tests.conformance.java import upload
from tests.studio.receiving.zips import SESSION, digest, session_files, session_zip

pytestmark = pytest.mark.slow

PLACE = f"floor_4/LG/{SESSION}"


def test_the_app_hands_a_session_over_and_goes_on_where_it_broke_off(core: Path, tmp_path: Path) -> None:
    path = tmp_path / "session.zip"
    path.write_bytes(large_session())
    survey = tmp_path / "survey"
    survey.mkdir()
    with receiving(survey) as computer:
        half = path.stat().st_size // 2
        assert computer.bring(path.read_bytes(), 0, half).json()["received"] == half
        done = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", tmp_path / "outbox", path)
        assert (done.returncode, done.stdout.strip()) == (0, PLACE), done.stderr
        assert computer.state(digest(path.read_bytes()))["state"] == "filed"
        again = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", tmp_path / "outbox", path)
        assert (again.returncode, again.stdout.strip()) == (0, PLACE), again.stderr
    assert (survey / PLACE / "Sensors.csv").is_file()


def test_the_app_tells_why_a_session_is_refused(core: Path, tmp_path: Path) -> None:
    path = tmp_path / "session.zip"
    path.write_bytes(session_zip(CameraPose_csv=b"other"))
    survey = tmp_path / "survey"
    survey.mkdir()
    with receiving(survey) as computer:
        wrong = upload(core, f"vislam2tag://{computer.host}/#{'A' * 16}", tmp_path / "outbox", path)
        assert wrong.returncode == 1
        assert "WRONG_TOKEN" in wrong.stderr
        refused = upload(core, f"vislam2tag://{computer.host}/#{computer.token}", tmp_path / "outbox", path)
        assert refused.returncode == 1
        assert "REFUSED" in refused.stderr
        assert "checksum of CameraPose.csv" in refused.stderr
    assert not (survey / "floor_4").exists()


TORN_BYTES = 300_000


@contextmanager
def torn_connections(host: str, times: int) -> Iterator[str]:
    """A way to a computer whose first connections break off after :data:`TORN_BYTES`; yields its address."""
    address, _, port = host.rpartition(":")
    with closing(socket.create_server(("127.0.0.1", 0))) as server:
        threading.Thread(target=_pass_on, args=(server, (address, int(port)), times), daemon=True).start()
        yield f"127.0.0.1:{server.getsockname()[1]}"


def _pass_on(server: socket.socket, to: tuple[str, int], times: int) -> None:
    while True:
        try:
            phone, _ = server.accept()
        except OSError:
            return  # the test is over
        with closing(phone), closing(socket.create_connection(to)) as computer:
            back = threading.Thread(target=_copy, args=(computer, phone, None), daemon=True)
            back.start()
            if _copy(phone, computer, TORN_BYTES if times > 0 else None):
                times -= 1
            else:
                back.join()


def _copy(source: socket.socket, target: socket.socket, at_most: int | None) -> bool:
    """Copy until the source ends; tells whether it was cut before."""
    done = 0
    try:
        while data := source.recv(1 << 16):
            target.sendall(data)
            done += len(data)
            if at_most is not None and done > at_most:
                return True
    except OSError:
        pass
    return False


def test_all_sessions_are_sent_over_connections_that_break(core: Path, tmp_path: Path) -> None:
    large, small, survey = tmp_path / "large.zip", tmp_path / "small.zip", tmp_path / "survey"
    large.write_bytes(large_session())
    other = "2021-12-21T080000"
    small.write_bytes(session_zip(session_files(session=other), other))
    assert large.stat().st_size > 3 * TORN_BYTES
    survey.mkdir()
    with receiving(survey) as computer, torn_connections(computer.host, 2) as way:
        done = upload(core, f"vislam2tag://{way}/#{computer.token}", tmp_path / "outbox", large, small)
        assert done.returncode == 0, done.stderr
        assert done.stdout.splitlines() == [PLACE, PLACE.replace(SESSION, other)]
    assert len(list(survey.rglob("session.json"))) == 2
