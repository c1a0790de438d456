"""Registered landmarks against where they were expected: planned, surveyed before, or clicked."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from vislam2tag.findings import Finding
from vislam2tag.registration.clicks import Click
from vislam2tag.registration.record import INTERCHANGED

FAR_M = 1.0
"""A landmark farther than this from where the site has it is told."""
CLICK_SIGMAS = 4.0
"""A landmark clicked so far from where it was measured is told."""


def expected_findings(
    placed: Mapping[str, complex], expected: Mapping[str, complex], clicks: Mapping[str, Click]
) -> list[Finding]:
    """Tell what differs from the site's positions and from clicks; two that lie in each other's place are named."""
    far = [name for name, place in placed.items() if name in expected and abs(place - expected[name]) > FAR_M]
    found: list[Finding] = []
    swapped: set[str] = set()
    for one, other in itertools.combinations(far, 2):
        if abs(placed[one] - expected[other]) < FAR_M and abs(placed[other] - expected[one]) < FAR_M:
            swapped |= {one, other}
            message = f"landmarks {one} and {other} lie where the site has the other: sheets or names interchanged?"
            found.append(Finding(kind=INTERCHANGED, file="", count=2, message=message))
    for name in far:
        if name not in swapped:
            off = abs(placed[name] - expected[name])
            message = f"landmark {name} lies {off:.2f} m from where the site has it"
            found.append(Finding(kind="moved_landmark", file="", count=1, message=message))
    if expected and (new := [name for name in placed if name not in expected]):
        message = f"the site has no position of landmark {', '.join(new)}: new, or a mistyped id?"
        found.append(Finding(kind="new_landmark", file="", count=len(new), message=message))
    for name, click in clicks.items():
        off = abs(placed[name] - click.place) if name in placed else 0.0
        if off > CLICK_SIGMAS * click.sigma_m:
            message = f"landmark {name} was clicked {off:.2f} m from where it was measured"
            found.append(Finding(kind="click_differs", file="", count=1, message=message))
    return found
