"""Damage that keeps a file's form, so that it gets past the first check: fields, values, columns, arrays, members."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from safetensors import safe_open
from safetensors.numpy import save_file
from tests.mutations import EXTREME, NASTY, mutate

from vislam2tag.positioning import model_files

Rng = np.random.Generator
ODD_VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, -1e308, 1e-320, 10**30, 2**63, -(2**63), 7, "", "x", "1e400", "../../x", "\x1b[31m"),
    *([], {}, [[]], [None], {"": None}, "é" * 300, "\x00", "nan", "[1]*?", ["a", 1], {"x": {"x": {"x": []}}}),
)
_BYTES_SHARE = 0.25
"""Of all mutations, which damage bytes whatever they mean."""
_PLACE_SHARE = 0.03
"""Which put something else in the file's place."""


def damage(path: Path, rng: Rng) -> str:
    """Damage a file in place; returns in which way."""
    draw = rng.random()
    if draw < _PLACE_SHARE:
        return _replace(path, rng)
    way = _WAYS.get(path.suffix.lower())
    if way is None or draw < _BYTES_SHARE:
        path.write_bytes(mutate(path.read_bytes(), rng))
        return "bytes"
    try:
        return way(path, rng)
    except (ValueError, OSError, KeyError, TypeError, IndexError, OverflowError, pl.exceptions.PolarsError):
        path.write_bytes(mutate(path.read_bytes(), rng))  # not of the format of its name
        return "bytes"


def _replace(path: Path, rng: Rng) -> str:
    """Put a folder, a pipe, a link in a circle, nothing at all or an empty file in a file's place."""
    kinds: dict[str, Callable[[], object]] = {
        "folder": path.mkdir,
        "pipe": lambda: os.mkfifo(path),
        "link in a circle": lambda: path.symlink_to(path.name),
        "device": lambda: path.symlink_to("/dev/zero"),
        "nothing": lambda: None,
        "empty": lambda: path.write_bytes(b""),
    }
    kind = str(rng.choice(list(kinds)))
    path.unlink()
    kinds[kind]()
    return kind


def _text(path: Path, rng: Rng) -> str:
    """Change fields, columns or lines of a table of text."""
    data = path.read_bytes()
    separator = max((b",", b";", b"\t", b" "), key=data.count)
    lines = [line.split(separator) for line in data.split(b"\n")]
    row = int(rng.integers(len(lines)))
    column = int(rng.integers(max(map(len, lines))))
    value = (EXTREME, NASTY)[rng.integers(2)]
    picked = value[rng.integers(len(value))]
    way = str(rng.choice(["field", "column", "no column", "columns exchanged", "header only", "line twice", "header"]))
    if way == "field":
        lines[row][min(column, len(lines[row]) - 1)] = picked
    elif way == "column":
        for line in lines[int(rng.integers(2)) :]:
            if column < len(line):
                line[column] = picked
    elif way == "no column":
        lines = [line[:column] + line[column + 1 :] for line in lines]
    elif way == "columns exchanged":
        lines = [line[::-1] for line in lines]
    elif way == "header only":
        lines = [lines[0], [b""]][: int(rng.integers(1, 3))]
    elif way == "line twice":
        lines.insert(row, lines[row])
    else:
        lines[0][min(column, len(lines[0]) - 1)] = picked
    path.write_bytes(b"\n".join(separator.join(line) for line in lines))
    return way


def _json(path: Path, rng: Rng) -> str:
    """Change one value anywhere in a JSON file, or in one line of many."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines() if path.suffix == ".jsonl" else [text]
    row = int(rng.integers(len(lines)))
    whole = json.loads(lines[row])
    lines[row] = json.dumps(changed(whole, rng))
    path.write_text("\n".join(lines), encoding="utf-8")
    return "value"


def changed(value: Any, rng: Rng) -> Any:
    """Return a value of JSON in which one part is replaced, missing or duplicated."""
    if isinstance(value, dict | list) and value and rng.random() < 0.9:
        keys: list[Any] = list(value) if isinstance(value, dict) else list(range(len(value)))
        key = keys[rng.integers(len(keys))]
        if rng.random() < 0.1:
            del value[key]
        elif isinstance(value, list) and rng.random() < 0.1:
            value.append(value[key])
        else:
            value[key] = changed(value[key], rng)
        return value
    return ODD_VALUES[rng.integers(len(ODD_VALUES))]


def _toml(path: Path, rng: Rng) -> str:
    """Change what stands behind one equals sign."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [row for row, line in enumerate(lines) if "=" in line]
    row = rows[rng.integers(len(rows))]
    odd = json.dumps(ODD_VALUES[rng.integers(len(ODD_VALUES))])
    lines[row] = f"{lines[row].split('=', 1)[0]}= {odd}"
    path.write_text("\n".join(lines), encoding="utf-8")
    return "value"


