"""Attacks on commands: which input is damaged, how a command is run, and requests to ``receive`` over HTTP."""

from __future__ import annotations

import contextlib
import hashlib
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import typer
from fuzz_bases import CSV_WALK_FILES, HANG_S, LABEL_FILES, SET_FILES, SITE_FILES, Run, Target, cli, first_walk
from fuzz_mutations import ODD_VALUES, Rng
from tests.mutations import mutate
from tests.studio.receiving.zips import session_files, session_zip, signed

from vislam2tag.cli.app import app
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.settings import part_of, setting_fields
from vislam2tag.studio.receiving import token as tokens
from vislam2tag.studio.receiving.server import UPLOADS

_SURVEY_FILES = (*SITE_FILES, "floor_0/*/*/*", "vislam2tag.toml")
_ILC20_FILES = ("F1/*", "F1/*/*")
_TRUTH_FILES = (
    "floor_0/*.csv",
    "floor_0/tachymeter/*",
    "floor_0/*/*/tr*",
    "floor_0/*/*/re*",
    "floor_0/*/*/[Rt]a*",
    "floor_0/*/*/Con*",
)
_MODEL = ("model.v2t",)
_RECEIVED_FILES = ("*", "*/*", "*/*/*", "*/*/*/*", ".receiving/*")
_SLOW = {"figures", "radio-maps", "benchmark", "benchmark again", "paper", "plan", "plan without", "plan --write"}
"""They take seconds where others take tenths; they run every 20th round."""
_SLOWER = {"run survey", "run phone", "run ilc20", "run again", "dataset of a survey", "fleet process"}
"""They take a second or what other targets attack, too; they run every fourth round, as imports do."""

_OF_A_SURVEY = {
    "inspect": "inspect {base}",
    "process": "process {base} --out {out}/o --jobs 1",
    "check": "check {base} --out {out}/c --jobs 1",
    "process together": "process {base} --together --out {out}/o --jobs 1",
    "survey-landmarks": "survey-landmarks {base} --out {out}/lm.csv --jobs 1",
    "run": "run {base} --out {out}/r --jobs 1",
    "diagnose": "diagnose {base} --jobs 1",
    "evaluate": "evaluate {base} --out {out}/e --jobs 1 --strategy smoother",
}
_OF_A_SET = {
    **{
        f"train {model}": f"train {{base}} --model {model} --out {{out}}/m.v2t"
        for model in ("weighted-knn", "local-kriging", "cell-density")
    },
    "benchmark": "benchmark {base} --model weighted-knn --split random --seeds 1 --out {out}/b",
    "figures": "figures {base} --out {out}/f",
    "radio-maps": "radio-maps {base} --config {all}/small/texts/radio.toml --out {out}/r --cell 5m --most 1",
    **{
        f"export {kind}": f"export {{base}} --format {kind} --out {{out}}/e"
        for kind in ("uji", "hdf5", "comford", "geojson", "parquet")
    },
    "join": "join {all}/set {base} --out {out}/j",
    "join before": "join {base} {all}/set --out {out}/j",
    "verify": "verify {all}/set {base}",
    "locate a set": "locate {all}/neighbours/model.v2t {base} --out {out}/p.csv",
    "rebase a set": "site rebase {base} --by {all}/small/texts/rebase.toml --to {all}/survey --out {out}/b",
}
_OF_LABELS = {
    "dataset": "dataset {base} --survey {all}/survey --out {out}/d --jobs 1",
    "export gia": "export {base} --format gia --survey {all}/survey --out {out}/g --jobs 1",
    "export tum": "export {base} --format tum --out {out}/t",
    "rebase labels": "site rebase {base} --by {all}/small/texts/rebase.toml --to {all}/survey --out {out}/b",
    "verify labels": "verify {base} {all}/labels",
    "label": "label {all}/tables/boot.csv --labels {base} --clock boot --out {out}/l.csv",
    "locate by labels": "locate {all}/neighbours/model.v2t {all}/set --track {base} --out {out}/p.csv",
}
_OF_A_SITE = {
    "site show": "site show {base}",
    "site draw": "site show {base} --out {out}/s.svg",
    "site write": "site write {base} --out {out}/w",
    "site walkable": "site walkable {base} --floor 1 --out {out}/w",
    "simulate on": "simulate {out}/s --site {base} --floor 1 --minutes 0.25 --devices 1 --sessions 1",
}
_PLAN = "plan {base} --out {out}/p --time-limit-s 1 --further 0 --spacing-m 30"
_REGISTER = "register {base}/register/site --floor 1 --out {out}/r"

