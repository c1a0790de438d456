"""Which texts on a plan are numbers or names of rooms."""

from __future__ import annotations

import re
from collections.abc import Sequence

from vislam2tag.site.plans.source import PlanText

_NUMBER = re.compile(
    r"(?=(?:\D*\d){3}|[A-Z]*\d+[.\-/]\d)(?:[A-Z]{1,3}[ .\-/]?)?\d{1,4}(?:[.\-/]\d{1,4}){0,2} ?[A-Za-z]?"
)
_SURE = re.compile(r"[A-Za-z]|\d\D\d+\D\d")
"""Dimensions have neither a letter nor three parts."""
_DISTINCT = 0.9
"""Numbers of which fewer differ are dimensions: two rooms have two numbers."""
_NAME = re.compile(
    r"(office|büro|buero|bureau|ufficio|oficina|lab|flur|corridor|couloir|corridoio|pasillo|wc|toilet|küche|kueche"
    r"|kitchen|cuisine|cucina|cocina|lager|storage|storeroom|archiv|meeting|besprechung|seminar|hörsaal|class|klasse"
    r"|foyer|lobby|server|teeküche|treppenhaus|sala |salle |room|raum|zimmer|aula)",
    re.IGNORECASE,
)


def room_labels(texts: Sequence[PlanText]) -> tuple[PlanText, ...]:
    """Texts (or a line of them) that are room numbers, each number once; names of rooms if there are no numbers."""
    lines = [PlanText(line.strip(), one.place_m) for one in texts for line in one.text.splitlines()]
    numbers = [one for one in lines if _NUMBER.fullmatch(one.text)]
    if len({one.text for one in numbers}) < _DISTINCT * len(numbers):
        numbers = [one for one in numbers if _SURE.search(one.text)]
    if numbers:
        return tuple({one.text: one for one in numbers}.values())
    return tuple(one for one in lines if _NAME.match(one.text))
