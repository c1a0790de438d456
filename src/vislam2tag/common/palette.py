"""What statuses and events mean to a reader, and how they are drawn.

The colours are those of Okabe and Ito, which the colour-blind can distinguish.
"""

from __future__ import annotations

from dataclasses import dataclass

from vislam2tag.core.status import EventKind, Status


@dataclass(frozen=True)
class StatusStyle:
    """Name, one-sentence meaning, colour and line dash of a status (the dash distinguishes causes in grey prints)."""

    label: str
    name: str
    meaning: str
    colour: str
    dash: str


def _style(status: Status, name: str, colour: str, dash: str, meaning: str) -> StatusStyle:
    return StatusStyle(label=status.label, name=name, meaning=meaning, colour=colour, dash=dash)


STATUS_STYLES: dict[str, StatusStyle] = {
    style.label: style
    for style in (
        _style(Status.OK, "labelled (ok)", "#0072b2", "solid", "Labelled: the position is known."),
        _style(
            Status.UNCERTAIN,
            "uncertain",
            "#56b4e9",
            "solid",
            "The position is less certain than the survey requires, so it does not count as labelled.",
        ),
        _style(
            Status.BEFORE_FIRST_LANDMARK,
            "before first landmark",
            "#e69f00",
            "dot",
            "The walk had not yet passed a landmark, so nothing ties it to the building.",
        ),
        _style(
            Status.AFTER_LAST_LANDMARK,
            "after last landmark",
            "#9a6200",
            "dot",
            "The walk went on after its last landmark; end walks at a landmark to avoid this.",
        ),
        _style(
            Status.TRACKING_LOST,
            "tracking lost",
            "#d55e00",
            "dash",
            "The phone lost track of its own motion, for example in the dark or in front of a blank wall.",
        ),
        _style(
            Status.BREAK,
            "break",
            "#cc79a7",
            "dashdot",
            "The recorded path jumps further than a person can walk, so the stretch between two landmarks is "
            "discarded.",
        ),
        _style(
            Status.NO_MAPPING,
            "no mapping",
            "#4d4d4d",
            "longdash",
            "No position could be computed, for example because fewer than two known landmarks were passed.",
        ),
        _style(
            Status.AMBIGUOUS,
            "ambiguous",
            "#8c6bb1",
            "dash",
            "The walk's shape fits several places of the plan, so its place is not known.",
        ),
        _style(
            Status.FITS_NOWHERE,
            "fits nowhere",
            "#6e016b",
            "dashdot",
            "The walk goes through walls wherever it is put on the plan, or fits as well with a wrong turn in its "
            "middle.",
        ),
        _style(
            Status.FITS_MIRROR,
            "fits mirrored",
            "#c51b8a",
            "dot",
            "The plan fits the walk's mirror image nearly as well, so the fit may be by chance.",
        ),
        _style(
            Status.FITS_OTHER_FLOOR,
            "fits another floor",
            "#88419d",
            "longdash",
            "The plan of another floor fits the walk nearly as well or better.",
        ),
        _style(
            Status.TOO_SHORT,
            "too short",
            "#9ebcda",
            "dash",
            "The walk is too short to have only one place on the plan.",
        ),
        _style(
            Status.PLAN_TOO_OPEN,
            "plan too open",
            "#bfa3c9",
            "dot",
            "The plan shows so few walls that the walk fits almost everywhere.",
        ),
        _style(
            Status.GAP,
            "gap",
            "#009e73",
            "dot",
            "The reading is between two camera frames that are too far apart in time to interpolate.",
        ),
        _style(
            Status.OUTSIDE_FRAMES,
            "outside frames",
            "#7f7f7f",
            "dot",
            "The reading was taken before the first or after the last camera frame.",
        ),
        _style(
            Status.DUPLICATE,
            "repeated",
            "#c4c4c4",
            "dot",
            "The same frame or reading was recorded before. It counts once, and the repetition is in no percentage.",
        ),
        _style(
            Status.INVALID,
            "invalid",
            "#000000",
            "dot",
            "The record cannot be used, for example because its time runs backward, a number is not finite, or a "
            "correction excludes it.",
        ),
    )
}
"""Style of each status, by label, in the order of every chart and list."""


@dataclass(frozen=True)
class EventStyle:
    """Name, one-sentence meaning, marker symbol and colour of a kind of tracker event."""

    name: str
    meaning: str
    symbol: str
    colour: str


EVENT_STYLES: dict[EventKind, EventStyle] = {
    EventKind.MAP_UPDATE: EventStyle(
        "map update",
        "Camera and landmarks moved together: the tracker re-expressed its map. Harmless.",
        "diamond-open",
        "#6e7781",
    ),
    EventKind.CORRECTION: EventStyle(
        "correction",
        "Camera and landmarks moved by different amounts: the tracker corrected its drift.",
        "triangle-up-open",
        "#009e73",
    ),
    EventKind.BREAK: EventStyle(
        "break", "The recorded camera jumped, but the landmarks did not.", "x-thin-open", "#d55e00"
    ),
    EventKind.RELOCALISATION: EventStyle(
        "relocalisation",
        "The recorded camera jumped when the tracker recognised its surroundings.",
        "star-open",
        "#cc79a7",
    ),
    EventKind.LOSS: EventStyle(
        "loss",
        "Tracking was lost for a while. The size is the distance that the camera moved, according to the tracker.",
        "square-x-open",
        "#d55e00",
    ),
    EventKind.SLIP: EventStyle(
        "slip",
        "Between two landmarks the walk drifted far more than usual; the event is marked midway.",
        "hourglass-open",
        "#e69f00",
    ),
    EventKind.STANDING: EventStyle("standing", "No tracker: the walker stood still.", "circle-open", "#6e7781"),
    EventKind.TURN: EventStyle("turn in place", "No tracker: the walker turned on the spot.", "circle-dot", "#0072b2"),
    EventKind.STAIRS: EventStyle(
        "stairs", "No tracker: air pressure shows stairs or an escalator.", "y-up-open", "#009e73"
    ),
    EventKind.LIFT: EventStyle(
        "lift", "No tracker: air pressure shows a change of height without steps.", "square-open", "#009e73"
    ),
    EventKind.DOUBTFUL_FIX: EventStyle(
        "doubtful fix",
        "A known position contradicts the other positions of the walk by more than chance.",
        "diamond-x-open",
        "#d55e00",
    ),
}
"""Style of each kind of event, in the order of every list."""


def style_of(label: str) -> StatusStyle:
    """Return the style of a status label; raises KeyError for a label no status has."""
    return STATUS_STYLES[label]
