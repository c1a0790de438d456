"""Labels checked without truth: each landmark left out in turn, what one more would gain, which are bad."""
