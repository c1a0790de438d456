"""Which commands are attacked, with what of their input damaged: one line each."""

from __future__ import annotations

from collections.abc import Iterator

from fuzzing.invocation import invoke
from fuzzing.targets import LABEL_FILES, SET_FILES, SITE_FILES, Run, Target
from fuzzing.uploading import upload

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
        "attach {walk} {base}/other/heard.parquet --by levels --replace",
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
    return Target(name, base, files, work, codes=(0, 1, 2), writes_base=writes, every=every)