_OTHERS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "process ilc20": ("ilc20", _ILC20_FILES, "process {base} --out {out}/o --jobs 1"),
    "inspect ilc20": ("ilc20", _ILC20_FILES, "inspect {base}"),
    "run ilc20": ("ilc20", _ILC20_FILES, "run {base} --out {out}/r --jobs 1"),
    "inspect walk as CSV": ("csvwalk", CSV_WALK_FILES, "inspect {base}"),
    "process walk as CSV": ("csvwalk", CSV_WALK_FILES, "process {base} --out {out}/o --jobs 1"),
    "locate walk as CSV": ("csvwalk", CSV_WALK_FILES, "locate {all}/cells/model.v2t {walk} --out {out}/p.csv"),
    "process attached": ("attached", ("other/*", "floor_0/*/*/c*/*"), "process {base} --out {out}/o --jobs 1"),
    **{f"fleet {verb}": ("fleet", ("*", "*/*"), f"fleet {verb} {{base}}") for verb in ("list", "status")},
    "process of the paper": ("older", _SURVEY_FILES, "process {base} --out {out}/o --jobs 1"),
    "evaluate": ("evaluated", _TRUTH_FILES, "evaluate {base} --out {out}/e --jobs 1 --strategy smoother"),
    "evaluate by others": ("evaluated", _TRUTH_FILES, "evaluate {base} --out {out}/e --jobs 1 --strategy local"),
    "paper": ("evaluated", _TRUTH_FILES, "paper {base} --out {out}/p"),
    "dataset of a survey": ("survey", _SURVEY_FILES, "dataset {base} --out {out}/d --jobs 1"),
    "plan": ("site", SITE_FILES, f"{_PLAN} --floor 1"),
    "plan without": (
        "small",
        ("texts/forbid.csv",),
        _PLAN.format(base="{all}/site", out="{out}") + " --floor 1 --forbid {base}/texts/forbid.csv",
    ),
    "sheets": ("survey", SITE_FILES, "sheets {base} --ids 1 --out {out}/s"),
    "sheets of images": ("small", ("images/1.png",), "sheets --ids 1 --images {base}/images --out {out}/s"),
    "mask": (
        "small",
        ("images/mask.png",),
        "site walkable {all}/survey --mask {base}/images/mask.png --out {out}/w",
    ),
    "dataset described": (
        "small",
        ("texts/dataset.toml",),
        "dataset {all}/labels --describe {base}/texts/dataset.toml --out {out}/d --jobs 1",
    ),
    "hashed": (
        "small",
        ("texts/key.txt",),
        "export {all}/set --format uji --hash-bssid {base}/texts/key.txt --out {out}/u",
    ),
    "rebase by": (
        "small",
        ("texts/rebase.toml",),
        "site rebase {all}/set --by {base}/texts/rebase.toml --to {all}/survey --out {out}/b",
    ),
    "rebase landmarks": (
        "survey",
        ("floor_0/marker_dict.csv",),
        "site rebase {base}/floor_0/marker_dict.csv --by {all}/small/texts/rebase.toml --to {all}/survey --out {out}/b",
    ),
    "rebase a site": ("site", SITE_FILES, "site rebase {all}/set --from {base} --to {all}/survey --out {out}/b"),
    "process with settings": (
        "small",
        ("texts/config.toml",),
        "process {all}/survey --config {base}/texts/config.toml --out {out}/o --jobs 1",
    ),
    "process with landmarks": (
        "small",
        ("texts/landmarks.csv",),
        "process {all}/survey --landmarks {base}/texts/landmarks.csv --out {out}/o --jobs 1",
    ),
    **{
        f"locate {name}": (name, _MODEL, "locate {base}/model.v2t {all}/set --out {out}/p.csv")
        for name in ("neighbours", "kriging", "cells")
    },
    "locate scans": (
        "small",
        ("scans/scans.csv", "scans/track.csv"),
        "locate {all}/neighbours/model.v2t {base}/scans/scans.csv --track {base}/scans/track.csv --out {out}/p.csv",
    ),
    "locate lines": ("small", ("scans/scans.jsonl",), "locate {all}/neighbours/model.v2t {base}/scans/scans.jsonl"),
    "label by Unix time": (
        "tables",
        ("*",),
        "label {base}/unix.csv --labels {all}/phonelabels --survey {all}/phone --out {out}/l.parquet",
    ),
    "label by heard": ("tables", ("*",), "label {base}/heard.parquet --labels {all}/labels --out {out}/l.csv"),
    "label dates": ("tables", ("*",), "label {base}/dates.csv --labels {all}/labels --offset-s 0 --out {out}/l.csv"),
    "register by station": (
        "small",
        ("register/S1.csv", "register/control.csv", "register/site/**/*.csv"),
        f"{_REGISTER} --station {{base}}/register/S1.csv --control {{base}}/register/control.csv --landmark-names LM*",
    ),
    "register by tape": (
        "small",
        ("register/t*.csv", "register/site/**/*.csv"),
        f"{_REGISTER} --tape {{base}}/register/tape.csv --targets {{base}}/register/targets.csv",
    ),
    "register by clicks": ("small", ("register/clicks.csv",), f"{_REGISTER} --clicks {{base}}/register/clicks.csv"),
    "receive a zip": ("small", ("zip/*",), "receive {out} {base}/zip/session.zip --max-size-mb 10"),
    **{
        f"import {name} by command": ("imports", (f"{name}/**/*",), f"import {{base}}/{name} --out {{out}}/i")
        for name in ("getsensordata", "ilc20", "tampere_zip", "uts_tar")
    },
    **{
        f"import {name} table by command": ("owntables", (f"{name}/*",), f"import {{base}}/{name} --out {{out}}/i")
        for name in ("long", "wide")
    },
    **{
        f"import {name} by command": (name, ("**/*",), "import {base} --out {out}/i")
        for name in ("uji", "gia", "comford", "parquet")
    },
}
"""By name: base, files damaged, and the command."""

