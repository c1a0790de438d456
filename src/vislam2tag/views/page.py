"""An HTML page that needs nothing else: written from a template, whole or not at all."""

from __future__ import annotations

import base64
import gzip
import io
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from vislam2tag.common.files.whole_file import file_to_write
from vislam2tag.views.wording import FILTERS


def write_page(out_file: Path, template: str, context: Mapping[str, Any]) -> None:
    """Write the page ``out_file``, the template's text as it comes, whole or not at all.

    Templates extend ``layout.html.j2``. Raises OutputError where it cannot be written.
    """
    page = _environment().get_template(template).generate(dict(context))
    # A folder name of broken bytes cannot be written as UTF-8; the page shows it with question marks.
    with file_to_write(out_file) as file:
        stream = io.TextIOWrapper(file, encoding="utf-8", errors="replace", newline="\n")
        stream.writelines(page)
        stream.detach()


def page_text(template: str, context: Mapping[str, Any]) -> str:
    """Return a page as text; the template gets what :func:`write_page` gives it."""
    return _environment().get_template(template).render(dict(context))


def embedded(text: str) -> Markup:
    """Make JSON safe inside a script element: nothing in it can end the element or open a comment."""
    return Markup(text.replace("<", "\\u003c"))


def data_uri(content: bytes, kind: str = "image/png") -> str:
    """Return a file's content as an address that holds it, to be placed inside the page."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _text_of(name: str) -> Markup:
    """A style or a script among the templates."""
    return Markup((resources.files("vislam2tag.views") / "templates" / name).read_text("utf-8"))


@cache
def _packed_plotly() -> str:
    """Plotly for browsers, packed with gzip as Base64: a third of its size, and the page's text is shown before it."""
    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), compresslevel=6, mtime=0)).decode("ascii")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("vislam2tag.views"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    environment.globals.update(embedded=embedded, text_of=_text_of, packed_plotly=_packed_plotly)
    return environment
