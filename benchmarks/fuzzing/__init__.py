"""The fuzz campaign: what is attacked, with what, and how a run is judged (benchmarks/fuzz_campaign.py)."""