_WRITE_THERE: dict[str, tuple[str, tuple[str, ...], str]] = {
    "process again": ("labels", LABEL_FILES, "process {all}/survey --out {base} --jobs 1"),
    "run again": (
        "ran",
        ("*.json", "*/*.json", "*/*/*.json", "*/*.parquet", "*/*/*.parquet"),
        "run {all}/survey --out {base} --jobs 1",
    ),
    "attach": (
        "attached",
        ("other/*", "floor_0/*/*/*"),
        "attach {walk} {base}/other/heard.csv --by levels --replace",
    ),
    **{
        f"fleet {verb}": ("fleet", ("*", "*/*", "surveys/**/*"), f"fleet {verb} {{base}}")
        for verb in ("add", "process", "report")
    },
    "benchmark again": (
        "benchmarked",
        ("*", "*/*"),
        "benchmark {all}/set --model weighted-knn --split random --seeds 1 --out {base}",
    ),
    "diagnose --apply": ("survey", _SURVEY_FILES, "diagnose {base} --apply --jobs 1"),
    "diagnose --revert": ("site", ("corrections.toml",), "diagnose {base} --revert"),
    "split": ("set", SET_FILES, "split {base} --by block --name new"),
    "split in place": ("set", SET_FILES, "split {base} --by random --name random"),
    "plan --write": ("site", SITE_FILES, f"{_PLAN} --floor 1 --write"),
    "register --write": (
        "small",
        ("register/t*.csv", "register/site/**/*.csv"),
        f"{_REGISTER} --tape {{base}}/register/tape.csv --targets {{base}}/register/targets.csv --write",
    ),
    "receive into": ("received", _RECEIVED_FILES, "receive {base} {all}/small/zip/session.zip"),
    **{
        f"site init {kind}": (
            "site",
            (f"plan.{kind}", "site.toml"),
            f"site init {{base}} --floor 9 --elevation-m 40 --plan {{base}}/plan.{kind} {scale}",
        )
        for kind, scale in {
            "png": "--width-m 20",
            "svg": "--unit-m 0.25",
            "pdf": "--width-m 20 --page 2",
            "dxf": "",
            "geojson": "",
            "zip": "--level 0",
        }.items()
    },
}
"""The same, of commands that are meant to write into what is damaged."""


