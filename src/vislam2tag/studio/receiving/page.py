"""The page that a phone's browser gets: what this is, and a form to send a zip by hand."""

from __future__ import annotations

import base64
import hashlib
from importlib import resources

_TEXT = resources.files("vislam2tag.studio.receiving").joinpath("page.html").read_text(encoding="utf-8")
PAGE = _TEXT
"""HTML without anything of the survey in it; the token stays in the address's fragment, which browsers send nowhere."""


def _hash_of(tag: str) -> str:
    """Hash of the one inline element of a tag, for the content security policy."""
    content = _TEXT.split(f"<{tag}>", 1)[1].split(f"</{tag}>", 1)[0]
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"


PAGE_HEADERS = {
    "Content-Security-Policy": "; ".join(
        (
            "default-src 'none'",
            f"script-src {_hash_of('script')}",
            f"style-src {_hash_of('style')}",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    ),
    "Referrer-Policy": "no-referrer",
}
