"""Servers of files for exported pages, and what a browser is shown of them."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, Response
from starlette.applications import Starlette
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

from tests.views.browser import note_problems
from vislam2tag.common.addresses import listen
from vislam2tag.common.serving import serving

LATEST_MS = 60_000


def barriers(page: Page) -> list[str]:
    """What on a page bars people, by axe-core's rules."""
    found = Axe().run(page).response["violations"]
    return [one["id"] for one in found if one["impact"] in ("serious", "critical")]


@contextmanager
def shown(browser: Browser, address: str, width: int, locale: str = "en") -> Iterator[tuple[Page, list[Response]]]:
    """A page, dark where narrow, that complains of nothing and asks nobody else; and what it was answered."""
    problems: list[str] = []
    answers: list[Response] = []
    context = browser.new_context(
        viewport={"width": width, "height": 800},
        color_scheme="dark" if width < 800 else "light",
        locale=locale,
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.set_default_timeout(LATEST_MS)
    note_problems(page, problems)
    page.on("response", lambda answer: answers.append(answer))
    page.goto(address)
    yield page, answers
    context.close()
    own = address.partition("#")[0].partition("?")[0]
    assert [problem for problem in problems if not problem.startswith(f"request: {own}")] == []


@contextmanager
def range_server(folder: Path) -> Iterator[str]:
    """A server that gives parts of files, of the folder below a path."""
    with listen("127.0.0.1", 0) as opened:
        app = Starlette(routes=[Mount("/maps/ward-7", StaticFiles(directory=folder, html=True))])
        with serving(app, opened):
            yield f"http://127.0.0.1:{opened.getsockname()[1]}/maps/ward-7/"


@contextmanager
def plain_server(folder: Path) -> Iterator[str]:
    """The server of ``python -m http.server``, which gives whole files."""
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()
