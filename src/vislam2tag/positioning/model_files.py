"""A learned model as a file: the program's own format of numbers and text, or a self-contained ONNX file.

Nothing in the program's own file is executed. It is a safetensors file (https://github.com/huggingface/safetensors)
with the model's arrays, and a :class:`ModelHeader` as JSON in its only metadata entry. The same model gives the same
bytes. docs/reference/model-files.md describes the arrays, and how to use them without this package.

The ONNX file can be used without this package. Its input ``level_dbm`` (n, a), double, is the level of each access
point, NaN if it was not heard, in the order of the entry ``access_points`` of the file's metadata. Outputs are fields
of :class:`~vislam2tag.positioning.places.Positions`: ``xy``, ``z``, ``storey`` (index into the entry ``storeys``; -1:
unknown), ``storey_probability``, ``radius_68_m``, ``radius_95_m``.

Scaling, decoding, radii and the answer "unknown" are part of the graph. The user must only sort readings into the
columns, average several readings of an access point in dBm, and drop unknown access points.
"""

from __future__ import annotations

import hashlib
import json
import logging
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field, JsonValue, ValidationError
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save as packed

from vislam2tag import __version__
from vislam2tag.common.errors import ModelError, UsageError, first_line, import_extra
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.common.folder_kinds import found_at
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import TabularResult
from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.datasets.model import Grouping, RoomInfo, Storey
from vislam2tag.intake.readings import normal_address
from vislam2tag.positioning.registry import (
    Positioner,
    model_named,
    model_names,
    removed_model,
    removed_parameter,
    without_idle,
)

FORMAT_VERSION = 1
_KEY = "vislam2tag_model"
_CHECKSUM = "checksum"


class FloorName(Record):
    """Name of a floor, such as "Ground floor", and its rooms with names."""

    building: str
    number: int
    name: str
    rooms: tuple[RoomInfo, ...] = ()


class ModelOrigin(Record):
    """Source of a model, and the reference of its answers."""

    dataset: str
    """Name of the data set."""
    part: str = "all"
    """Training set: all, or split and fold."""
    scans: int
    technology: str = "wifi"
    grouping: Grouping | None = None
    """How readings became fingerprints; None if unknown."""
    beacons: tuple[str, ...] = ()
    """The BLE beacons among the access points, if the fingerprints have both Wi-Fi and BLE."""
    floor_names: tuple[FloorName, ...] = ()
    """Names of floors that say more than the number, and of rooms."""
    frame: str = "BCS of each floor, metres"
    bssid_key: str | None = None
    """Name of the key that access points' identifiers were hashed with (datasets/privacy.py); None: not hashed."""

    def floor_name(self, storey: Storey) -> str:
        """Name of a floor, such as "Ground floor"; empty if it has only a number."""
        names = {Storey(floor.building, floor.number): floor.name for floor in self.floor_names}
        return names.get(storey, "")

    def rooms_at(self, storey: Storey, points_m: FloatArray) -> list[str]:
        """Name of the room at each point (n, 2) of a floor, BCS metres; empty if none with a name is there."""
        found = [""] * len(points_m)
        own = (floor.rooms for floor in self.floor_names if Storey(floor.building, floor.number) == storey)
        for room in next(own, ()):
            for row in np.flatnonzero(room.contains(points_m)).tolist():
                found[row] = room.name
        return found


class ModelHeader(Record):
    """Content of a model's file besides its arrays."""

    format_version: int = FORMAT_VERSION
    program_version: str = __version__
    model: str
    """Name of the model."""
    parameters: dict[str, JsonValue]
    access_points: Annotated[tuple[str, ...], Field(min_length=1)]
    storeys: Annotated[tuple[Storey, ...], Field(min_length=1)]
    origin: ModelOrigin
    checksum: str = ""
    """SHA-256 of the rest of the header and all arrays; empty while it is computed."""


class _Version(BaseModel):
    """The only field that headers of all versions have."""

    format_version: int


