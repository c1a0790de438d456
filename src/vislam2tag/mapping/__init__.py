"""Mapping strategies: one file and one registered name each."""

from vislam2tag.mapping.registry import MappingStrategy, strategy_modules, strategy_named, strategy_names

__all__ = ["MappingStrategy", "strategy_modules", "strategy_named", "strategy_names"]
