"""What the columns of a site's tables are: other names, orders, units and decimal marks than ours are understood."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vislam2tag.site.corrections.file import UNITS_M

_UNITS_M = {"m": 1.0, "metre": 1.0, "meter": 1.0, **UNITS_M, "feet": UNITS_M["ft"]}
_UNIT = re.compile(rf"^(.+?)(?:[\s_]*[\[(]\s*|[\s_]+)({'|'.join(_UNITS_M)})s?\s*[\])]?$")
_NO_LETTER = re.compile(r"[^a-zäöü]")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+")
_POINT_NUMBER = re.compile(r"[+-]?\d*\.\d+")


@dataclass(frozen=True)
class TableColumns:
    """The columns that a table may have, each with other names for it: lower case, letters only."""

    names: Mapping[str, str]
    texts: frozenset[str]
    """Those that hold no lengths: neither units nor decimal marks are changed there."""
    first: tuple[str, ...]
    """Columns that come first in this order, wherever the file has them."""
    needed: tuple[str, ...]

    def of(self, name: str) -> str | None:
        """The column that a name without unit stands for."""
        if name in self.names:
            return name
        plain = _NO_LETTER.sub("", name)
        return next((column for column, others in self.names.items() if plain in (column, *others.split())), None)


_EAST = "e east easting ost ostwert rechts rechtswert rw xcoord xcoordinate xpos xposition posx"
_NORTH = "n north northing nord nordwert hoch hochwert hw ycoord ycoordinate ypos yposition posy"
_FLOOR = "level storey story etage stockwerk geschoss stock ebene floornumber"
LANDMARKS = TableColumns(
    {
        "id": "name marker markerid landmark landmarkid no nr number nummer punkt punktnr point pointid marke",
        "x": _EAST,
        "y": _NORTH,
        "z": "h height elevation altitude hoehe höhe zcoord zcoordinate zpos posz",
        "floor": _FLOOR,
        "sigma_m": "sigma sd std accuracy genauigkeit",
        "heading_rad": "",
        "heading_sigma_rad": "",
        "sheet": "",
        "width_m": "",
    },
    texts=frozenset({"id", "floor", "heading_rad", "heading_sigma_rad", "sheet"}),
    first=("id",),
    needed=("x", "y"),
)
CONTROL_POINTS = TableColumns(
    {"x": _EAST, "y": _NORTH, "id": LANDMARKS.names["id"]}, frozenset({"id"}), first=("x", "y"), needed=("x", "y")
)
ROOMS = TableColumns(
    {"id": "name room raum raumnummer zimmer label bezeichnung number no nr nummer", "x": _EAST, "y": _NORTH},
    frozenset({"id"}),
    first=("id",),
    needed=("x", "y"),
)
FLOORS = TableColumns(
    {
        "id": f"floor number no nr nummer {_FLOOR}",
        "width": "breite x",
        "height": "depth length länge laenge tiefe y",
        "elevation": "z höhe hoehe altitude",
        "name": "label bezeichnung",
    },
    texts=frozenset({"id", "name"}),
    first=(),
    needed=("id", "width", "height"),
)


@dataclass(frozen=True)
class Understood:
    """A table's columns: names in our order, where each stands in the file, and metres a unit of each."""

    header: tuple[str, ...]
    order: tuple[int, ...]
    factors: Mapping[int, float]
    """By place in our order; 1 where not named."""
    guesses: tuple[str, ...] = ()
    """What was taken for what, in words."""
    numeric: frozenset[int] = field(default=frozenset())
    """Places, in our order, of columns that hold numbers."""


def understood(header: Sequence[str], columns: TableColumns) -> Understood:
    """Say what a header's fields are; one that is no column keeps its own name, in lower case."""
    found: list[tuple[str, float]] = []
    guesses: list[str] = []
    for written in header:
        name, factor = _column(written, columns)
        if name is not None and name not in (taken for taken, _ in found):
            found.append((name, factor))
            if name != written.lower():
                unit = "" if factor == 1.0 else f" (a unit is {factor:g} m)"
                guesses.append(f"{written} was taken for {name}{unit}")
        else:
            found.append((written.lower(), 1.0))
    own = _column(header[0], columns)[0] if header else None
    if columns.first[:1] == ("id",) and found and (own == "id" or (own is None and "id" not in dict(found))):
        guesses = [guess for guess in guesses if not guess.startswith(f"{header[0]} was taken")]
        order = list(range(len(found)))  # the first column is the id, whatever its name, where none is called so
    else:
        names = [name for name, _ in found]
        ahead = [names.index(name) for name in columns.first if name in names]
        order = [*ahead, *(i for i in range(len(found)) if i not in ahead)]
    ours = tuple(found[i][0] for i in order)
    return Understood(
        header=ours,
        order=tuple(order),
        factors={place: found[i][1] for place, i in enumerate(order) if found[i][1] != 1.0},
        guesses=tuple(guesses),
        numeric=frozenset(
            place for place, name in enumerate(ours) if name in columns.names and name not in columns.texts
        ),
    )


def _column(written: str, columns: TableColumns) -> tuple[str | None, float]:
    """The column that a field of a header names, and metres a unit."""
    text = written.strip().lower()
    if text in columns.names:
        return text, 1.0
    with_unit = _UNIT.match(text)
    name = columns.of(with_unit.group(1)) if with_unit else None
    if with_unit and name is not None and name not in columns.texts:
        return name, _UNITS_M[with_unit.group(2)]
    return columns.of(text), 1.0


def has_decimal_comma(rows: Sequence[Sequence[str]], places: frozenset[int]) -> bool:
    """Whether numbers have a decimal comma, and none a point."""
    cells = [fields[place] for fields in rows for place in places if place < len(fields)]
    return any(map(_COMMA_NUMBER.fullmatch, cells)) and not any(map(_POINT_NUMBER.fullmatch, cells))


def number_text(text: str, factor: float, *, decimal_comma: bool) -> str:
    """A number's text in metres with a decimal point; other text as it is."""
    if decimal_comma and _COMMA_NUMBER.fullmatch(text):
        text = text.replace(",", ".")
    if factor == 1.0 or not text:
        return text
    try:
        return repr(float(text) * factor)
    except ValueError:
        return text
