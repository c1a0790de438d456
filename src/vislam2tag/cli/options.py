"""Options that several commands share, and their values.

Those that are settings are made from the tree of settings, so that each is described once.
"""

from __future__ import annotations

import ast
import inspect
import json
import os
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from vislam2tag.cli.records import option, settings_given
from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import UsageError
from vislam2tag.common.plugins import DATASET_FORMATS
from vislam2tag.common.records import FiniteRecord
from vislam2tag.settings import Settings, extreme_setting, part_of, read_settings, with_values, wrong_setting
from vislam2tag.site.settings import SETTINGS_FILE

if TYPE_CHECKING:
    from vislam2tag.datasets.privacy import Privacy
    from vislam2tag.pipeline.run.selection import Selection
    from vislam2tag.pipeline.run.workers import Executor


ConfigFile: TypeAlias = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Settings as a TOML file; options override it.")
]
OPTION_NAMES = {
    "simulation.building.landmarks": "landmark-count",
    "labels.rule": "label-rule",
    "plan.sheets": "paper",
    "dataset.wifi_window_s": "window",
    "dataset.ble_window_s": "ble-window",
    "dataset.magnetic_window_s": "magnetic-window",
    "dataset.imu.length_s": "imu-window",
    "radio_maps.cell_m": "cell",
    "radio_maps.reach_m": "reach",
}
"""Options that are not named like their setting, hyphens for underscores."""


def option_of(name: str) -> str:
    """The option that gives a setting: ``--max-sigma-m`` for ``labels.max_sigma_m``."""
    return "--" + OPTION_NAMES.get(name, name.rpartition(".")[2].replace("_", "-"))


def setting(name: str, *, hidden: bool = False) -> Any:
    """Describe an option that gives a setting as the setting is described; None where it is not given."""
    record, field = owner_of(name)
    text = texts_of(record)[name.rpartition(".")[2]].replace("`", "")
    flag = option_of(name)
    names = f"{flag}/--no-{flag[2:]}" if field.annotation is bool else flag
    default = getattr(field.default, "value", field.default)
    shown = text if default is None else f"{text}  [default: {str(default).lower()}]"
    return option(None, shown, names, hidden=hidden, sets=(name,))


def settings_from(given: Any, survey: Path | None = None) -> Settings:
    """Settings of a command's ``--config`` with those that its options give; see :func:`settings_of`."""
    return settings_of(given.config, settings_given(given), survey)


def settings_of(config: Path | None, given: Mapping[str, object], survey: Path | None = None) -> Settings:
    """Settings of a file with those that options give, by full name, in their place; None: not given.

    Without a file, ``vislam2tag.toml`` of the ``survey`` is used if it exists, and its name is printed.

    Raises UsageError that names the file and the setting, or the option as it was typed.
    """
    if config is None and survey is not None and (survey / SETTINGS_FILE).is_file():
        config = survey / SETTINGS_FILE
        say(f"settings of {config}", err=True)
    settings = Settings() if config is None else read_settings(config, partial(say, err=True))
    given = {name: value for name, value in given.items() if value is not None}
    try:
        settings = with_values(settings, given)
    except ValidationError as error:
        name, why = wrong_setting(error)
        raise UsageError(f"{option_of(name)} {why}") from error
    if extreme := extreme_setting(settings):
        name = option_of(extreme[0]) if extreme[0] in given else f"--config {config}: {extreme[0]}"
        raise UsageError(f"{name}: {extreme[1]:g} is out of range; expected a number between 1e-6 and 1e9")
    return settings


def owner_of(full_name: str) -> tuple[type[FiniteRecord], FieldInfo]:
    """The class that a setting is a field of, and the field."""
    *parts, last = full_name.split(".")
    record: type[FiniteRecord] = Settings
    for name in parts:
        part = part_of(record.model_fields[name])
        assert part is not None, name
        record = part
    return record, record.model_fields[last]


@cache
def texts_of(record: type[FiniteRecord]) -> dict[str, str]:
    """The description below each field of a class, on one line and without markup."""
    texts: dict[str, str] = {}
    for base in record.__bases__:  # inherited fields are described there
        if issubclass(base, FiniteRecord):
            texts |= texts_of(base)
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(record))).body
    assert isinstance(body, ast.ClassDef)
    last = ""
    for node in body.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            last = node.target.id
            texts[last] = ""
        elif last and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            texts[last] = " ".join(str(node.value.value).replace("``", "`").split())
            last = ""
    return texts


ALL_CORES = os.cpu_count() or 1

