"""Data sets: fingerprints, sequences, splits, statistics, and every format that this field reads."""
