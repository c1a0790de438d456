"""Sessions handed over by phones: zips are checked and filed in the survey (docs/how-to/receive.md)."""
