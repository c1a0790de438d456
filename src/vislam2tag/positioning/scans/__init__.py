"""What models learn from: radio scans, their places, files of scans and tracks."""