@dataclass(frozen=True, repr=False)
class SavedModel(TabularResult):
    """A model with its name and origin."""

    name: str
    model: Positioner
    origin: ModelOrigin

    def _facts(self) -> dict[str, object]:
        return {
            "model": self.name,
            "trained on": self.origin.dataset,
            "scans": self.origin.scans,
            "access points": len(self.model.access_points_),
        }


def save_model(saved: SavedModel, path: AnyPath) -> None:
    """Write the model's file, whole or not at all; raises OutputError if it cannot be written."""
    write_file(Path(path), model_bytes(saved))


def model_bytes(saved: SavedModel) -> bytes:
    """Return the content of a model's file."""
    arrays = {name: np.array(array, order="C") for name, array in saved.model.arrays().items()}
    header = ModelHeader(
        model=saved.name,
        parameters=json.loads(json.dumps(saved.model.get_params())),
        access_points=saved.model.access_points_,
        storeys=saved.model.storeys_,
        origin=saved.origin,
    )
    fields = header.model_dump(mode="json")
    text = json.dumps(fields | {_CHECKSUM: _checksum(fields, arrays)}, ensure_ascii=False)
    return bytes(packed(arrays, {_KEY: text}))  # one entry, because the order of several is undefined


def load_model(path: AnyPath) -> SavedModel:
    """Read a model's file; header and arrays are checked before they are used.

    Raises ModelError if the file is not a model file, is damaged, is of a later version, or contains a removed model.
    Raises UsageError if the model needs a package that is not installed.
    """
    path = Path(path)
    text, arrays = _opened(path)
    header = _header(path, text)
    if _checksum(json.loads(text), arrays) != header.checksum:
        raise ModelError(f"{path}: the file is damaged (its checksum does not match); copy it again, or train again")
    model = _made(path, header)
    model.access_points_, model.storeys_ = _normal_names(header.access_points), header.storeys
    try:
        model.restore(arrays)
    except Exception as error:  # the model may be from another package
        raise ModelError(
            f"{path}: version {__version__} cannot use this {header.model} model of version "
            f"{header.program_version} ({first_line(error)}); train again"
        ) from error
    return SavedModel(header.model, model, header.origin)


def _normal_names(access_points: tuple[str, ...]) -> tuple[str, ...]:
    """Normalise names; of several notations of one address only the first is changed."""
    taken = set(access_points)
    names = []
    for point in access_points:
        name = normal_address(point)
        names.append(point if name in taken else name)
        taken.add(names[-1])
    return tuple(names)


def _opened(path: Path) -> tuple[str, dict[str, AnyArray]]:
    if path.exists() and not path.is_file():
        raise ModelError(f"{path}: not a regular file{found_at(path)}; pass a model file that `vislam2tag train` wrote")
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - it is no dictionary
    except OSError as error:
        raise ModelError(
            f"{path}: cannot be read ({error.strerror or error}); pass a model file that `vislam2tag train` wrote"
        ) from error
    except (SafetensorError, KeyError, TypeError, ValueError, AttributeError) as error:  # types unknown to NumPy
        raise ModelError(
            f"{path}: not a model file, or damaged ({first_line(error)}); pass a file that `vislam2tag train` wrote"
        ) from error
    if _KEY not in metadata:
        raise ModelError(f"{path}: a model file of another program; pass a file that `vislam2tag train` wrote")
    return metadata[_KEY], arrays


def _header(path: Path, text: str) -> ModelHeader:
    try:
        version = _Version.model_validate_json(text).format_version
        if version > FORMAT_VERSION:
            raise ModelError(
                f"{path}: the file has format version {version}, but this program reads up to {FORMAT_VERSION}; "
                "update vislam2tag"
            )
        header = ModelHeader.model_validate_json(text)
    except ValidationError as error:
        wrong = error.errors()[0]
        where = ".".join(map(str, wrong["loc"])) or "header"
        raise ModelError(f"{path}: the file is damaged ({where}: {wrong['msg']}); train again") from error
    if len(set(header.access_points)) < len(header.access_points):
        raise ModelError(f"{path}: the file is damaged (access_points: a name appears twice); train again")
    return header


