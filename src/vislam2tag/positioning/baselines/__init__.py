"""What models that compare scans are made of: an index of the nearest scans, and votes of their places."""
