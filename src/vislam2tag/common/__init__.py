"""What every package may use: errors, findings, text tables, files written whole, palette; knows nothing of walks."""
