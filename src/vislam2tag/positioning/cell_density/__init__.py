"""What cell-density is made of: kernel over scans, field of levels, novelty, storeys, networks."""
