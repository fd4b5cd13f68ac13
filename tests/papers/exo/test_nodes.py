# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The leg pair on two topics, and what ties it, found from them."""

import re

from armid_msgs.msg import ParameterEstimate
from armid_ros.nodes.qos import LATCHED
from armid_ros.papers.exo.nodes.interaction_identifier import InteractionIdentifierNode
from armid_ros.papers.exo.nodes.simulated_pair import SimulatedPairNode
import pytest

from tests.ros.conftest import busy

START_NS = 1_000 * 10**9


def pair_node(bench, **parameters):
    options = {'real_time_factor': 0.0, 'rate': 250.0, 'seed': 1, **parameters}
    return bench.add(lambda **kw: SimulatedPairNode(start_ns=START_NS, **kw), **options)


def test_springs_are_found_from_the_topics(bench):
    estimates = bench.listen(ParameterEstimate, 'interaction_identifier/estimate', LATCHED)
    learner = bench.add(InteractionIdentifierNode, memory=4.0)
    node = pair_node(bench)
    learner.match()
    bench.spin_until(lambda: all(topic.publishers for topic in learner.topics), 'discovery')
    while not estimates and node.t < 6.0:
        received = learner.received + 2
        node.step()
        bench.spin_until(lambda received=received: learner.received >= received, 'joint states')
        bench.executor.spin_once(timeout_sec=0.0)
    bench.spin_until(lambda: estimates, 'the estimate')
    found = estimates[-1]
    assert list(found.name) == ['interaction_stiffness'] * 4
    assert found.joint[0] == 'exo_swing_knee'
    for value, std in zip(found.value, found.std_dev, strict=True):
        assert abs(value - 1e4) < 5.0 * std < 5e3
    for fresh in learner.freshness:
        fresh.now = lambda: 0.0  # time does not go on while the estimate is made
        fresh.mark_received()
    state = bench.diagnose(learner, bench.diagnostics())
    stated = next(float(v.value) for v in state.values if v.key.startswith('stiffness all'))
    assert stated == pytest.approx(1e4, rel=0.02)
    assert state.level == state.OK


def test_a_pair_that_falls_behind_real_time_says_so(bench, monkeypatch):
    node = pair_node(bench, real_time_factor=1.0)
    assert not node.condition()[0]
    before = node.stamp_ns
    busy(node.real_time, monkeypatch)
    node.catch_up()
    assert re.match(r'\d+\.\d s', node.condition()[0])
    assert node.stamp_ns - before > 9 * 10**9
