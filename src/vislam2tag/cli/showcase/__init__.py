"""Commands that do all of it on data of their own: the paper's figures and the demo."""
