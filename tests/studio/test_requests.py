"""Requests that no page sends get a refusal with a sentence, and half-sent ones do not keep the page out."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from PIL import Image

from vislam2tag.common.serving import Limits, listen, serving
from vislam2tag.settings import Settings
from vislam2tag.studio.app import opened_studio
from vislam2tag.studio.messages import NoQuery
from vislam2tag.studio.routing import ENDPOINTS
from vislam2tag.studio.workspace import Workspace

SRC = Path(__file__).parents[2] / "src" / "vislam2tag"
WAIT_S = 60.0
LIMITS = Limits(waiting=10, admitted=20, idle_s=10 * WAIT_S)
"""So that half-sent headers are ended by their number only."""
BODIES = [
    b"[1]",
    b"null",
    b'"x"',
    b"5",
    b"true",
    b'{"token":5}',
    b'{"token":null}',
    b'{"token":"\\ud800"}',
    b'{"text":"\\ud800","changes":[]}',
    b'{"nothing":1}',
    b"1e400",
    b"NaN",
    b"9" * 5000,
    b"\xff",
    b"{",
    b'{"a":' * 2000,
    b'{"kind":"process","sessions":["\\u0000"]}',
    b'{"file":99999999999999999999999,"part":{}}',
    b'{"plan":123,"landmarks":[{"id":"1","place":1e30}]}',
    b'{"floor":99999999999999999999,"spacing_m":5,"rooms":true,"sheets":["A4"]}',
]


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("requests") / "survey"
    for floor in (-1, 0):
        (folder / f"floor_{floor}").mkdir(parents=True)
        Image.new("L", (300, 200), 255).save(folder / f"floor_{floor}" / "floorplan.png")
    (folder / "floor_dimensions.csv").write_text("level;name;x;y\n-1;cellar;30;20\n0;ground;30;20\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def studio(survey: Path) -> Iterator[tuple[str, str]]:
    """Address and token of a studio."""
    workspace = Workspace(survey, survey.parent / "labels", Settings())
    with (
        listen("127.0.0.1", 0) as opened,
        opened_studio(workspace, "127.0.0.1", opened, 1) as (url, app),
        serving(app, opened, LIMITS),
    ):
        address, _, token = url.partition("/#")
        yield address, token


@pytest.fixture(scope="module")
def browser(studio: tuple[str, str]) -> Iterator[httpx.Client]:
    """A browser that has entered."""
    address, token = studio
    with httpx.Client(base_url=address, timeout=WAIT_S) as client:
        assert client.post("/api/enter", json={"token": token}).status_code == 204
        yield client


def refused(answer: httpx.Response) -> bool:
    return 400 <= answer.status_code < 500 and bool(answer.json()["message"])


@pytest.mark.parametrize("body", [b"", b"{}", *BODIES])
def test_no_body_enters_without_a_token(studio: tuple[str, str], body: bytes) -> None:
    headers = {"Content-Type": "application/json"}
    answer = httpx.post(f"{studio[0]}/api/enter", content=body, headers=headers, timeout=WAIT_S)
    assert refused(answer), answer.text


@pytest.mark.parametrize("path", sorted({one.path for one in ENDPOINTS if one.body is not NoQuery}))
def test_a_body_that_no_page_sends_is_refused(browser: httpx.Client, path: str) -> None:
    endpoint = next(one for one in ENDPOINTS if one.path == path and one.body is not NoQuery)
    for body in BODIES:
        headers = {"Content-Type": "application/json", "If-Match": '"none"'}
        answer = browser.request(endpoint.method, path, content=body, headers=headers)
        assert refused(answer), (body[:50], answer.status_code, answer.text)


@pytest.mark.parametrize("number", ["9" * 9, "9" * 10, "9" * 5000, "-9", "x", "%00", "%ff"])
def test_a_path_that_names_nothing_is_refused(browser: httpx.Client, number: str) -> None:
    for endpoint in (one for one in ENDPOINTS if "{" in one.path):
        path = endpoint.path.replace("{number:short}", number).replace("{id}", number).replace("{name}", number)
        answer = browser.request(endpoint.method, path, params={"floor": "9" * 5000})
        assert refused(answer), (path[:50], answer.status_code, answer.text)


def test_a_floor_below_the_ground_has_its_plan(browser: httpx.Client) -> None:
    for floor in (-1, 0):
        assert browser.get(f"/api/floors/{floor}/plan").headers["content-type"] == "image/png"


def test_half_sent_headers_do_not_keep_the_page_out(studio: tuple[str, str], browser: httpx.Client) -> None:
    place = httpx.URL(studio[0])
    with ExitStack() as stack:
        opened = []
        for _ in range(5 * LIMITS.waiting):
            one = stack.enter_context(socket.create_connection((place.host, place.port), timeout=WAIT_S))
            one.sendall(b"GET / HTTP/1.1\r\nX-Never: ")
            opened.append(one)
        for one in opened[: -LIMITS.waiting]:
            assert ended(one)
        assert httpx.get(f"{studio[0]}/", timeout=WAIT_S).status_code == 200
        assert browser.get("/api/jobs").status_code == 200


def test_the_header_of_a_request_to_the_studio_must_be_complete_in_time(survey: Path) -> None:
    workspace = Workspace(survey, survey.parent / "other", Settings())
    with (
        listen("127.0.0.1", 0) as opened,
        opened_studio(workspace, "127.0.0.1", opened, 1) as (_, app),
        serving(app, opened, Limits(waiting=10, admitted=10, idle_s=0.05)),
        socket.create_connection(opened.getsockname(), timeout=WAIT_S) as one,
    ):
        one.sendall(b"GET / HTTP/1.1\r\nX-Never: ")
        assert ended(one)


def ended(connection: socket.socket) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def test_all_servers_have_the_same_limits() -> None:
    """No other module runs a server of its own."""
    found = [path.relative_to(SRC).as_posix() for path in SRC.rglob("*.py") if "import uvicorn" in path.read_text()]
    assert found == ["common/serving.py"]
