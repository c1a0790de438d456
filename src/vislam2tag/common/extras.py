"""What a base installation lacks, and which extra of the package has it."""

from __future__ import annotations

import importlib
from types import ModuleType

from vislam2tag.common.errors import UsageError

_EXTRAS = {
    "tables": ("openpyxl",),
    "plans": ("ezdxf", "pypdfium2", "resvg_py"),
    "prepare": ("cv2", "reportlab", "skimage"),
    "receive": ("segno", "starlette", "uvicorn"),
    "positioning": ("safetensors", "sklearn", "tifffile"),
    "hdf5": ("h5py",),
    "mcap": ("google", "mcap", "mcap_protobuf"),
    "fleet": ("dask", "distributed", "obstore"),
    "models": ("onnx", "onnxscript", "torch"),
}
"""By extra (pyproject.toml), the packages whose lack names it; segno is in ``prepare``, too."""


class MissingExtraError(UsageError):
    """What was asked for needs a package that an extra brings."""


def missing_extra(error: ModuleNotFoundError) -> str | None:
    """Say what to install, to end a sentence, where a package of an extra was not found; else None."""
    package = (error.name or "").partition(".")[0]
    for extra, packages in _EXTRAS.items():
        if package in packages:
            smaller = " (where there is no GPU, install PyTorch's build for CPUs first: it is far smaller)"
            return f"needs {package}: pip install 'vislam2tag[{extra}]'{smaller if extra == 'models' else ''}"
    return None


def import_extra(module: str) -> ModuleType:
    """Import a module that needs packages of an extra; raises MissingExtraError that names it where they lack."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        lacks = missing_extra(error)
        if lacks is None:
            raise
        raise MissingExtraError(f"this {lacks}") from error
