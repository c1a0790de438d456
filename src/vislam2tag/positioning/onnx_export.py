"""A model as an ONNX file that answers by itself: nothing of this package is needed to use it.

Input ``level_dbm`` (n, a), double: the level of each access point, in the order of the entry ``access_points`` of the
file's metadata, NaN where it was not heard. Outputs are fields of
:class:`~vislam2tag.positioning.places.Positions`: ``xy``, ``z``, ``storey`` (index into the entry ``storeys``;
-1: unknown), ``storey_probability``, ``radius_68_m``, ``radius_95_m``. Scaling, decoding, radii and the answer
"unknown" are part of the graph; what stays outside is to bring readings into the columns (of several readings of an
access point the mean in dBm counts; unknown access points are left out).
"""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import UsageError, import_extra
from vislam2tag.common.files.whole_output import write_file
from vislam2tag.positioning.registry import Positioner

INPUT = "level_dbm"
OPSET = 20


def write_onnx(model: Positioner, path: Path, about: Mapping[str, str] | None = None) -> None:
    """Write a fitted model, whole or not at all; ``about`` adds entries to the file's metadata.

    The same model gives the same bytes. Raises UsageError where the model has no such form or ONNX is not installed,
    and OutputError where the file cannot be written.
    """
    module = model.torch_module()
    if module is None:
        raise UsageError(f"{type(model).__name__} is not exported to ONNX; only networks and cell-density are")
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
    """Export; takes seconds, most of them for PyTorch to get ready."""
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
    """Hide what the exporter says of its own insides: old calls that it makes, packages that it could use."""
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
    """Remove where in which file each node came from: it differs between machines."""
    inner = graph.graph
    for part in (graph, inner, *inner.node, *inner.value_info, *inner.input, *inner.output):
        del part.metadata_props[:]
        part.doc_string = ""
    return graph
