"""Strangers on the network do not shut out a phone with the token: over real sockets, also behind one address."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.studio.receiving.zips import digest, session_zip, signed
from vislam2tag.common.addresses import listen
from vislam2tag.common.serving import Limits, serving
from vislam2tag.studio.receiving.server import Listener, Receiver
from vislam2tag.studio.receiving.token import Guard
from vislam2tag.studio.receiving.uploads import Uploads

TOKEN, WRONG = "ABCDEFGHIJKLMNOP", "QQQQQQQQQQQQQQQQ"
DATA = session_zip()
NAME = digest(DATA)
PLENTY = 1_000_000
WAIT_S = 60.0
IN_TIME = Limits(waiting=10, admitted=3, idle_s=10 * WAIT_S)
"""So that what a test leaves half sent is ended by the number of connections only."""


class Computer:
    """A computer that receives, asked over the network."""

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port

    def connect(self) -> socket.socket:
        return socket.create_connection((self.host, self.port), timeout=WAIT_S)

    def ask(self, method: str, headers: dict[str, str], body: bytes | None = None) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(self.host, self.port, timeout=WAIT_S)
        try:
            connection.request(method, f"/v2/uploads/{NAME}", headers=headers, body=body)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def state(self, token: str = TOKEN) -> tuple[int, bytes]:
        return self.ask("GET", signed(token, "GET", NAME))


@pytest.fixture(params=["127.0.0.1", "::1"])
def computer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Computer]:
    """The phone and the stranger both connect from the address of this machine itself."""
    with listen(request.param, 0) as opened, Uploads(tmp_path, PLENTY, PLENTY) as uploads:
        app = Receiver(uploads, Guard(TOKEN), Listener()).app()
        with serving(app, opened, IN_TIME):
            yield Computer(request.param, opened.getsockname()[1])


@contextmanager
def half_sent(computer: Computer, count: int) -> Iterator[list[socket.socket]]:
    """Connections whose header never ends."""
    with ExitStack() as stack:
        opened = [stack.enter_context(computer.connect()) for _ in range(count)]
        for one in opened:
            one.sendall(b"GET / HTTP/1.1\r\nX-Never: ")
        yield opened


def is_ended(connection: socket.socket) -> bool:
    """Wait until the other side ends a connection."""
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def request_bytes(headers: dict[str, str], method: str, body: bytes = b"", name: str = NAME) -> bytes:
    lines = [f"{method} /v2/uploads/{name} HTTP/1.1", "Host: computer", f"Content-Length: {len(body)}"]
    return "\r\n".join([*lines, *(f"{k}: {v}" for k, v in headers.items()), "", ""]).encode() + body


def exchanged(computer: Computer, sent: bytes) -> int:
    """Status of the answer to bytes that are sent as they are."""
    with computer.connect() as connection:
        connection.sendall(sent)
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        return answer.status


def test_wrong_proofs_do_not_refuse_the_right_one(computer: Computer) -> None:
    assert [computer.state(WRONG)[0] for _ in range(30)] == [401] * 30
    assert computer.state()[0] == 200


def test_half_sent_headers_do_not_shut_out_the_phone(computer: Computer) -> None:
    with half_sent(computer, 3 * IN_TIME.waiting) as opened:
        assert is_ended(opened[0])
        assert computer.state()[0] == 200
        answer = computer.ask("PATCH", signed(TOKEN, "PATCH", NAME, DATA, 0, len(DATA)), DATA)
        assert (answer[0], b"filed" in answer[1]) == (200, True)


def test_half_sent_headers_do_not_end_an_upload_that_runs(computer: Computer) -> None:
    sent = request_bytes(signed(TOKEN, "PATCH", NAME, DATA, 0, len(DATA)), "PATCH", DATA)
    with computer.connect() as phone:
        phone.sendall(sent[: -len(DATA)] + DATA[:50])
        while b'"partial"' not in computer.state()[1]:
            pass
        with half_sent(computer, 3 * IN_TIME.waiting) as opened:
            assert is_ended(opened[0])
            phone.sendall(DATA[50:])
            answer = http.client.HTTPResponse(phone)
            answer.begin()
            assert (answer.status, b"filed" in answer.read()) == (200, True)


def test_the_very_same_bytes_are_accepted_once(computer: Computer) -> None:
    asking = request_bytes(signed(TOKEN, "GET", NAME), "GET")
    assert [exchanged(computer, asking) for _ in range(4)] == [200, 401, 401, 401]
    piece = DATA[:100]
    bringing = request_bytes(signed(TOKEN, "PATCH", NAME, piece, 0, len(DATA)), "PATCH", piece)
    assert [exchanged(computer, bringing) for _ in range(3)] == [200, 401, 401]
    assert b'"received":100' in computer.state()[1]


def test_too_many_phones_at_once_are_asked_to_wait(computer: Computer) -> None:
    names = [f"{number:064x}" for number in range(IN_TIME.admitted)]
    with ExitStack() as stack:
        for name in names:
            phone = stack.enter_context(computer.connect())
            sent = request_bytes(signed(TOKEN, "PATCH", name, DATA, 0, len(DATA)), "PATCH", DATA, name)
            phone.sendall(sent[: -len(DATA)] + DATA[:50])
            while not waits(computer, name):
                pass
        assert computer.state()[0] == 429
    while computer.state()[0] == 429:
        pass
    assert computer.state()[0] == 200


def waits(computer: Computer, name: str) -> bool:
    """Whether an upload has begun; True as well if no more connections are admitted, as the last of them is it."""
    sent = request_bytes(signed(TOKEN, "GET", name), "GET", name=name)
    with computer.connect() as connection:
        connection.sendall(sent)
        answer = http.client.HTTPResponse(connection)
        answer.begin()
        return answer.status == 429 or b'"partial"' in answer.read()
