"""Options that several commands share, and the values that they stand for."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.plugins import DATASET_FORMATS

if TYPE_CHECKING:
    from vislam2tag.dataset.privacy import Privacy
    from vislam2tag.pipeline.run.selection import Selection
    from vislam2tag.pipeline.run.workers import Executor


INTERRUPTED = 130
"""Exit code of a command ended by Ctrl-C, as shells have it."""
ALL_CORES = os.cpu_count() or 1

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
    bool,
    typer.Option("--replace", help="Replace what another strategy or command wrote in OUT, the whole folder."),
]
FollowLinks: TypeAlias = Annotated[
    bool,
    typer.Option("--follow-links", help="Share files, too, that links lead to outside the given folder."),
]
DryRun: TypeAlias = Annotated[bool, typer.Option("--dry-run", help="Say what would run, and why, and write nothing.")]
AsJson: TypeAlias = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")]
Jobs: TypeAlias = Annotated[int, typer.Option(min=1, show_default="all cores", help="Processes to run at once.")]


def format_help(otherwise: str = "") -> str:
    """Help of ``--format``: the formats of other packages are named, ours stand in the command's help."""
    names = ", ".join(DATASET_FORMATS.installed)
    return f"One of those above{f', or of other packages: {names}' if names else ''}{otherwise}."


def selection_of(floors: list[int] | None, devices: list[str] | None) -> Selection:
    """Choose the sessions of these floors and devices; none given: all."""
    from vislam2tag.pipeline.run.selection import Selection

    return Selection(floors=tuple(floors or ()), devices=tuple(devices or ()))


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
    from vislam2tag.dataset.privacy import Privacy, read_key

    key = None if hash_bssid is None else read_key(hash_bssid)
    return Privacy(include_nomap=include_nomap, hash_key=key, keep_ssids=not no_ssid)


def value_of(text: str) -> Any:
    """Read numbers, true, false, null and lists as JSON has them, anything else as text."""
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return tuple(value) if isinstance(value, list) else value


def parameters_of(texts: Sequence[str]) -> dict[str, Any]:
    """Read ``PARAMETER=VALUE``; raises UsageError for what is not of this form."""
    parameters = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise UsageError(f"--set {text}: give PARAMETER=VALUE, such as k=5")
        parameters[name] = value_of(value)
    return parameters


class ExecutorName(Enum):
    """Where sessions run."""

    LOCAL = "local"
    DASK = "dask"


SchedulerAddress: TypeAlias = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, tcp://HOST:8786, for --executor dask.")
]
ClusterFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Cluster to make for --executor dask, as TOML (docs/how-to/fleets.md)."),
]


WhereSessionsRun: TypeAlias = Annotated[
    ExecutorName, typer.Option(help="Where sessions run: in --jobs processes here, or on a Dask cluster.")
]


@contextmanager
def executor_of(
    name: ExecutorName,
    scheduler: str | None,
    cluster: Path | None,
    jobs: int,
    on_cluster: Callable[[Any, Callable[[str], None]], Executor],
) -> Iterator[Executor]:
    """Yield what runs sessions as the options say; raises UsageError for options that do not go together.

    ``on_cluster`` makes it of a ``distributed.Client`` and a function that prints a line.
    """
    if name is ExecutorName.LOCAL:
        from functools import partial

        from vislam2tag.pipeline.run.workers import process_all

        if scheduler is not None or cluster is not None:
            raise UsageError("--scheduler and --cluster go with --executor dask: add that")
        yield partial(process_all, workers=jobs)
        return
    from vislam2tag.pipeline.run.cluster import connected

    tell = lambda line: say(line, err=True)
    with connected(scheduler, cluster, tell) as client:
        yield on_cluster(client, tell)
