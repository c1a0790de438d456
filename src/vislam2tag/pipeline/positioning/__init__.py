"""From data sets to positioning models (train), from scans to positions (locate), and models compared."""
