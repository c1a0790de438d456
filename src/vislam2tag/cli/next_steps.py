"""The step to take after each command, ready to copy: all of them stand here."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from vislam2tag.cli.terminal import say
from vislam2tag.common.files.store import shown

STEPS: Mapping[str, str] = {
    "site init": "vislam2tag plan {site} --out plan --write",
    "site init, measure": "open {page}, click two points, type their distance, run what it then shows",
    "site show": "vislam2tag plan {site} --out plan --write",
    "site show, no plan": "add the plan of each floor as floor_K/floorplan.jpg, then: vislam2tag site show {site}",
    "site write": "vislam2tag site show {out}",
    "site rebase, labels": "vislam2tag dataset {out} --out fingerprints",
    "site rebase, data set": "vislam2tag split {out}",
    "site rebase, site": "vislam2tag site show {out}",
    "site rebase, landmarks": "vislam2tag process survey --out labels --landmarks {out}",
    "site walkable": "vislam2tag plan {site} --out plan --write",
    "plan": "vislam2tag sheets {landmarks} --out sheets",
    "plan, unmet": "look at {page}, give the site what is missing, and plan again",
    "sheets": "print {pdf} at 100 %, hang the sheets, then: vislam2tag register SITE --click clicks.html",
    "register": "vislam2tag receive {site}",
    "register, click": "open {page}, click the landmarks, save, then: vislam2tag register {site} --floor {floor} "
    "--clicks clicks_floor_{floor}.csv --write",
    "register, other names": "give the points the ids of the table (--landmark-names 'PREFIX*', or in the file "
    "of the station), then give the same command again",
    "register, not written": "give the same command with --write: it puts the positions into the site",
    "receive": "vislam2tag inspect {survey}",
    "inspect": "vislam2tag run {survey} --out out",
    "inspect, excluded": "take out what excludes the sessions from {corrections}, then: vislam2tag inspect {survey}",
    "inspect, unusable": "correct what is named above, then: vislam2tag inspect {survey}",
    "attach": "vislam2tag run {survey} --out out",
    "sightings": "vislam2tag run {survey} --out out",
    "sightings, failed": "correct what is named above, then: vislam2tag inspect {survey}",
    "simulate": "vislam2tag run {survey} --out out",
    "run": "vislam2tag train {dataset} --out building.v2t",
    "run, faults": "vislam2tag diagnose {survey} --apply",
    "run, by hand": "vislam2tag diagnose {survey}",
    "process": "vislam2tag check {survey}",
    "process, unsure": "vislam2tag process {survey} --out {out} --together",
    "process, dry run": "vislam2tag process {survey} --out {out}",
    "process, faults": "vislam2tag diagnose {survey}",
    "process, failed": "vislam2tag inspect {survey}",
    "fleet add": "vislam2tag fleet process {fleet}",
    "fleet list": "vislam2tag fleet process {fleet} --dry-run",
    "fleet process": "open {page}",
    "fleet process, dry run": "vislam2tag fleet process {fleet}",
    "fleet process, failed": "vislam2tag fleet list {fleet}",
    "fleet report": "open {page}",
    "fleet status": "vislam2tag fleet list {fleet}",
    "label": "vislam2tag dataset {labels} --out fingerprints",
    "label, nothing": "give --labels of the walks that the table was logged on, or set its clock right by --offset-s",
    "survey-landmarks": "vislam2tag process {survey} --out labels --landmarks {landmarks}",
    "studio, export": "look at it: python -m http.server --directory {out}; then copy the folder to any web server",
    "studio": "vislam2tag dataset {labels} --out fingerprints",
    "diagnose": "vislam2tag run {survey} --out out",
    "diagnose, faults": "vislam2tag diagnose {survey} --apply",
    "diagnose, by hand": "correct what is named above, then: vislam2tag inspect {survey}",
    "diagnose, not judged": "vislam2tag inspect {survey}",
    "check": "vislam2tag dataset {survey} --out fingerprints",
    "check, failed": "vislam2tag inspect {survey}",
    "evaluate": "vislam2tag dataset {survey} --out fingerprints",
    "evaluate, failed": "vislam2tag inspect {survey}",
    "dataset": "vislam2tag train {dataset} --out building.v2t",
    "split": "vislam2tag train {dataset} --split {split} --out building.v2t",
    "split, none": "vislam2tag split {dataset} --by random",
    "no position": "read in {page} why no fingerprint has a position; nothing can be learned from the set",
    "import": "vislam2tag split {dataset}",
    "export": "read {out} with the program that it was written for; {out}/export.json lists its files",
    "join": "vislam2tag split {dataset}",
    "verify": "either folder can stand for the other; nothing is left to do",
    "verify, different": "vislam2tag verify {a} {b} --json > differences.json",
    "figures": "vislam2tag radio-maps {dataset} --out maps",
    "radio-maps": "vislam2tag train {dataset} --out building.v2t",
    "train": "vislam2tag locate {model} scans.csv --out positions.csv",
    "locate": "draw x and y with the circle radius_68_m: two thirds of scans were taken within theirs",
    "locate, nothing usable": "correct the lines that are named above: scan_id, bssid, rssi_dbm (negative dBm)",
    "locate, other access points": "take a model of the building where the scans were taken; {model} knows others",
    "benchmark": "vislam2tag train {dataset} --model {model} --out building.v2t",
    "benchmark, public": "compare the figures with the published ones in {page}",
    "benchmark, failed": "correct what is named above; the same command goes on with the runs that are missing",
    "paper": "open {page}: each figure stands beside the paper's",
    "demo": "vislam2tag run {survey} --out out",
}
"""By command, and what it found where that matters."""


def next_step(after: str, *, err: bool = False, **places: str | Path | int) -> None:
    """End a command with the step to take after it; ``places`` are quoted as a shell wants them."""
    quoted = {
        name: shlex.quote(shown(place) if isinstance(place, Path) else str(place)) for name, place in places.items()
    }
    say(f"next: {STEPS[after].format(**quoted)}", err=err)
