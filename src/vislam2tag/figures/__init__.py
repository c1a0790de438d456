"""Figures for print: one function each, from domain objects to a matplotlib figure."""
