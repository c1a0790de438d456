"""Commands for positioning models: train, locate, benchmark."""