def _made(path: Path, header: ModelHeader) -> Positioner:
    """Make the model, not fitted; if the program has no such model, the file is of another version."""
    stranger = f"{path}: the file was made by version {header.program_version}; this is version {__version__}, without"
    if header.model not in model_names():
        if removed := removed_model(header.model):
            raise ModelError(f"{path}: {removed}. The file cannot be opened; train a new model")
        raise ModelError(f"{stranger} model '{header.model}'; update vislam2tag, or install the plug-in with it")
    model = model_named(header.model)
    parameters = without_idle(header.model, header.parameters)
    unknown = sorted(parameters.keys() - model.get_params().keys())
    if unknown:
        if removed := removed_parameter(header.model, unknown[0]):
            raise ModelError(f"{path}: {removed}. The file cannot be opened; train a new model")
        raise ModelError(f"{stranger} parameter {unknown[0]} of {header.model}; update vislam2tag, or train again")
    try:
        return model_named(
            header.model, **{name: tuple(v) if isinstance(v, list) else v for name, v in parameters.items()}
        )
    except UsageError as error:
        raise ModelError(f"{path}: the file is damaged ({error}); train again") from error


def _checksum(fields: Mapping[str, Any], arrays: Mapping[str, AnyArray]) -> str:
    """Hash all fields of a header except the checksum itself, and all arrays."""
    rest = {name: value for name, value in fields.items() if name != _CHECKSUM}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True).encode())
    for name in sorted(arrays):
        array = arrays[name]
        digest.update(f"\n{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


INPUT = "level_dbm"
OPSET = 20


def write_onnx(model: Positioner, path: Path, about: Mapping[str, str] | None = None) -> None:
    """Write a fitted model as ONNX, whole or not at all; ``about`` adds entries to the file's metadata.

    The same model gives the same bytes. Raises UsageError if the model cannot be exported or ONNX is not installed, and
    OutputError if the file cannot be written.
    """
    module = model.torch_module()
    if module is None:
        raise UsageError(f"{type(model).__name__} cannot be exported to ONNX; only networks and cell-density can")
    graph = _graph(module, len(model.access_points_))
    graph.producer_name, graph.producer_version = "vislam2tag", __version__
    known = {
        "access_points": json.dumps(model.access_points_),
        "storeys": json.dumps([storey._asdict() for storey in model.storeys_]),
    }
    for key, value in (known | dict(about or {})).items():
        graph.metadata_props.add(key=key, value=value)
    write_file(path, graph.SerializeToString(deterministic=True))


def _graph(module: Any, access_points: int) -> Any:
    """Export the graph; takes seconds, most of them for PyTorch to start."""
    torch = import_extra("torch")
    import_extra("onnxscript")
    names = import_extra("vislam2tag.positioning.networks.layers").OUTPUTS
    example = torch.from_numpy(np.full((3, access_points), -60.0))
    with _quiet():
        program = torch.onnx.export(
            module,
            (example,),
            dynamo=True,
            dynamic_shapes={INPUT: {0: torch.export.Dim("n")}},
            input_names=[INPUT],
            output_names=list(names),
            opset_version=OPSET,
            verbose=False,
        )
    return _without_traces(program.model_proto)


@contextmanager
def _quiet() -> Iterator[None]:
    """Hide the exporter's internal warnings: deprecated calls, optional packages."""
    log = logging.getLogger("torch.onnx")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(level)


def _without_traces(graph: Any) -> Any:
    """Remove the source location of each node, because it differs between machines."""
    inner = graph.graph
    for part in (graph, inner, *inner.node, *inner.value_info, *inner.input, *inner.output):
        del part.metadata_props[:]
        part.doc_string = ""
    return graph
