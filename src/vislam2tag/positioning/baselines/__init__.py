"""What the baseline models are made of: votes of training scans, trees as arrays, maps of levels by cell."""
