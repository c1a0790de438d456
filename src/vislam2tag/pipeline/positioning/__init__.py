"""From data sets to positioning models, and from scans to positions."""
