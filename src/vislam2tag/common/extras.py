"""What only the extra ``models`` has: imported when a model needs it, so that everything else works without."""

from __future__ import annotations

import importlib
from types import ModuleType

from vislam2tag.common.errors import UsageError


def import_extra(module: str) -> ModuleType:
    """Import a module that needs PyTorch or ONNX.

    Raises UsageError that says how to install what lacks.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        if package in ("", "vislam2tag"):
            raise
        raise UsageError(
            f"{package} is not installed, and networks need it: pip install 'vislam2tag[models]' "
            "(where there is no GPU, install PyTorch's build for CPUs first: it is far smaller)"
        ) from error