def commands() -> Iterator[Target]:
    """All commands that are attacked."""
    for base in ("survey", "phone"):
        yield from (_command(f"{name} {base}", base, _SURVEY_FILES, line) for name, line in _OF_A_SURVEY.items())
    yield from (_command(name, "set", SET_FILES, line) for name, line in _OF_A_SET.items())
    yield from (_command(name, "labels", LABEL_FILES, line) for name, line in _OF_LABELS.items())
    yield from (_command(name, "site", SITE_FILES, line) for name, line in _OF_A_SITE.items())
    yield from (_command(name, *parts) for name, parts in _OTHERS.items())
    yield from (_command(name, *parts, writes=True) for name, parts in _WRITE_THERE.items())
    yield Target("receive over HTTP", "received", _RECEIVED_FILES, upload, writes_base=True)


def _command(name: str, base: str, files: tuple[str, ...], line: str, *, writes: bool = False) -> Target:
    """``{base}``, ``{all}`` and ``{out}`` in the line stand for folders."""

    def work(run: Run) -> None:
        invoke(line, run)

    # 1: whatever its help says of it, but never an exception
    every = 20 if name in _SLOW else 4 if name in _SLOWER or line.startswith("import ") else 1
    return Target(name, base, files, work, codes=(0, 1, 2, 3), writes_base=writes, every=every)


_ODD_SHARE = 0.15
"""Of all runs, which have one odd option more."""
_APART_SHARE = 0.01
"""Which are a process of their own from the start, not one forked from this that has everything imported."""
_KEPT = {"out", "jobs", "host", "port", "seeds", "measure", "click", "write", "help", "config", "replace"}
"""Options that are left as they are: they ask for much work, a server, a browser or another place."""
_NUMBERS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "-1", "0", "1", "2.5", "9" * 20, "x", "", "0x7f", "１")
_TEXTS = ("", "x", "-", "é" * 300, "[1]*?", "../x", "1e400", "nan", "a,b", "1,2", "1=2", "a\nb", "\x1b[31m", "\udcff")


def invoke(line: str, run: Run) -> None:
    """Run a command line, ``{base}``, ``{all}``, ``{out}`` and ``{walk}`` in it for folders; ends as :func:`cli`."""
    folders = {"base": run.base, "all": run.bases, "out": run.out, "walk": first_walk(run.base)}
    arguments = [part.format(**folders) for part in line.split()]
    if run.rng.random() < _ODD_SHARE:
        arguments += odd_option(arguments, run)
        print("with", *map(ascii, arguments[len(line.split()) :]), flush=True)
    if run.rng.random() < _APART_SHARE:
        _apart(arguments)
    cli(*arguments)


def _apart(arguments: list[str]) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "vislam2tag", *arguments],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (HANG_S, HANG_S)),
        check=False,
    )
    if ended.returncode < 0:
        os.kill(os.getpid(), signal.SIGKILL if ended.returncode == -signal.SIGXCPU else -ended.returncode)
    raise SystemExit(ended.returncode)


def odd_option(arguments: list[str], run: Run) -> list[str]:
    """An option of the command with a value that few would give; a file of settings most of the time."""
    command = _command_of(arguments)
    options = [each for each in command.params if each.param_type_name == "option"]
    if any(each.name == "config" for each in options) and run.rng.random() < 0.6:
        return ["--config", str(_odd_settings(run))]
    options = [each for each in options if each.name not in _KEPT and each.name.isidentifier()]
    option = options[run.rng.integers(len(options))]
    name = option.opts[-1]
    if option.is_flag:
        return [name]
    return [name, *(_odd_value(run) for _ in range(option.nargs))]


def _command_of(arguments: list[str]) -> Any:
    context: Any = None  # of Typer's own or Click's class, by version
    command: Any = typer.main.get_group(app)
    for name in arguments:
        if not hasattr(command, "get_command"):
            break
        command = command.get_command(context, name)
    return command


