"""An S3 server for tests (moto) as a process of its own: counts its requests, and fails those that it is told to.

``python -m tests.store_server PORT HOST``; a GET of ``/__seen`` returns and forgets the requests so far, a POST of JSON
to ``/__faults`` says which requests go wrong, and how (:class:`tests.stores.Fault`).
"""

from __future__ import annotations

import io
import json
import re
import socket
import sys
import time
from collections.abc import Callable, Iterable
from threading import Lock
from typing import Any

from moto.moto_server.werkzeug_app import create_backend_app
from werkzeug.serving import WSGIRequestHandler, make_server

SILENT_S = 3.0


class Failing:
    """The server's application, with faults."""

    def __init__(self) -> None:
        self.app = create_backend_app("s3")
        self.lock = Lock()
        self.seen: list[str] = []
        self.faults: list[dict[str, Any]] = []

    def __call__(self, environ: dict[str, Any], start: Any) -> Iterable[bytes]:
        request = f"{environ['REQUEST_METHOD']} {environ['PATH_INFO']}"
        environ["wsgi.input"] = io.BytesIO(environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0)))
        if environ["PATH_INFO"] == "/__seen":
            seen, self.seen = self.seen, []
            return _answer(start, "200 OK", json.dumps(seen))
        if environ["PATH_INFO"] == "/__faults":
            self.faults = json.loads(environ["wsgi.input"].read())
            return _answer(start, "200 OK", "")
        with self.lock:
            self.seen.append(request)
            fault = next((each for each in self.faults if each["times"] and re.search(each["request"], request)), None)
            if fault is not None:
                fault["times"] -= 1
        if fault is None:
            answer: Iterable[bytes] = self.app(environ, start)
            return answer
        if fault["answer"] == "silent":
            time.sleep(SILENT_S)
        if fault["answer"] in ("lost", "torn", "silent"):
            done = b"".join(self.app(environ, _Started())) if fault["answer"] == "lost" else b""
            environ["werkzeug.socket"].shutdown(socket.SHUT_RDWR)
            return _answer(start, "200 OK", done.decode("utf-8", errors="replace"))
        code = fault["answer"].split()[-1]
        return _answer(start, fault["answer"], f"<Error><Code>{code}</Code><Message>{code}</Message></Error>")


class _Started:
    """Keeps how an answer begins."""

    def __call__(self, status: str, headers: list[tuple[str, str]], error: Any = None, /) -> Callable[[bytes], object]:
        self.status, self.headers = status, headers
        return bytes


class Handler(WSGIRequestHandler):
    """Keeps connections, as real stores do and Werkzeug's own handler does not, and prints no line for each request."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def run_wsgi(self) -> None:
        started, environ = _Started(), self.make_environ()
        body = b"".join(self.server.app(environ, started))
        code, _, phrase = started.status.partition(" ")
        self.send_response(int(code), phrase)
        for name, value in started.headers:
            self.send_header(name, value)
        if not any(name.lower() == "content-length" for name, _ in started.headers):
            self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if environ["REQUEST_METHOD"] != "HEAD":
            self.wfile.write(body)

    def log(self, type: str, message: str, *args: Any) -> None:
        pass


def _answer(start: Any, status: str, text: str) -> list[bytes]:
    body = text.encode()
    start(status, [("Content-Type", "application/xml"), ("Content-Length", str(len(body)))])
    return [body]


if __name__ == "__main__":
    port, host = sys.argv[1:]
    make_server(host, int(port), Failing(), threaded=True, request_handler=Handler).serve_forever()
