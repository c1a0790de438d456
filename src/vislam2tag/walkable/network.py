"""Lines that meet in nodes: what a graph of corridors is made of while it is being made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vislam2tag.core.arrays import FloatArray


@dataclass(frozen=True)
class Strand:
    """A line (k, 2), BCS metres, from one node to another (or the same)."""

    first: int
    last: int
    line: FloatArray

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return line_length(self.line)

    def away_from(self, node: int) -> FloatArray:
        """The line (k, 2), starting at this node."""
        return self.line if self.first == node else self.line[::-1]

    def other(self, node: int) -> int:
        """The node at the other end."""
        return self.last if self.first == node else self.first


def line_length(line: FloatArray) -> float:
    """Length of a line (k, 2)."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


@dataclass
class Network:
    """Nodes with places (2,), and strands between them, by numbers that are never used again."""

    places: dict[int, FloatArray] = field(default_factory=dict)
    strands: dict[int, Strand] = field(default_factory=dict)
    shortcuts: set[int] = field(default_factory=set)
    """Strands that only shorten ways over open areas."""
    _at: dict[int, list[int]] = field(default_factory=dict)
    _made: int = 0

    def add_node(self, place: FloatArray) -> int:
        """Add a node at a place (2,); returns its number."""
        self._made += 1
        self.places[self._made] = place
        self._at[self._made] = []
        return self._made

    def add(self, first: int, last: int, line: FloatArray) -> int:
        """Add a strand between nodes with a line (k, 2); returns its number."""
        self._made += 1
        self.strands[self._made] = Strand(first, last, line)
        self._at[first].append(self._made)
        self._at[last].append(self._made)
        return self._made

    def at(self, node: int) -> list[int]:
        """Strands at a node; one that returns to it counts twice."""
        return self._at[node]

    def neighbours(self, node: int) -> list[int]:
        """Nodes at the other ends of a node's strands."""
        return [self.strands[number].other(node) for number in self._at[node]]

    def remove(self, number: int) -> None:
        """Remove a strand; its nodes stay."""
        strand = self.strands.pop(number)
        self._at[strand.first].remove(number)
        self._at[strand.last].remove(number)

    def replace_line(self, number: int, line: FloatArray) -> None:
        """Give a strand another line (k, 2) between the same nodes."""
        strand = self.strands[number]
        self.strands[number] = Strand(strand.first, strand.last, line)

    def remove_node(self, node: int) -> None:
        """Remove a node and its strands."""
        for number in set(self._at[node]):
            self.remove(number)
        del self.places[node], self._at[node]

    def split(self, number: int, corners: list[int]) -> list[int]:
        """Split a strand at corners of its line, in order, by new nodes; returns these."""
        strand = self.strands[number]
        made = [self.add_node(strand.line[corner]) for corner in corners]
        self.remove(number)
        nodes, marks = [strand.first, *made, strand.last], [0, *corners, len(strand.line) - 1]
        for piece in range(len(nodes) - 1):
            self.add(nodes[piece], nodes[piece + 1], strand.line[marks[piece] : marks[piece + 1] + 1])
        return made

    def join(self, node: int) -> None:
        """Make one strand of the two that meet at a node."""
        one, other = (self.strands[number] for number in self._at[node])
        line = np.vstack((one.away_from(node)[::-1], other.away_from(node)[1:]))
        first, last = one.other(node), other.other(node)
        self.remove_node(node)
        self.add(first, last, line)

    def join_through(self, keep: set[int] | frozenset[int] = frozenset()) -> None:
        """Join at every node in which just two strands meet, but for those to keep."""
        for node in list(self.places):
            if node not in keep and self._passes_through(node):
                self.join(node)

    def _passes_through(self, node: int) -> bool:
        numbers = self._at[node]
        return len(numbers) == 2 and numbers[0] != numbers[1]

    def merge(self, node: int, into: int, place: FloatArray) -> None:
        """Make one node of two, at a place (2,); strands between the two vanish."""
        for number in list(dict.fromkeys(self._at[node])):
            strand = self.strands[number]
            self.remove(number)
            if {strand.first, strand.last} != {node, into}:
                first, last = (into if end == node else end for end in (strand.first, strand.last))
                self.add(first, last, strand.line)
        del self.places[node], self._at[node]
        self.places[into] = place
        for number in list(dict.fromkeys(self._at[into])):
            strand = self.strands[number]
            starts, ends = strand.first == into, strand.last == into
            none = np.empty((0, 2))
            self.replace_line(
                number, np.vstack((place[None] if starts else none, strand.line, place[None] if ends else none))
            )

    def leaves(self) -> Iterator[tuple[int, int]]:
        """Strands that end at a node where nothing else is, with that node."""
        for node, numbers in self._at.items():
            if len(numbers) == 1:
                yield numbers[0], node
