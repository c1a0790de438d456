"""A ``dataset.toml`` with every field."""

FULL = """
title = "Wi-Fi of a simulated building"
description = "Two phones, two floors.\\nNothing in it is real: \\"simulated\\"."
licence = "cc-by-4.0"
keywords = ["indoor positioning", "Wi-Fi"]
version = "1.0.0"
published = 2026-03-01
publisher = "Zenodo"
doi = "https://doi.org/10.5281/zenodo.1234567"
contact = "maps@example.org"

[[creators]]
name = "Carberry, Josiah"
affiliation = "Brown | Co"
orcid = "https://orcid.org/0000-0002-1825-0097"

[[creators]]
name = "The surveyors' club"

[[funding]]
funder = "A foundation"
award = "12"

[[related]]
identifier = "10.5555/12345678"
relation = "IsDescribedBy"

[[related]]
identifier = "arXiv:2201.00001"
relation = "References"

[[related]]
identifier = "https://example.org/a"
relation = "IsDerivedFrom"
"""
