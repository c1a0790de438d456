"""From data sets to positioning models (train), from scans to positions (locate), and comparison of models."""
