"""An S3 server for tests (moto) as a process of its own: counts its requests, and fails those that it is told to.

``python -m tests.store_server PORT HOST``; a GET of ``/__seen`` returns and forgets the requests so far, a POST of JSON
to ``/__faults`` says which requests go wrong, and how (:class:`tests.stores.Fault`).
"""

from __future__ import annotations

import json
import re
import socket
import sys
import time
from collections.abc import Iterable
from threading import Lock
from typing import Any

from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import WSGIRequestHandler, make_server

SILENT_S = 3.0


class Failing:
    """The server's application, with faults."""

    def __init__(self) -> None:
        self.app = DomainDispatcherApplication(create_backend_app)
        self.lock = Lock()
        self.seen: list[str] = []
        self.faults: list[dict[str, Any]] = []

    def __call__(self, environ: dict[str, Any], start: Any) -> Iterable[bytes]:
        request = f"{environ['REQUEST_METHOD']} {environ['PATH_INFO']}"
        if environ["PATH_INFO"] == "/__seen":
            seen, self.seen = self.seen, []
            return _answer(start, "200 OK", json.dumps(seen))
        if environ["PATH_INFO"] == "/__faults":
            self.faults = json.loads(environ["wsgi.input"].read(int(environ["CONTENT_LENGTH"])))
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
            done = b"".join(self.app(environ, lambda *_: None)) if fault["answer"] == "lost" else b""
            environ["werkzeug.socket"].shutdown(socket.SHUT_RDWR)
            return _answer(start, "200 OK", done.decode("utf-8", errors="replace"))
        environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
        code = fault["answer"].split()[-1]
        return _answer(start, fault["answer"], f"<Error><Code>{code}</Code><Message>{code}</Message></Error>")


class Silent(WSGIRequestHandler):
    """Prints no line for each request."""

    def log(self, type: str, message: str, *args: Any) -> None:
        pass


def _answer(start: Any, status: str, text: str) -> list[bytes]:
    body = text.encode()
    start(status, [("Content-Type", "application/xml"), ("Content-Length", str(len(body)))])
    return [body]


if __name__ == "__main__":
    port, host = sys.argv[1:]
    make_server(host, int(port), Failing(), threaded=True, request_handler=Silent).serve_forever()
