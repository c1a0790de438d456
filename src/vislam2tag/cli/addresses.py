"""Which folders of each command may be addresses in object storage.

Most commands work on local copies, while their output names the addresses (:mod:`vislam2tag.cli.terminal`). Only a few
write to a store piece by piece.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import partial, wraps
from pathlib import Path
from typing import Any, TypeAlias

import typer

from vislam2tag.cli.exit_codes import OUTPUT_IS_WHOLE
from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.store import address_of, store_at
from vislam2tag.common.files.stored_folder import folder_at_hand, folder_to_add_to, folder_to_fill

_Opener: TypeAlias = Callable[[Path], AbstractContextManager[Path]]


def _survey(folder: Path) -> AbstractContextManager[Path]:
    from vislam2tag.site.stored_survey import survey_at_hand

    return survey_at_hand(folder)


def _survey_to_correct(folder: Path) -> AbstractContextManager[Path]:
    from vislam2tag.site.stored_survey import survey_to_correct

    return survey_to_correct(folder)


def _labels_or_survey(folder: Path) -> AbstractContextManager[Path]:
    from vislam2tag.datasets.labelled import labels_at_hand
    from vislam2tag.labeling.results import RUN_FILE

    store = store_at(folder)
    return _survey(folder) if store is None or store.version(RUN_FILE) is None else labels_at_hand(folder)


_as_it_is: _Opener = nullcontext
_whole, _filled = folder_at_hand, folder_to_fill

_FOLDERS: Mapping[str, Mapping[str, _Opener]] = {
    "inspect": {"survey": _survey},
    "process": {"survey": _survey, "out": _as_it_is},
    "diagnose": {"survey": _survey_to_correct},
    "check": {"survey": _survey, "out": partial(folder_to_add_to, at_hand=("check.json",))},
    "evaluate": {"survey": _whole, "truth": _whole, "out": _filled},
    "run": {"survey": _survey, "out": partial(folder_to_fill, unfinished=True)},
    "label": {"table": _whole, "labels": _whole, "survey": _whole},
    "dataset": {"sources": _labels_or_survey, "survey": _survey, "out": _filled},
    "split": {"dataset": _filled},
    "export": {"source": _whole, "out": _filled},
    "join": {"base": _whole, "later": _whole, "out": _filled},
    "verify": {"a": _whole, "b": _whole},
    "figures": {"dataset": _whole, "out": _filled},
    "radio-maps": {"dataset": _whole, "out": _filled},
    "train": {"dataset": _whole},
    "benchmark": {"folder": _whole},
    "locate": {"model": _whole, "scans": _whole, "track": _whole, "plans": _whole},
    "studio": {"survey": _as_it_is},
    **{
        f"fleet {name}": {"store": _as_it_is, "surveys": _as_it_is}
        for name in ("add", "list", "process", "status", "report")
    },
}
"""By command and parameter; every other path must be of this machine."""


def take_addresses(command: Any, name: str) -> Any:
    """Let a command take addresses where it may; raises UsageError, when it is called, where it may not."""
    for sub_name, each in getattr(command, "commands", {}).items():
        take_addresses(each, f"{name} {sub_name}")
    if command.callback is None:
        return command
    openers, work = _FOLDERS.get(name, {}), command.callback
    if openers:
        command.help = _with_names(command.help, [param for param in command.params if param.name in openers])

    @wraps(work)
    def with_folders(**values: Any) -> Any:
        ended: typer.Exit | None = None
        with ExitStack() as stack:
            here = {key: _opened(stack, openers.get(key), name, value) for key, value in values.items()}
            try:
                work(**here)
            except typer.Exit as end:
                if end.exit_code not in OUTPUT_IS_WHOLE:
                    raise
                ended = end  # what was made is whole, whatever was odd
        if ended is not None:
            raise ended

    command.callback = with_folders
    return command


def _with_names(text: str, parameters: Sequence[Any]) -> str:
    """A command's help with a sentence, before its exit codes, about which parameters may be addresses."""
    options = {each.opts[-1] for each in parameters if each.param_type_name == "option"}
    arguments = [
        (each.metavar or each.name).strip("[].").upper() for each in parameters if each.opts[-1] not in options
    ]
    names = [*arguments, *sorted(options)]
    said = f"{' and '.join(names)} may be an address in object storage, see {page_of('how-to/many-surveys')}."
    return text.replace("\nExit code:", f"\n{said}\n\nExit code:", 1)


def _opened(stack: ExitStack, opener: _Opener | None, command: str, value: Any) -> Any:
    """A parameter's value, with folders of this machine in the place of addresses."""
    if isinstance(value, (list, tuple)):
        return type(value)(_opened(stack, opener, command, each) for each in value)
    address = address_of(value) if isinstance(value, Path) else None
    if address is None:
        return value
    if opener is None:
        raise UsageError(
            f"{address}: `vislam2tag {command}` needs a local path; copy it to this machine, see "
            f"{page_of('how-to/many-surveys')}"
        )
    return stack.enter_context(opener(value))
