"""What models learn from: radio scans and their places, what is held out, and files of scans and tracks."""
