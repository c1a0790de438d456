"""Where a licence's text stands, and what Hugging Face calls it."""

from __future__ import annotations

from types import MappingProxyType

_TEXTS = MappingProxyType(
    {
        "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
        "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
        "CC-BY-SA-4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
        "CC-BY-NC-4.0": "https://creativecommons.org/licenses/by-nc/4.0/",
        "CC-BY-NC-SA-4.0": "https://creativecommons.org/licenses/by-nc-sa/4.0/",
        "CC-BY-ND-4.0": "https://creativecommons.org/licenses/by-nd/4.0/",
        "ODbL-1.0": "https://opendatacommons.org/licenses/odbl/1-0/",
        "ODC-By-1.0": "https://opendatacommons.org/licenses/by/1-0/",
        "PDDL-1.0": "https://opendatacommons.org/licenses/pddl/1-0/",
    }
)
_HUGGING_FACE = MappingProxyType(
    {
        **{name: name.lower() for name in _TEXTS if name.startswith("CC")},
        "ODbL-1.0": "odbl",
        "ODC-By-1.0": "odc-by",
        "PDDL-1.0": "pddl",
        "Apache-2.0": "apache-2.0",
        "MIT": "mit",
    }
)
"""Of https://huggingface.co/docs/hub/repositories-licenses, those that data are given under."""


def licence_url(licence: str) -> str | None:
    """Return where the text of an SPDX licence stands; None for one of one's own and for an expression of several."""
    if licence.startswith("LicenseRef-") or " " in licence:
        return None
    return _TEXTS.get(licence, f"https://spdx.org/licenses/{licence}.html")


def hugging_face_licence(licence: str | None) -> dict[str, str]:
    """Return the licence's fields for Hugging Face's front matter: its own name, or ``other`` with name and link."""
    if licence is None:
        return {}
    if licence in _HUGGING_FACE:
        return {"license": _HUGGING_FACE[licence]}
    return {"license": "other", "license_name": licence.lower(), "license_link": licence_url(licence) or "LICENSE"}
