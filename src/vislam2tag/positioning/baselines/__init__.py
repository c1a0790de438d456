"""What the baseline models are made of: votes, trees, level maps."""
