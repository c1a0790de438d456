"""Model files with every kind of damage, made by somebody who knows how to make the checksum right."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

from tests.positioning.radio_world import radio_world
from tests.positioning.test_model_files import KEY, SMALL, fitted
from vislam2tag.common.errors import ModelError
from vislam2tag.core.arrays import AnyArray
from vislam2tag.positioning import model_files
from vislam2tag.positioning.model_files import load_model, save_model
from vislam2tag.positioning.radio_scans import RadioScans

Header: TypeAlias = dict[str, Any]
Arrays: TypeAlias = dict[str, AnyArray]
NESTED = json.loads("[" * 150 + "]" * 150)
ARRAY_DAMAGE: dict[str, Callable[[AnyArray], AnyArray | None]] = {
    "missing": lambda array: None,
    "flat": lambda array: array.reshape(-1) if array.ndim > 1 else array[..., None],
    "another axis": lambda array: array[None],
    "no rows": lambda array: array.reshape(-1)[:0],
    "a row less": lambda array: array[:-1] if array.ndim else None,
    "a row more": lambda array: np.concatenate([array, array[:1]]) if array.ndim else array[None],
    "transposed": lambda array: array.T.copy() if array.ndim > 1 else np.zeros((2, 2)),
    "scalar": lambda array: np.zeros((), array.dtype),
    "bytes": lambda array: np.zeros(array.shape, np.uint8),
    "truth values": lambda array: np.ones(array.shape, np.bool_),
    "half precision": lambda array: np.zeros(array.shape, np.float16),
    "whole numbers": lambda array: np.full(array.shape, 7, np.int64),
    "floats": lambda array: np.full(array.shape, 0.5),
    "NaN": lambda array: np.full(array.shape, np.nan),
    "infinite": lambda array: np.full(array.shape, np.inf),
    "minus infinity": lambda array: np.full(array.shape, -np.inf),
    "negative": lambda array: (-np.abs(array.astype(np.float64)) - 2).astype(array.dtype),
    "huge": lambda array: np.full(array.shape, np.iinfo(array.dtype).max if array.dtype.kind == "i" else 1e308),
    "zero": lambda array: np.zeros(array.shape, array.dtype),
}
HEADER_DAMAGE: dict[str, Callable[[Header], object]] = {
    "no model": lambda header: header.pop("model"),
    "no parameters at all": lambda header: header.pop("parameters"),
    "no origin": lambda header: header.pop("origin"),
    "model a number": lambda header: header.update(model=5),
    "origin a number": lambda header: header.update(origin=5),
    "no access points": lambda header: header.update(access_points=[]),
    "an access point less": lambda header: header["access_points"].pop(),
    "an access point twice": lambda header: header["access_points"].append(header["access_points"][0]),
    "access points nested": lambda header: header.update(access_points=NESTED),
    "access points a number": lambda header: header.update(access_points=3),
    "no storeys": lambda header: header.update(storeys=[]),
    "a storey less": lambda header: header["storeys"].pop(),
    "a storey more": lambda header: header["storeys"].append(header["storeys"][0]),
    "storeys are text": lambda header: header.update(storeys="12"),
    "version infinite": lambda header: header.update(format_version=float("inf")),
    "version not a number": lambda header: header.update(format_version=float("nan")),
    "version text": lambda header: header.update(format_version="one"),
    "version huge": lambda header: header.update(format_version=10**400),
    "version nested": lambda header: header.update(format_version=NESTED),
    "parameters nested": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], NESTED)),
    "parameters are text": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], "x")),
    "parameters are lists": lambda header: header.update(parameters={key: [] for key in header["parameters"]}),
    "parameters infinite": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], float("inf"))),
    "parameters huge": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], 10**30)),
    "parameters negative": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], -1)),
    "parameters zero": lambda header: header.update(parameters=dict.fromkeys(header["parameters"], 0)),
    "no parameters": lambda header: header.update(parameters={}),
    "scans infinite": lambda header: header["origin"].update(scans=float("inf")),
    "another model": lambda header: header.update(
        model="weighted-knn" if header["model"] != "weighted-knn" else "cell-density"
    ),
    "a removed model": lambda header: header.update(model="knn"),
    "an unknown model": lambda header: header.update(model="../../x"),
}


def content_of(path: Path) -> tuple[Header, Arrays]:
    with safe_open(path, framework="numpy") as file:
        return json.loads(file.metadata()[KEY]), {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118


def damaged(header: Header, arrays: Arrays) -> Iterator[tuple[str, Header, Arrays]]:
    """Each damage with the header and the arrays that have it."""
    for what, change in HEADER_DAMAGE.items():
        other = json.loads(json.dumps(header))
        change(other)
        yield what, other, arrays
    for what, spoil in ARRAY_DAMAGE.items():
        for name, array in arrays.items():
            spoilt = spoil(array)
            rest = {each: kept for each, kept in arrays.items() if each != name}
            yield f"{name}: {what}", header, rest if spoilt is None else rest | {name: np.ascontiguousarray(spoilt)}


def answered(path: Path, scans: RadioScans, what: str) -> str | None:
    """Let a model answer; what is said where its file cannot be used."""
    try:
        found = load_model(path).model.predict(scans)
    except ModelError as error:
        return str(error)
    except Exception as error:
        raise AssertionError(f"{what}: {type(error).__name__}: {error}") from error
    assert len(found) == len(scans), what
    return None


@pytest.mark.parametrize("name", [*SMALL, "local-kriging"])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # numbers that overflow are no crash
def test_a_damaged_model_is_one_message_or_answers(name: str, tmp_path: Path) -> None:
    path = tmp_path / "model.v2t"
    save_model(fitted(name), path)
    scans, _ = radio_world(seed=5, walks=1)
    refused = 0
    for what, header, arrays in damaged(*content_of(path)):
        fields = {**header, "checksum": model_files._checksum(json.loads(json.dumps(header)), arrays)}
        save_file(arrays, path, {KEY: json.dumps(fields)})
        message = answered(path, scans, what)
        assert message is None or re.fullmatch(re.escape(f"{path}: ") + ".*", message), what
        refused += message is not None
    assert refused > 60


@pytest.mark.parametrize("metadata", ["[" * 100_000, '{"format_version": 1e999}', "\x00", "{}", "5", '"x"', "null"])
def test_metadata_of_any_form_is_one_message(metadata: str, tmp_path: Path) -> None:
    path = tmp_path / "model.v2t"
    save_file({"xy": np.zeros((3, 2))}, path, {KEY: metadata})
    with pytest.raises(ModelError, match=r"model\.v2t: the file is damaged \("):
        load_model(path)


@pytest.mark.parametrize("kind", ["F8_E4M3", "F8_E5M2", "BF16", "F4", "X", 7])
def test_numbers_that_numpy_has_not_are_one_message(kind: object, tmp_path: Path) -> None:
    path = tmp_path / "model.v2t"
    head = json.dumps({"xy": {"dtype": kind, "shape": [2, 2], "data_offsets": [0, 4]}, "__metadata__": {KEY: "{}"}})
    path.write_bytes(len(head).to_bytes(8, "little") + head.encode() + bytes(4))
    with pytest.raises(ModelError, match=r"model\.v2t: (not a model file|the file is damaged)"):
        load_model(path)
