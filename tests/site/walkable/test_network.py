from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.site.walkable.skeleton import Network


def chain(*points: tuple[float, float]) -> tuple[Network, list[int]]:
    network = Network()
    places = [np.array(point, dtype=np.float64) for point in points]
    nodes = [network.add_node(place) for place in places]
    for one, other in zip(range(len(nodes) - 1), range(1, len(nodes)), strict=True):
        network.add(nodes[one], nodes[other], np.array([places[one], places[other]]))
    return network, nodes


def length(network: Network) -> float:
    return sum(branch.length_m for branch in network.branches.values())


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=3, max_size=8, unique=True))
def test_joining_keeps_the_length(points: list[tuple[int, int]]) -> None:
    network, nodes = chain(*points)
    before = length(network)
    network.join_through()
    (branch,) = network.branches.values()
    assert length(network) == pytest.approx(before)
    assert {branch.first, branch.last} == {nodes[0], nodes[-1]}


def test_nodes_to_keep_are_not_joined_at() -> None:
    network, nodes = chain((0, 0), (1, 0), (2, 0))
    network.join_through({nodes[1]})
    assert len(network.branches) == 2


def test_splitting_keeps_the_length_and_order() -> None:
    network, nodes = chain((0, 0), (9, 0))
    (number,) = network.branches
    network.replace_line(number, np.array([(0.0, 0.0), (3.0, 0.0), (6.0, 0.0), (9.0, 0.0)]))
    made = network.split(number, [1, 2])
    assert [network.places[node][0] for node in made] == [3, 6]
    assert length(network) == 9
    assert network.neighbours(nodes[0]) == [made[0]]


def test_merging_moves_both_ends_and_drops_what_lies_between() -> None:
    network, nodes = chain((0, 0), (4, 0), (5, 0), (9, 0))
    network.merge(nodes[2], nodes[1], np.array([4.5, 1.0]))
    assert len(network.branches) == 2
    assert sorted(network.neighbours(nodes[1])) == [nodes[0], nodes[3]]
    for branch in network.branches.values():
        assert branch.away_from(nodes[1])[0].tolist() == [4.5, 1.0]


def test_a_ring_counts_twice_at_its_node() -> None:
    network, nodes = chain((0, 0), (1, 0))
    network.add(nodes[1], nodes[1], np.array([(1.0, 0.0), (2.0, 1.0), (1.0, 0.0)]))
    assert len(network.at(nodes[1])) == 3
    assert [node for _, node in network.leaves()] == [nodes[0]]
    network.remove_node(nodes[1])
    assert not network.branches
