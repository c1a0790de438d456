"""Requests that no page sends get a refusal with a sentence, and half-sent ones do not keep the page out.

Who is let in, and what stays outside.
"""

from __future__ import annotations

import http.client
import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from PIL import Image

from tests.studio.running import Page, running_studio
from vislam2tag.common.addresses import listen
from vislam2tag.common.serving import Limits, serving
from vislam2tag.settings import Settings
from vislam2tag.studio.app import opened_studio
from vislam2tag.studio.guard import MOST_BODY, Guard
from vislam2tag.studio.openapi import openapi
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


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted({one.path for one in ENDPOINTS if one.body is not None}))
def test_a_body_that_no_page_sends_is_refused(browser: httpx.Client, path: str) -> None:
    endpoint = next(one for one in ENDPOINTS if one.path == path and one.body is not None)
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


def asked(page: Page, method: str, path: str, **headers: str) -> int:
    """Status of a request whose path and headers are sent as they are."""
    place = urlsplit(page.url)
    connection = http.client.HTTPConnection(place.hostname or "", place.port, timeout=30)
    try:
        cookie = "; ".join(f"{name}={value}" for name, value in page.client.cookies.items())
        connection.putrequest(method, path, skip_host=True)
        for name, value in ({"Host": place.netloc, "Cookie": cookie} | headers).items():
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


def test_the_token_is_good_for_one_browser(page: Page) -> None:
    assert page.enter().status_code == 204, "it was used when the page entered, which is in"
    with httpx.Client(base_url=page.url) as other:
        refused = other.get("/api/survey")
        assert (refused.status_code, refused.json()["code"]) == (401, "entry_needed")
        assert other.get("/").status_code == 200, "the page itself holds no data"
        invitation = page.post("/api/invitations", {})
        token = invitation["url"].partition("#")[2]
        assert other.post("/api/enter", json={"token": token}).status_code == 204
        assert other.get("/api/survey").status_code == 200
        assert other.post("/api/enter", json={"token": token}).status_code == 204, "this browser is in"
        with httpx.Client(base_url=page.url) as third:
            refused = third.post("/api/enter", json={"token": token})
            assert (refused.status_code, refused.json()["code"]) == (401, "link_used")
            token = page.post("/api/invitations", {})["url"].partition("#")[2]
            assert other.post("/api/enter", json={"token": token}).status_code == 204, "it stays good for others"
            assert third.post("/api/enter", json={"token": token}).status_code == 204


def test_the_cookie_is_kept_from_scripts_and_other_sites() -> None:
    guard = Guard("127.0.0.1", 8770)
    header = guard.enter(guard.invite())
    assert header is not None
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= {part.strip() for part in header.split(";")}
    assert guard.knows(header.partition(";")[0])
    for wrong in ("", "vislam2tag-studio-8770=", "vislam2tag-studio-8771=x", "=;;=", header.partition(";")[0] + "x"):
        assert not guard.knows(wrong)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Host": "evil.example:{port}"}, 403),
        ({"Host": "localhost:{port}"}, 200),
        ({"Host": "localhost:1"}, 403),
        ({"Host": "192.0.2.1:{port}"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:{port}"}, 200),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Sec-Fetch-Site": "same-site"}, 403),
        ({"Cookie": ""}, 401),
    ],
)
def test_only_its_own_page_at_its_own_address_is_answered(page: Page, headers: dict[str, str], status: int) -> None:
    port = str(urlsplit(page.url).port)
    sent = {name: value.replace("{port}", port) for name, value in headers.items()}
    assert asked(page, "GET", "/api/corrections", **sent) == status


@pytest.mark.parametrize(
    ("host", "listening", "own"),
    [
        ("127.0.0.1:80", "127.0.0.1", True),
        ("[::1]:80", "127.0.0.1", True),
        ("192.168.0.7:80", "127.0.0.1", False),
        ("192.168.0.7:80", "0.0.0.0", True),
        ("tablet.local:80", "0.0.0.0", False),
        ("tablet.local:80", "tablet.local", True),
        ("127.0.0.1", "127.0.0.1", False),
        ("", "", False),
    ],
)
def test_no_name_that_somebody_lets_lead_here_is_its_own(host: str, listening: str, own: bool) -> None:
    assert Guard(listening, 80).is_own(host) is own


