"""Access control of the studio: browsers need a token, the studio's own address, and its own page."""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from pathlib import Path

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from vislam2tag.common.addresses import EVERYWHERE
from vislam2tag.studio.receiving.token import new_token

MOST_BODY = 1 << 20
"""Maximum bytes of a request, except for files."""
BODIES = ("application/json", "application/octet-stream")
"""Content types of bodies, which other pages cannot send without a preflight request."""
MOST_INVITATIONS = 20
"""Maximum number of unused tokens; the oldest is removed."""
PAGE = Path(__file__).parent / "page"
"""The first file for the browser."""
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src 'self'; worker-src 'self' blob:; manifest-src 'self'; base-uri 'none'; form-action 'none'"
)
"""The page's content policy on any server."""
HEADERS = {
    "Content-Security-Policy": f"{CONTENT_POLICY}; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@dataclass
class Guard:
    """Tokens, each valid for one browser, and the cookies of these browsers."""

    host: str
    """The address of the server."""
    port: int
    _tokens: list[str] = field(default_factory=list)
    _cookies: set[str] = field(default_factory=set)

    @property
    def cookie_name(self) -> str:
        """Differs for each port, because browsers send a host's cookies to all its ports."""
        return f"vislam2tag-studio-{self.port}"

    def invite(self) -> str:
        """A token for one more browser."""
        token = new_token()
        self._tokens = [*self._tokens, token][-MOST_INVITATIONS:]
        return token

    def enter(self, token: str) -> str | None:
        """The cookie for a token, which is then used up; None if it is wrong."""
        known = [each for each in self._tokens if hmac.compare_digest(each.encode(), token.encode())]
        if not known:
            return None
        self._tokens.remove(known[0])
        cookie = secrets.token_urlsafe(32)
        self._cookies.add(cookie)
        return f"{self.cookie_name}={cookie}; HttpOnly; SameSite=Strict; Path=/"

    def knows(self, header: str) -> bool:
        """Whether a header ``Cookie`` contains a valid cookie."""
        try:
            morsel = SimpleCookie(header).get(self.cookie_name)
        except CookieError:
            return False
        return morsel is not None and any(hmac.compare_digest(each, morsel.value) for each in self._cookies)

    def is_own(self, host: str) -> bool:
        """Whether a header ``Host`` names this server, and not a name that an attacker redirects here.

        IP addresses cannot be redirected, so any is valid if the server listens on all.
        """
        name, _, port = host.rpartition(":")
        if port != str(self.port):
            return False
        name = name.removeprefix("[").removesuffix("]")
        if name in ("localhost", self.host):
            return True
        try:
            address = ip_address(name)
        except ValueError:
            return False
        return address.is_loopback or self.host in EVERYWHERE

    def refusal(self, method: str, headers: dict[str, str]) -> str | None:
        """Why a request is not from the studio's page; None if it may be."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self.is_own(host):
            return "this is not the address of the studio; open the address that the terminal shows"
        if origin is not None and origin != f"http://{host}":
            return "another page asked for this"
        if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
            return "another page asked for this"
        if method in ("POST", "PUT") and headers.get("content-type", "").partition(";")[0] not in BODIES:
            return f"a change must be sent as {' or '.join(BODIES)}"
        return None


class OwnHeaders:
    """Adds our headers to all that an application answers."""

    def __init__(self, app: ASGIApp) -> None:
        """Wrap an application."""
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)