def _parquet(path: Path, rng: Rng) -> str:
    """Change values, types, rows or columns of a table."""
    table = pl.read_parquet(path.read_bytes())
    name = table.columns[rng.integers(table.width)]
    ways: dict[str, Callable[[], pl.DataFrame]] = {
        "no rows": lambda: table[:0],
        "no column": lambda: table.drop(name),
        "renamed": lambda: table.rename({name: "other"}),
        "rows twice": lambda: pl.concat([table, table]),
        "shuffled": lambda: table.sample(fraction=1.0, shuffle=True, seed=1),
        "null": lambda: table.with_columns(pl.when(pl.int_range(pl.len()) % 7 != 0).then(name)),
        "all null": lambda: table.with_columns(pl.lit(None, table.schema[name]).alias(name)),
        "text": lambda: table.with_columns(pl.lit("x").alias(name)),
        "zero": lambda: table.with_columns(pl.lit(0).cast(table.schema[name]).alias(name)),
        "least": lambda: table.with_columns(pl.lit(-(2**31)).cast(table.schema[name]).alias(name)),
        "greatest": lambda: table.with_columns(pl.lit(2**62).cast(table.schema[name]).alias(name)),
        "NaN": lambda: table.with_columns(pl.lit(float("nan")).cast(table.schema[name]).alias(name)),
        "huge": lambda: table.with_columns(pl.lit(1e300).cast(table.schema[name]).alias(name)),
    }
    way = str(rng.choice(list(ways)))
    ways[way]().write_parquet(path)
    _say_right_checksum(path)
    return f"{name}: {way}"


def _say_right_checksum(path: Path) -> None:
    """Let the data set's manifest say what its table is now, as an attacker would."""
    for folder in path.parents[:2]:
        manifest = folder / "dataset.json"
        if manifest.is_file():
            whole = json.loads(manifest.read_text(encoding="utf-8"))
            key = "splits" if path.parent.name == "splits" else "tables"
            account = whole[key][path.stem]
            account["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
            account["size_bytes"] = path.stat().st_size
            account["rows"] = pl.read_parquet(path).height
            manifest.write_text(json.dumps(whole), encoding="utf-8")


def _model(path: Path, rng: Rng) -> str:
    """Change the header or one array of a model, and make its checksum right."""
    with safe_open(path, framework="numpy") as file:
        header = json.loads(file.metadata()[model_files._KEY])
        arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - it is no dictionary
    what = "header"
    if rng.random() < 0.4:
        header = changed(header, rng)
    else:
        what = str(rng.choice(list(arrays)))
        arrays[what] = _odd_array(arrays[what], rng)
    if isinstance(header, dict):
        header["checksum"] = model_files._checksum(json.loads(json.dumps(header)), arrays)
    save_file(arrays, path, {model_files._KEY: json.dumps(header)})
    return what


def _odd_array(array: Any, rng: Rng) -> Any:
    values = array.copy()
    ways: tuple[Callable[[], Any], ...] = (
        lambda: values[:0] if values.ndim else values[None],
        lambda: values.reshape(-1)[: int(rng.integers(values.size + 1))],
        lambda: values[None],
        lambda: values.astype([np.int32, np.float32, np.uint8, np.float16][rng.integers(4)]),
        lambda: np.full_like(values, [-1, 0, 1, 7, 100][rng.integers(5)]),
        lambda: rng.permutation(values.reshape(-1)).reshape(values.shape),
        lambda: np.where(rng.random(values.shape) < 0.1, -values, values),
        lambda: np.where(rng.random(values.shape) < 0.1, [np.nan, np.inf, 1e300, 1e99][rng.integers(4)], values),
    )
    return np.ascontiguousarray(ways[rng.integers(len(ways))]())


def _zip(path: Path, rng: Rng) -> str:
    """Change one member of a ZIP, or its name."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = str(rng.choice(list(members)))
    inside = path.with_name(f".member{Path(name).suffix}")
    inside.write_bytes(members.pop(name))
    way = damage(inside, rng)
    data = inside.read_bytes() if inside.is_file() and not inside.is_symlink() else b""
    remove(inside)
    if rng.random() < 0.1:
        name = ("../x", "/x", name.upper(), "a\x00b", "x" * 300)[rng.integers(5)]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, content in {**members, name: data}.items():
            archive.writestr(each, content)
    return f"{name}: {way}"


def _tar(path: Path, rng: Rng) -> str:
    """Change one member of a TAR, or make it something else."""
    folder = path.with_name(".unpacked")
    with tarfile.open(path) as archive:
        archive.extractall(folder, filter="data")
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    way = damage(files[rng.integers(len(files))], rng)
    with tarfile.open(path, "w") as archive:
        archive.add(folder, ".")
    shutil.rmtree(folder)
    return way


def remove(path: Path) -> None:
    """Remove a file, a folder or a link."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


_WAYS: dict[str, Callable[[Path, Rng], str]] = {
    **dict.fromkeys((".csv", ".txt", ".tum", ".euroc", ".kitti", ".times", ".dxf", ".svg"), _text),
    **dict.fromkeys((".json", ".jsonl", ".geojson"), _json),
    ".toml": _toml,
    ".parquet": _parquet,
    ".v2t": _model,
    **dict.fromkeys((".zip", ".imdf"), _zip),
    ".tar": _tar,
}
