"""Attacks ``receive`` over HTTP: whole and damaged requests by somebody who knows the token, and by others."""

from __future__ import annotations

import contextlib
import hashlib
import os
import signal
import socket
import threading
import time
from unittest import mock

from tests.mutations import mutate
from tests.studio.receiving.zips import session_files, session_zip, signed

from fuzzing.invocation import cli
from fuzzing.mutations import Rng
from fuzzing.targets import Run
from vislam2tag.studio.receiving import token as tokens
from vislam2tag.studio.receiving.server import UPLOADS

_TOKEN = "A" * tokens.LENGTH
_REQUESTS = 6
_ODD = (
    b"",
    b"-1",
    b"1e3",
    b"99999999999999999999",
    b"\xff",
    b"x" * 9000,
    b"0",
    b"chunked",
    b"1, 2",
    b"\x00",
    b"7\r\nA: b",
)


def upload(run: Run) -> None:
    """Serve, send a few requests, see that the server still answers, and end it as Ctrl-C does."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    files = session_files(floor=int(run.rng.integers(3)))
    content = session_zip(files)
    if run.rng.random() < 0.5:
        content = mutate(content, run.rng)
    requests = [_request(content, run.rng) for _ in range(_REQUESTS)]
    sender = threading.Thread(target=_send_all, args=(port, requests), daemon=True)
    sender.start()
    with mock.patch.object(tokens, "new_token", return_value=_TOKEN):
        cli("receive", run.base, "--host", "127.0.0.1", "--port", str(port))


def _send_all(port: int, requests: list[bytes]) -> None:
    while not _answer(port, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"):
        time.sleep(0.02)
    for request in requests:
        _answer(port, request)
    if b" 200 " not in _answer(port, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", patience_s=60):
        print("unexpected silence: the server does not answer any more", flush=True)
    os.kill(os.getpid(), signal.SIGINT)


def _answer(port: int, request: bytes, patience_s: float = 0.3) -> bytes:
    """What comes back so soon."""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=patience_s) as connection:
        connection.sendall(request)
        return connection.recv(1 << 16)
    return b""


def _request(content: bytes, rng: Rng) -> bytes:
    """A request as an app sends it, often with one thing wrong, before or after it is signed."""
    name = hashlib.sha256(content).hexdigest()
    start = int(rng.choice([0, 0, 0, len(content) // 2]))
    body = content[start:]
    if rng.random() < 0.2:
        body = mutate(body, rng)
    method = str(rng.choice(["PATCH", "PATCH", "PATCH", "GET", "PUT"]))
    offset, length = (str(value) if rng.random() < 0.9 else _odd_text(rng) for value in (start, len(content)))
    headers = [*signed(_TOKEN, method, name, body, offset, length).items(), ("Content-Length", str(len(body)))]
    lines = [f"{method} {UPLOADS}/{name} HTTP/1.1".encode(), b"Host: x"]
    lines += [f"{key}: {value}".encode("latin-1") for key, value in headers]
    if rng.random() < 0.5:
        row = int(rng.integers(len(lines)))
        head, colon, _ = lines[row].partition(b": ")
        ways = (
            head + colon + _ODD[rng.integers(len(_ODD))],
            mutate(lines[row], rng),
            b"",
            lines[row] + b"\r\n" + lines[row],
        )
        lines[row] = ways[rng.integers(len(ways))]
    return b"\r\n".join([*lines, b"", body])


def _odd_text(rng: Rng) -> str:
    return _ODD[rng.integers(len(_ODD))].decode("latin-1").replace("\r\n", " ")
