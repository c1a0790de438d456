"""What several formats that are read share: wide tables and points, or walks logged between taps."""
