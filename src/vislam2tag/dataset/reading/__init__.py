"""What several formats that are read share: archives, wide tables and points, or walks logged between taps."""
