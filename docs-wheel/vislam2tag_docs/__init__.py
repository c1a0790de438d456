"""The site in ``site/``; ``vislam2tag docs`` opens it."""
