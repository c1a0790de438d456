"""The paper's evaluation by its own rules: walks, Tables I and II."""
