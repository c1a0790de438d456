"""Rows of a fleet's catalogue for surveys that are not there."""

from __future__ import annotations

from datetime import date, timedelta

from vislam2tag.pipeline.fleet.catalogue import CATALOGUE, NEW, STATES

DEVICES = ("LG", "S10", "Pixel 8", "OnePlus")


def generated_rows(number: int) -> list[dict[str, object]]:
    """So many surveys of 20 to a site, in every state, all without labels to look at."""
    return [_row(place) for place in range(number)]


def _row(place: int) -> dict[str, object]:
    state, sessions, first = STATES[place % len(STATES)], 4 + place % 40, date(2024, 1, 1) + timedelta(place % 900)
    frames = 0 if state == NEW else 9000 * sessions
    return dict.fromkeys(CATALOGUE, None) | {
        "survey": f"survey-{place:06d}",
        "site": f"Hospital {place // 20}",
        "floors": list(range(place % 7 + 1)),
        "devices": list(DEVICES[: place % 4 + 1]),
        "first_date": first,
        "last_date": first + timedelta(place % 5),
        "sessions": sessions,
        "failed": int(state == "failed"),
        "state": state,
        "duration_s": 300.0 * sessions,
        "distance_m": 250.0 * sessions,
        "frames": frames,
        "frames_labelled": frames * 97 // 100,
    }