def _odd_value(run: Run) -> str:
    """Of any type: which one an option takes differs between the versions of Typer."""
    files = sorted(path for path in run.bases.glob("small/*/*") if path.is_file())
    places = ("/dev/null", "/dev/zero", "nowhere", str(run.base), str(run.out), *map(str, files))
    return _picked((_NUMBERS, _NUMBERS, _TEXTS, places)[run.rng.integers(4)], run.rng)


def _odd_settings(run: Run) -> Path:
    """A file with one to three settings of other values, types or sizes."""
    names = [name for name, field in setting_fields() if part_of(field) is None]
    file = run.out / "settings.toml"
    lines = []
    for name in run.rng.choice(names, size=int(run.rng.integers(1, 4)), replace=False):
        odd = ODD_VALUES[run.rng.integers(len(ODD_VALUES))]
        number = _picked(("nan", "inf", "-inf", "1e308", "1e-308", "-1.0", "0", "0.001", "3", "1000000"), run.rng)
        lines.append(f"{name} = {number if odd is None or run.rng.random() < 0.6 else toml_value(odd)}")
    file.write_text("\n".join(lines), encoding="utf-8")
    print(*map(ascii, lines), flush=True)
    return file


def _picked(values: tuple[str, ...], rng: np.random.Generator) -> str:
    return values[rng.integers(len(values))]


_TOKEN = "A" * tokens.LENGTH
_REQUESTS = 6
_ODD = (
    b"",
    b"-1",
    b"1e3",
    b"99999999999999999999",
    b"\xff",
    b"x" * 9000,
    b"0",
    b"chunked",
    b"1, 2",
    b"\x00",
    b"7\r\nA: b",
)


def upload(run: Run) -> None:
    """Serve, send a few requests, see that the server still answers, and end it as Ctrl-C does."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    files = session_files(floor=int(run.rng.integers(3)))
    content = session_zip(files)
    if run.rng.random() < 0.5:
        content = mutate(content, run.rng)
    requests = [_request(content, run.rng) for _ in range(_REQUESTS)]
    sender = threading.Thread(target=_send_all, args=(port, requests), daemon=True)
    sender.start()
    with mock.patch.object(tokens, "new_token", return_value=_TOKEN):
        cli("receive", run.base, "--host", "127.0.0.1", "--port", str(port))


def _send_all(port: int, requests: list[bytes]) -> None:
    while not _answer(port, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"):
        time.sleep(0.02)
    for request in requests:
        _answer(port, request)
    if b" 200 " not in _answer(port, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", patience_s=60):
        print("unexpected silence: the server does not answer any more", flush=True)
    os.kill(os.getpid(), signal.SIGINT)


def _answer(port: int, request: bytes, patience_s: float = 0.3) -> bytes:
    """What comes back so soon."""
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=patience_s) as connection:
        connection.sendall(request)
        return connection.recv(1 << 16)
    return b""


def _request(content: bytes, rng: Rng) -> bytes:
    """A request as an app sends it, often with one thing wrong, before or after it is signed."""
    name = hashlib.sha256(content).hexdigest()
    start = int(rng.choice([0, 0, 0, len(content) // 2]))
    body = content[start:]
    if rng.random() < 0.2:
        body = mutate(body, rng)
    method = str(rng.choice(["PATCH", "PATCH", "PATCH", "GET", "PUT"]))
    offset, length = (str(value) if rng.random() < 0.9 else _odd_text(rng) for value in (start, len(content)))
    headers = [*signed(_TOKEN, method, name, body, offset, length).items(), ("Content-Length", str(len(body)))]
    lines = [f"{method} {UPLOADS}/{name} HTTP/1.1".encode(), b"Host: x"]
    lines += [f"{key}: {value}".encode("latin-1") for key, value in headers]
    if rng.random() < 0.5:
        row = int(rng.integers(len(lines)))
        head, colon, _ = lines[row].partition(b": ")
        ways = (
            head + colon + _ODD[rng.integers(len(_ODD))],
            mutate(lines[row], rng),
            b"",
            lines[row] + b"\r\n" + lines[row],
        )
        lines[row] = ways[rng.integers(len(ways))]
    return b"\r\n".join([*lines, b"", body])


def _odd_text(rng: Rng) -> str:
    return _ODD[rng.integers(len(_ODD))].decode("latin-1").replace("\r\n", " ")
