"""Sessions that phones hand over while the studio runs, and what of each floor they have covered."""
