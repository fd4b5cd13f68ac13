# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Streams of joint states with damaged messages: what is damaged is left out, the estimate is right.

One arm in motion, and in its stream a few messages that are not what was sent: other numbers,
lengths, names or stamps, none, twice, in another order. Whatever they are, nothing is
raised, no estimate is NaN, the truth stays where the deviations say that it is, and the deviations
grow by less than a factor.

"""

from __future__ import annotations

from copy import deepcopy
import os

from armid_ros.arm import ArmModel
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.nodes.messages.joint_states import JointStateReader
from builtin_interfaces.msg import Time
from hypothesis import example, given, HealthCheck, settings, strategies
import numpy as np
import pytest
from rclpy.clock import Clock
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tests.ros.controller import joint_state
from tests.ros.test_online_identifier import EFFECT, PENDULUM, two_sines

RATE, SECONDS, NOISE, RESOLUTION = 100.0, 4.0, 0.05, 1e-5
COUNT = round(RATE * SECONDS)
#: Damaged messages of a stream, and what they may make of deviations and values.
MOST, INFLATED, SHIFTED = 5, 1.5, 3.0
USUAL = 100
EXAMPLES = int(os.environ.get('ARMID_FUZZ', USUAL))

FIELDS = strategies.sampled_from(['position', 'velocity', 'effort'])
NUMBERS = strategies.one_of(
    strategies.floats(),
    strategies.floats(-100.0, 100.0),
    strategies.sampled_from([0.0, 1e5, -1e6, 1e100, 1e154, -1.7e308, np.inf, np.nan]),
)
STAMPS = strategies.one_of(
    strategies.integers(-(2**31), 2**31 - 1), strategies.sampled_from([-1, 0, 1, 999, 1001, 1004])
)
NAMES = strategies.sampled_from([[], ['shoulder'], ['elbow'] * 2, ['x', 'y'], ['', '\x1b[2J']])
DAMAGE = strategies.one_of(
    strategies.tuples(strategies.just('number'), FIELDS, strategies.integers(0, 1), NUMBERS),
    strategies.tuples(strategies.just('scale'), FIELDS, strategies.integers(0, 1), NUMBERS),
    strategies.tuples(strategies.just('length'), FIELDS, strategies.integers(0, 3)),
    strategies.tuples(strategies.just('names'), NAMES),
    strategies.tuples(strategies.just('stamp'), STAMPS, strategies.integers(0, 2**32 - 1)),
    strategies.tuples(strategies.sampled_from(['lost', 'twice', 'swapped', 'turned round'])),
)
STREAMS = strategies.dictionaries(strategies.integers(0, COUNT - 2), DAMAGE, max_size=MOST)


class Silent:
    """Complaints that are counted alone."""

    count = 0

    def say(self, kind: str, text: str) -> None:
        assert text and kind
        self.count += 1


def measured() -> tuple[np.ndarray, ...]:
    """Return the truth, and what sensors say of a motion: q, dq, tau."""
    arm = ArmModel.of(PENDULUM, effects=EFFECT)
    motion, rng = two_sines(arm, np.arange(COUNT) / RATE, 2.3), np.random.default_rng(0)
    q = np.round(motion.q / RESOLUTION) * RESOLUTION
    return arm, q, motion.dq, motion.tau + NOISE * rng.normal(size=q.shape)


ARM_MODEL, Q, DQ, TAU = measured()
FRESH = {
    velocity: OnlineIdentifier(
        ArmModel(ARM_MODEL.robot, ARM_MODEL.effects),
        OnlineSettings(measured_velocity=velocity),
        rng=np.random.default_rng(0),
    )
    for velocity in (False, True)
}
TRUTH = FRESH[False].base.values(ARM_MODEL.theta)


def message(k: int) -> JointState:
    return joint_state(1000.0 + k / RATE, ['shoulder', 'elbow'], Q[k], DQ[k], TAU[k])


def spoil(state: JointState, kind: str, *how: object) -> list[JointState]:
    """Return what comes in place of a message."""
    if kind in ('number', 'scale'):
        name, joint, number = how
        values = list(getattr(state, name))
        values[joint] = number * (values[joint] if kind == 'scale' else 1.0)
        setattr(state, name, values)
    elif kind == 'length':
        setattr(state, how[0], [0.1] * how[1])
    elif kind == 'names':
        state.name = how[0]
    elif kind == 'stamp':
        state.header.stamp = Time(sec=how[0], nanosec=how[1])
    elif kind == 'turned round':
        for name in ('name', 'position', 'velocity', 'effort'):
            setattr(state, name, list(getattr(state, name))[::-1])
    return {'lost': [], 'twice': [state, state]}.get(kind, [state])


def stream(damage: dict[int, tuple]) -> list[JointState]:
    found: list[JointState] = []
    for k in range(COUNT):
        one = spoil(message(k), *damage[k]) if k in damage else [message(k)]
        if damage.get(k - 1, ('',))[0] == 'swapped':
            one = [*one, found.pop()] if found else one
        found += one
    return found


def learned(damage: dict[int, tuple], velocity: bool = False) -> OnlineIdentifier:
    online = deepcopy(FRESH[velocity])
    reader = JointStateReader(ARM_MODEL.robot.joints, Silent(), Clock())
    for state in stream(damage):
        sample = reader.read(serialize_message(state))
        if sample is not None:
            online.update(*sample)
            assert np.all(np.isfinite(online.estimate().values))
    return online


UNDAMAGED = {velocity: learned({}, velocity).estimate() for velocity in FRESH}


@pytest.mark.parametrize('velocity', [False, True])
def test_the_undamaged_stream_gives_the_truth(velocity):
    error = np.abs(UNDAMAGED[velocity].values - TRUTH)
    assert np.all(error < SHIFTED * UNDAMAGED[velocity].std + 1e-2)


@pytest.mark.long
@settings(
    max_examples=EXAMPLES,
    derandomize=EXAMPLES <= USUAL,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
@given(damage=STREAMS, velocity=strategies.booleans())
@example(damage={200: ('number', 'effort', 1, 100.0)}, velocity=False)
@example(damage={200: ('number', 'effort', 0, 1e154)}, velocity=False)
@example(damage={200: ('stamp', -1, 0)}, velocity=False)
@example(damage={200: ('stamp', 2**31 - 1, 2**32 - 1)}, velocity=False)
@example(damage={0: ('number', 'effort', 0, 1e5), 1: ('stamp', 5, 0)}, velocity=False)
@example(damage={0: ('number', 'position', 0, 16.0)}, velocity=False)
@example(damage=dict.fromkeys(range(150, 154), ('lost',)), velocity=False)
@example(damage={149: ('lost',), 150: ('number', 'effort', 1, 4.0)}, velocity=False)
@example(damage={127: ('scale', 'position', 1, 1.03125)}, velocity=False)
@example(damage={392: ('stamp', 1004, 0)}, velocity=True)
@example(damage={57: ('number', 'position', 0, -232.0)}, velocity=False)
@example(damage={150: ('names', ['shoulder']), 151: ('length', 'effort', 0)}, velocity=True)
def test_damaged_messages_change_nothing(damage, velocity):
    online = learned(damage, velocity)
    estimate, whole = online.estimate(), UNDAMAGED[velocity]
    assert np.all(np.isfinite(estimate.values)) and np.all(np.isfinite(estimate.covariance))
    assert np.isfinite(online.condition_number)
    shift = np.abs(estimate.values - whole.values) / np.hypot(estimate.std, whole.std)
    assert np.max(shift) < SHIFTED
    assert np.max(estimate.std / whole.std) < INFLATED
    assert not online.changes
