"""The next step after each command, ready to copy."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from vislam2tag.cli.terminal import say
from vislam2tag.common.files.store import shown

STEPS: Mapping[str, str] = {
    "site init": "vislam2tag plan {site} --out plan --write\n"
    "or, without landmarks: add the walks, then: vislam2tag process {site} --out labels",
    "site init, odd": "compare the picture with the plan, and follow the warnings: vislam2tag site set {site} --floor "
    "{floor} with the right options",
    "site init, measure": "open {page}, click two points, enter their distance, then run the command that it shows",
    "site set": "vislam2tag site show {site}",
    "site set, planned": "vislam2tag plan {site} --restart --out plan --write",
    "site renumber": "vislam2tag site show {site}",
    "site remove": "vislam2tag site show {site}",
    "site align": "vislam2tag site show {site}",
    "site align, page": "open {page}, click two places on both floors, then run the command that it shows",
    "site show": "vislam2tag plan {site} --out plan --write",
    "site show, no plan": "add the plan of each floor as floor_K/floorplan.jpg, then: vislam2tag site show {site}",
    "site write": "vislam2tag site show {out}",
    "site rebase, labels": "vislam2tag dataset {out} --out fingerprints",
    "site rebase, data set": "vislam2tag split {out}",
    "site rebase, site": "vislam2tag site show {out}",
    "site rebase, landmarks": "vislam2tag process survey --out labels --landmarks {out}",
    "site walkable": "vislam2tag plan {site} --out plan --write",
    "plan": "vislam2tag sheets {landmarks} --out sheets",
    "plan, none new": "vislam2tag sheets {site} --out sheets",
    "plan, unmet": "open {page}, add what is missing to the site, then run plan again",
    "sheets": "print {pdf} at 100 %, hang the sheets, then: vislam2tag register {site} --click clicks.html",
    "register": "vislam2tag receive {site}",
    "register, click": "open {page}, click the landmarks, save, then: vislam2tag register {site} --floor {floor} "
    "--clicks clicks_floor_{floor}.csv --write",
    "register, other names": "name the points like ids of the table (--landmark-names 'PREFIX*', or in the file "
    "of the station), then run the same command again",
    "register, not written": "run the same command with --write to save the positions in the site",
    "register, nothing": "correct the problems above, then run the same command again",
    "receive": "vislam2tag inspect {survey}",
    "inspect": "vislam2tag run {survey} --out out",
    "inspect, off plan": "vislam2tag diagnose {survey}",
    "inspect, excluded": "remove the exclusions from {corrections}, then: vislam2tag inspect {survey}",
    "inspect, unusable": "correct the problems above, then: vislam2tag inspect {survey}",
    "attach": "vislam2tag run {survey} --out out",
    "sightings": "vislam2tag run {survey} --out out",
    "sightings, failed": "correct the problems above, then: vislam2tag inspect {survey}",
    "simulate": "vislam2tag run {survey} --out out",
    "run": "vislam2tag train {dataset} --out building.v2t",
    "run, faults": "vislam2tag diagnose {survey} --apply",
    "run, by hand": "vislam2tag diagnose {survey}",
    "process": "vislam2tag check {survey}",
    "process, ask": "vislam2tag studio {survey} --labels {out}",
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
    "label, nothing": "pass the --labels of the walks of the table, or correct its clock with --offset-s",
    "survey-landmarks": "vislam2tag process {survey} --out labels --landmarks {landmarks}",
    "studio, export": "view it with: python -m http.server --directory {out}; then copy the folder to any web server",
    "studio": "vislam2tag dataset {labels} --out fingerprints",
    "diagnose": "vislam2tag run {survey} --out out",
    "diagnose, faults": "vislam2tag diagnose {survey} --apply",
    "diagnose, by hand": "correct the problems above, then: vislam2tag inspect {survey}",
    "diagnose, not judged": "vislam2tag inspect {survey}",
    "check": "vislam2tag dataset {survey} --out fingerprints",
    "check, failed": "vislam2tag inspect {survey}",
    "evaluate": "vislam2tag dataset {survey} --out fingerprints",
    "evaluate, failed": "vislam2tag inspect {survey}",
    "dataset": "vislam2tag train {dataset} --out building.v2t",
    "split": "vislam2tag train {dataset} --split {split} --out building.v2t",
    "split, none": "vislam2tag split {dataset} --by random",
    "no position": "open {page} to see why no fingerprint has a position",
    "import": "vislam2tag split {dataset}",
    "export": "open {out} with its program; {out}/export.json lists the files",
    "join": "vislam2tag split {dataset}",
    "verify": "none, the folders are equal",
    "verify, different": "vislam2tag verify {a} {b} --json > differences.json",
    "figures": "vislam2tag radio-maps {dataset} --out maps",
    "radio-maps": "vislam2tag train {dataset} --out building.v2t",
    "train": "vislam2tag locate {model} scans.csv --out positions.csv",
    "locate": "draw x and y with a circle of radius_68_m, which contains two thirds of the true positions",
    "benchmark": "vislam2tag train {dataset} --model {model} --out building.v2t",
    "benchmark, public": "compare the errors with the published ones in {page}",
    "benchmark, failed": "correct the problems above, then run the same command again for the missing runs",
    "paper": "open {page}, which compares each value with the paper's",
    "demo": "vislam2tag run {survey} --out out",
}
"""By command and, if it matters, by result."""


def next_step(after: str, *, err: bool = False, **places: str | Path | int) -> None:
    """Print the next step after a command; ``places`` are quoted for the shell."""
    quoted = {
        name: shlex.quote(shown(place) if isinstance(place, Path) else str(place)) for name, place in places.items()
    }
    say(f"next: {STEPS[after].format(**quoted)}", err=err)
