"""Lines that meet in nodes: what a graph of corridors is made of while it is being made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import line_length


@dataclass(frozen=True)
class Branch:
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


@dataclass
class Network:
    """Nodes with places (2,), and branches between them, by numbers that are never used again."""

    places: dict[int, FloatArray] = field(default_factory=dict)
    branches: dict[int, Branch] = field(default_factory=dict)
    shortcuts: set[int] = field(default_factory=set)
    """Branches that only shorten ways over open areas."""
    _at: dict[int, list[int]] = field(default_factory=dict)
    _made: int = 0

    def add_node(self, place: FloatArray) -> int:
        """Add a node at a place (2,); returns its number."""
        self._made += 1
        self.places[self._made] = place
        self._at[self._made] = []
        return self._made

    def add(self, first: int, last: int, line: FloatArray) -> int:
        """Add a branch between nodes with a line (k, 2); returns its number."""
        self._made += 1
        self.branches[self._made] = Branch(first, last, line)
        self._at[first].append(self._made)
        self._at[last].append(self._made)
        return self._made

    def at(self, node: int) -> list[int]:
        """Branches at a node; one that returns to it counts twice."""
        return self._at[node]

    def neighbours(self, node: int) -> list[int]:
        """Nodes at the other ends of a node's branches."""
        return [self.branches[number].other(node) for number in self._at[node]]

    def remove(self, number: int) -> None:
        """Remove a branch; its nodes stay."""
        branch = self.branches.pop(number)
        self._at[branch.first].remove(number)
        self._at[branch.last].remove(number)

    def replace_line(self, number: int, line: FloatArray) -> None:
        """Give a branch another line (k, 2) between the same nodes."""
        branch = self.branches[number]
        self.branches[number] = Branch(branch.first, branch.last, line)

    def remove_node(self, node: int) -> None:
        """Remove a node and its branches."""
        for number in set(self._at[node]):
            self.remove(number)
        del self.places[node], self._at[node]

    def split(self, number: int, corners: list[int]) -> list[int]:
        """Split a branch at corners of its line, in order, by new nodes; returns these."""
        branch = self.branches[number]
        made = [self.add_node(branch.line[corner]) for corner in corners]
        self.remove(number)
        nodes, marks = [branch.first, *made, branch.last], [0, *corners, len(branch.line) - 1]
        for piece in range(len(nodes) - 1):
            self.add(nodes[piece], nodes[piece + 1], branch.line[marks[piece] : marks[piece + 1] + 1])
        return made

    def join(self, node: int) -> None:
        """Make one branch of the two that meet at a node."""
        one, other = (self.branches[number] for number in self._at[node])
        line = np.vstack((one.away_from(node)[::-1], other.away_from(node)[1:]))
        first, last = one.other(node), other.other(node)
        self.remove_node(node)
        self.add(first, last, line)

    def join_through(self, keep: set[int] | frozenset[int] = frozenset()) -> None:
        """Join at every node in which just two branches meet, but for those to keep."""
        for node in list(self.places):
            if node not in keep and self._passes_through(node):
                self.join(node)

    def _passes_through(self, node: int) -> bool:
        numbers = self._at[node]
        return len(numbers) == 2 and numbers[0] != numbers[1]

    def merge(self, node: int, into: int, place: FloatArray) -> None:
        """Make one node of two, at a place (2,); branches between the two vanish."""
        for number in list(dict.fromkeys(self._at[node])):
            branch = self.branches[number]
            self.remove(number)
            if {branch.first, branch.last} != {node, into}:
                first, last = (into if end == node else end for end in (branch.first, branch.last))
                self.add(first, last, branch.line)
        del self.places[node], self._at[node]
        self.places[into] = place
        for number in list(dict.fromkeys(self._at[into])):
            branch = self.branches[number]
            starts, ends = branch.first == into, branch.last == into
            none = np.empty((0, 2))
            self.replace_line(
                number, np.vstack((place[None] if starts else none, branch.line, place[None] if ends else none))
            )

    def leaves(self) -> Iterator[tuple[int, int]]:
        """Branches that end at a node where nothing else is, with that node."""
        for node, numbers in self._at.items():
            if len(numbers) == 1:
                yield numbers[0], node
