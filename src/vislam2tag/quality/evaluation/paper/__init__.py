"""The paper's evaluation by its own rules: each of the ``walks``, Tables I and II (``tables``), and their text."""
