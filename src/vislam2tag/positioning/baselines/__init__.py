"""What the baseline models are made of: votes of training scans, trees as arrays, maps of levels by cell.

The models that let scans vote share one class, in ``voting_positioner.py``.
"""
