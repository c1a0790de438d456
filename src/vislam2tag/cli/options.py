"""What several commands share: their arguments, what wrong values are told as, the exit code of an interrupt."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.dataset.transmitters.privacy import Privacy
    from vislam2tag.pipeline.run.selection import Selection

INTERRUPTED = 130
"""Exit code of a command ended by Ctrl-C, as shells have it."""
ALL_CORES = os.cpu_count() or 1
_OPTION_NAMES = {
    "max_sigma_m": "max-sigma",
    "block_m": "block-size",
    "guard_m": "guard",
    "cell_m": "cell",
    "radius_m": "radius",
    "spacing_m": "spacing",
    "nearest_m": "nearest",
    "speed_m_s": "speed",
    "time_limit_s": "time-limit",
    "shot_sigma_m": "shot-sigma",
    "tape_sigma_m": "tape-sigma",
    "plan_sigma_m": "plan-sigma",
}
"""Options that are not named like their setting."""

SurveyFolder: TypeAlias = Annotated[Path, typer.Argument(help="Survey folder (with floor_K/DEVICE/SESSION below).")]
LandmarkFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Landmarks of all floors (columns as in marker_dict.csv, with floor) instead of the floors' files.",
    ),
]
Floors: TypeAlias = Annotated[list[int] | None, typer.Option(help="Only this floor; repeatable.")]
Devices: TypeAlias = Annotated[list[str] | None, typer.Option(help="Only this device; repeatable.")]
Replace: TypeAlias = Annotated[
    bool, typer.Option("--replace", help="Replace what another command or another strategy left in OUT.")
]
Jobs: TypeAlias = Annotated[int, typer.Option(min=1, help="Processes to run at once.")]
MaxStep: TypeAlias = Annotated[
    float, typer.Option(min=0.01, help="local-corrected discards segments with a longer step, metres.")
]


def selection_of(floors: list[int] | None, devices: list[str] | None) -> Selection:
    """Choose the sessions of these floors and devices; none given: all."""
    from vislam2tag.pipeline.run.selection import Selection

    return Selection(floors=tuple(floors or ()), devices=tuple(devices or ()))


@contextmanager
def wrong_values_told() -> Iterator[None]:
    """Tell a value that the settings refuse by the name of its option."""
    from pydantic import ValidationError

    try:
        yield
    except ValidationError as error:
        wrong = error.errors()[0]
        field = str(wrong["loc"][-1])
        option = _OPTION_NAMES.get(field, field.replace("_", "-"))
        raise UsageError(f"--{option} {wrong['input']}: {wrong['msg']}") from error


IncludeNomap: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--include-nomap", help="Keep networks named ..._nomap; they are left out otherwise, as their owners ask."
    ),
]
HashBssid: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="KEYFILE",
        help="Replace BSSIDs by keyed hashes; the file holds a secret of at least 16 bytes. "
        "Sets hashed with one key can be joined.",
    ),
]
NoSsid: TypeAlias = Annotated[bool, typer.Option("--no-ssid", help="Leave the names of networks out.")]


def privacy_of(include_nomap: bool, hash_bssid: Path | None, no_ssid: bool) -> Privacy:
    """Make the wish of these options' values; raises UsageError for a key that cannot be used."""
    from vislam2tag.dataset.transmitters.privacy import Privacy, read_key

    key = None if hash_bssid is None else read_key(hash_bssid)
    return Privacy(include_nomap=include_nomap, hash_key=key, keep_ssids=not no_ssid)
