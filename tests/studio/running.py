"""A studio that runs as users start it, and a browser that has entered it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import polars as pl

STARTED_S = 120.0
JOB_S = 240.0


class Page:
    """Asks a studio as its page does."""

    def __init__(self, address: str) -> None:
        self.url, _, self.token = address.partition("/#")
        self.client = httpx.Client(base_url=self.url, timeout=60.0)

    def enter(self) -> httpx.Response:
        return self.client.post("/api/enter", json={"token": self.token})

    def get(self, path: str, **query: Any) -> Any:
        answer = self.client.get(path, params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def columns(self, path: str, **query: Any) -> pl.DataFrame:
        answer = self.client.get(path, params=query)
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-type"] == "application/vnd.apache.arrow.stream"
        return pl.read_ipc_stream(answer.content)

    def post(self, path: str, content: object) -> Any:
        answer = self.client.post(path, json=content)
        assert answer.status_code in (200, 202), answer.text
        return answer.json()

    def save(self, text: str, version: str) -> httpx.Response:
        return self.client.put("/api/corrections", json={"text": text}, headers={"If-Match": f'"{version}"'})

    def do(self, kind: str, sessions: list[str] | None = None) -> dict[str, Any]:
        """Let a job be done, and wait for its end."""
        number = self.post("/api/jobs", {"kind": kind, "sessions": sessions})["id"]
        return self.ended(number)

    def ended(self, number: int) -> dict[str, Any]:
        deadline = time.monotonic() + JOB_S
        while time.monotonic() < deadline:
            job = next(job for job in self.get("/api/jobs")["jobs"] if job["id"] == number)
            if job["state"] not in ("queued", "running"):
                return dict(job)
            time.sleep(0.02)
        raise AssertionError(f"job {number} has not ended")

    def events(self) -> Iterator[tuple[str, Any]]:
        """Server-sent events as they come."""
        with self.client.stream("GET", "/api/events", timeout=60.0) as answer:
            name = ""
            for line in answer.iter_lines():
                if line.startswith("event: "):
                    name = line.removeprefix("event: ")
                elif line.startswith("data: "):
                    yield name, json.loads(line.removeprefix("data: "))


@contextmanager
def running_studio(survey: Path, *options: str, port: int = 0) -> Iterator[Page]:
    """Start ``vislam2tag studio``, and end it as Ctrl-C does."""
    program = [sys.executable, "-m", "vislam2tag"]
    command = [*program, "-q", "studio", str(survey), "--no-browser", "--port", str(port), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    try:
        assert process.stdout is not None
        address = next(line for line in process.stdout if re.match("http://", line)).strip()
        page = Page(address)
        deadline = time.monotonic() + STARTED_S
        while True:
            try:
                page.client.get("/")
                break
            except httpx.TransportError:
                assert time.monotonic() < deadline
                time.sleep(0.05)
        with closing(page.client):
            yield page
    finally:
        process.send_signal(signal.SIGINT)
        with process:
            assert process.wait(STARTED_S) == 0
