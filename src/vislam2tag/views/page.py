"""Self-contained HTML pages: templates, their filters, and atomic writing."""

from __future__ import annotations

import base64
import gzip
import io
import math
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from vislam2tag.common.files.whole_output import file_to_write
from vislam2tag.site.site_file import has_site_file, read_site_file


def write_page(out_file: Path, template: str, context: Mapping[str, Any]) -> None:
    """Stream the template's text to the page ``out_file``, which appears complete or not at all.

    Templates extend ``layout.html.j2``. Raises OutputError if it cannot be written.
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


def survey_title(root: Path) -> str:
    """The building's name and the folder of its survey, as the title of a page: "Town hall (survey)"."""
    folder = root.resolve().name
    building = read_site_file(root).name if has_site_file(root) else ""
    return f"{building} ({folder})" if building and building != folder else folder


def embedded(text: str) -> Markup:
    """Make JSON safe inside a script element: it can neither end the element nor open a comment."""
    return Markup(text.replace("<", "\\u003c"))


def data_uri(content: bytes, kind: str = "image/png") -> str:
    """Return a file's content as a data URI."""
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


MISSING = "–"
"""Placeholder for an unknown value."""


def percent(share: float | None) -> str:
    """Write a share 0 to 1 in percent; shares below 1 never read 100 %, and those above 0 never 0 %."""
    if share is None:
        return MISSING
    if 0.995 < share < 1:
        return _unbroken("> 99 %")
    if 0 < share < 0.005:
        return _unbroken("< 1 %")
    return _unbroken(f"{100 * share:.0f} %")


def duration(seconds: float | None) -> str:
    """Write seconds as ``12.3 s``, ``4 min 05 s`` or ``2 h 03 min``."""
    if seconds is None:
        return MISSING
    if seconds < 59.95:
        return _unbroken(f"{seconds:.1f} s")
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return _unbroken(f"{minutes} min {rest:02d} s")
    hours, minutes = divmod(round(seconds / 60), 60)
    return _unbroken(f"{hours} h {minutes:02d} min")


def moment(seconds: float) -> str:
    """Write a moment of a walk, in seconds since its first frame, as minutes and seconds: ``2:10``."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def distance(metres: float | None) -> str:
    """Write metres as ``12 m``, kilometres from ten thousand metres on."""
    if metres is None:
        return MISSING
    return _unbroken(f"{metres / 1000:.1f} km" if metres >= 10_000 else f"{count(round(metres))} m")


def number(value: float | None, decimals: int, unit: str = "") -> str:
    """Write a number with fixed decimals and its unit."""
    return MISSING if value is None else _unbroken(f"{value:.{decimals}f} {unit}".rstrip())


def degrees(radians: float | None) -> str:
    """Write an angle given in radians in degrees."""
    return MISSING if radians is None else _unbroken(f"{math.degrees(radians):.1f} °")


def count(value: int) -> str:
    """Write a count with narrow spaces between thousands."""
    return f"{value:,}".replace(",", "\u202f")


def size(size_bytes: int) -> str:
    """Write a file size in kB or MB (powers of ten)."""
    return _unbroken(f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 1_000_000 else f"{size_bytes / 1e3:.1f} kB")


def words(code: str) -> str:
    """Write a code such as ``scan_throttling`` as words."""
    return code.replace("_", " ")


def _unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


FILTERS = {each.__name__: each for each in (percent, duration, distance, number, degrees, count, size, words)}
"""The filters by their names in templates."""