@pytest.mark.parametrize(
    "path",
    [
        "/assets/../index.html",
        "/assets/..%2findex.html",
        "/assets/%2e%2e%2f%2e%2e%2fapp.py",
        "/assets//etc/passwd",
        "/api/sessions/..%2f..%2fetc%2fpasswd",
        "/api/sessions/%2e%2e/track",
        "/api/floors/99/plan",
        "/api/layers/..%2fapp?floor=1",
        "/api/tracks?output=..%2f..",
        "/api/nothing",
    ],
)
def test_nothing_outside_the_survey_and_its_labels_is_given(page: Page, path: str) -> None:
    assert asked(page, "GET", path) == 404


def test_headers_that_keep_other_content_out(page: Page) -> None:
    for path in ("/", "/api/survey", "/api/none", "/assets/none"):
        headers = page.client.get(path).headers
        policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == "'self'"
        assert policy["frame-ancestors"] == "'none'"
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"


def test_a_change_must_be_json_and_small(page: Page) -> None:
    form = page.client.post("/api/jobs", content="kind=process", headers={"Content-Type": "text/plain"})
    assert form.status_code == 403
    broken = page.client.post("/api/jobs", content="{", headers={"Content-Type": "application/json"})
    assert (broken.status_code, broken.json()["code"]) == (400, "invalid")
    large = page.client.post("/api/corrections/preview", json={"text": "#" * MOST_BODY, "changes": []})
    assert (large.status_code, large.json()["code"]) == (413, "too_large")
    deep = page.client.post("/api/jobs", content="[" * 100_000, headers={"Content-Type": "application/json"})
    assert deep.status_code == 400
    many = page.client.post("/api/jobs", json={"kind": "process", "sessions": ["nobody"]})
    assert "session nobody does not exist" in many.json()["message"]
    numbers = page.client.get("/api/tracks/window", params={"floor": 1, "left": "nan", "right": 1, "low": 0, "high": 1})
    assert numbers.status_code == 422
    assert page.client.delete("/api/jobs/12345").status_code == 404
    assert page.client.post("/api/survey", json={}).status_code == 405


@pytest.fixture(scope="module")
def second(faulty: Path, page: Page) -> Iterator[Page]:
    del page  # the first studio runs all the while
    with running_studio(faulty / "survey", "--labels", str(faulty / "labels"), "--jobs", "1") as other:
        assert other.enter().status_code == 204
        yield other


def test_two_studios_see_and_never_overwrite_each_other(page: Page, second: Page) -> None:
    before = page.get("/api/corrections")
    events = second.events()
    assert next(events)[0] == "hello"
    saved = page.save('[[exclude_landmark]]\nid = "1"\n', before["version"]).json()
    try:
        heard = next(content for name, content in events if name == "versions")
        assert heard["corrections"] == saved["version"]
        assert second.get("/api/corrections")["text"] == saved["text"]
        late = second.save("# mine\n", before["version"])
        assert late.status_code == 409
        assert late.json()["corrections"]["version"] == saved["version"]
        assert page.get("/api/corrections")["text"] == saved["text"]
        assert second.save("# mine\n", saved["version"]).status_code == 200
        assert page.get("/api/corrections")["text"] == "# mine\n"
    finally:
        events.close()  # type: ignore[attr-defined]
        page.save("", page.get("/api/corrections")["version"])


FILE = Path(__file__).parents[2] / "studio" / "openapi.json"


def test_the_file_that_the_page_is_built_with_is_that_of_the_server() -> None:
    """``python -m vislam2tag.studio.openapi studio/openapi.json`` writes it anew; then ``npm run types`` in studio/."""
    assert json.loads(FILE.read_text(encoding="utf-8")) == openapi()


def test_every_reference_leads_somewhere() -> None:
    described = openapi()
    text = json.dumps(described)
    names = {part.partition('"')[0] for part in text.split('"#/components/schemas/')[1:]}
    assert names == names & described["components"]["schemas"].keys()
    assert len(described["paths"]) > 15
