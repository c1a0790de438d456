"""Neural networks of the paper: layers, the training loop, what a network answers. Needs the extra ``models``."""
