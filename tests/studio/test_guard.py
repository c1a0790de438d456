"""Who is let in, and what stays outside."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest

from tests.studio.running import Page, running_studio
from vislam2tag.studio.guard import MOST_BODY, Guard


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
    assert page.enter().status_code == 401, "it was used when the page entered"
    with httpx.Client(base_url=page.url) as other:
        refused = other.get("/api/survey")
        assert (refused.status_code, refused.json()["code"]) == (401, "entry_needed")
        assert other.get("/").status_code == 200, "the page itself holds no data"
        invitation = page.post("/api/invitations", {})
        token = invitation["url"].partition("#")[2]
        assert other.post("/api/enter", json={"token": token}).status_code == 204
        assert other.get("/api/survey").status_code == 200
        assert other.post("/api/enter", json={"token": token}).status_code == 401


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
    assert "there is no session nobody" in many.json()["message"]
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