SurveyFolder: TypeAlias = Annotated[Path, typer.Argument(help="Survey folder (with floor_K/DEVICE/SESSION below).")]
SiteFolder: TypeAlias = Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")]
LandmarkFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Landmark file of all floors (marker_dict.csv with a floor column) to use instead of the floors' files.",
    ),
]
Floors: TypeAlias = Annotated[tuple[int, ...], typer.Option(help="Only this floor; repeatable.")]
Replace: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--replace",
        help="Replace the whole folder OUT, even if it was written with another strategy or by another command.",
    ),
]
FollowLinks: TypeAlias = Annotated[
    bool,
    typer.Option("--follow-links", help="Also use files outside the given folder that links point to."),
]
DryRun: TypeAlias = Annotated[bool, typer.Option("--dry-run", help="Print what would run and why, and write nothing.")]
AsJson: TypeAlias = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")]
Jobs: TypeAlias = Annotated[int, typer.Option(min=1, show_default="all cores", help="Number of parallel processes.")]
Description: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="A dataset.toml with title, creators and licence."),
]
Technology: TypeAlias = Annotated[
    str | None,
    typer.Option(help="Fingerprints to use: wifi, ble or wifi+ble.  [default: wifi, else what the data set contains]"),
]


def format_help(otherwise: str = "") -> str:
    """Help of ``--format``. Names the formats of plug-ins; the command's help lists ours."""
    names = ", ".join(DATASET_FORMATS.installed)
    return f"A format from the list above{f', or of a plug-in: {names}' if names else ''}{otherwise}."


@dataclass(frozen=True, kw_only=True)
class SessionOptions:
    """Sessions to use; all by default."""

    floor: Floors = ()
    device: tuple[str, ...] = option((), "Only this device; repeatable.")

    @property
    def selection(self) -> Selection:
        """The sessions of these floors and devices."""
        from vislam2tag.pipeline.run.selection import Selection

        return Selection(floors=self.floor, devices=self.device)


@dataclass(frozen=True, kw_only=True)
class PrivacyOptions:
    """Parts of a data set to remove or hash."""

    include_nomap: bool = option(
        False, "Keep networks named ..._nomap. By default they are removed, as their owners ask."
    )
    hash_bssid: Path | None = option(
        None,
        "Replace BSSIDs by keyed hashes. The file contains a secret of at least 16 bytes. "
        "Data sets with the same key can be joined.",
        metavar="KEYFILE",
    )
    no_ssid: bool = option(False, "Remove the names of networks.")

    @property
    def privacy(self) -> Privacy:
        """As a record; raises UsageError for an unusable key."""
        from vislam2tag.datasets.privacy import Privacy

        return Privacy(include_nomap=self.include_nomap, hash_key=key_of(self.hash_bssid), keep_ssids=not self.no_ssid)


def key_of(file: Path | None) -> bytes | None:
    """Read the secret for hashes; raises UsageError for an unusable file."""
    from vislam2tag.datasets.privacy import read_key

    return None if file is None else read_key(file)


class ExecutorName(Enum):
    """Where sessions run."""

    LOCAL = "local"
    DASK = "dask"


@dataclass(frozen=True, kw_only=True)
class ExecutorOptions:
    """Where sessions run."""

    executor: ExecutorName = option(ExecutorName.LOCAL, "Run sessions in --jobs local processes, or on a Dask cluster.")
    scheduler: str | None = option(
        None, "Address of a Dask scheduler, tcp://HOST:8786, for --executor dask.", metavar="ADDRESS"
    )
    cluster: Path | None = option(None, "TOML file of a cluster to start for --executor dask.", metavar="FILE")

    @contextmanager
    def opened(self, jobs: int) -> Iterator[Executor]:
        """Yield the executor; raises UsageError for contradicting options."""
        if self.executor is ExecutorName.LOCAL:
            from functools import partial

            from vislam2tag.pipeline.run.workers import process_all

            if self.scheduler is not None or self.cluster is not None:
                raise UsageError("--scheduler and --cluster also need --executor dask")
            yield partial(process_all, workers=jobs)
            return
        from vislam2tag.pipeline.run.dask import DaskExecutor, connected

        tell = lambda line: say(line, err=True)
        with connected(self.scheduler, self.cluster, tell) as client:
            yield DaskExecutor(client, tell)


def one_of(*known: str) -> Callable[[str, str], str]:
    """Return what reads an option with these values."""

    def read(text: str, name: str) -> str:
        if text not in known:
            raise UsageError(f"{name} {text}: expected one of {', '.join(known)}")
        return text

    return read


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
            raise UsageError(f"--set {text}: expected PARAMETER=VALUE, such as k=5")
        parameters[name] = value_of(value)
    return parameters
