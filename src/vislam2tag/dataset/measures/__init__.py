"""What a data set amounts to: statistics, coverage, the walk that fills its gaps."""
