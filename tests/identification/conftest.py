# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm, an exciting motion in closed form, and noisy recordings of it."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import identify
from armid_ros.identification.online.background import at_once, Background
from armid_ros.recording import Recording
import numpy as np
import pytest

from benchmarks.multisine import multisine as sum_of_sines

FRICTION = {'viscous_friction': 0.08, 'coulomb_friction': 0.05, 'torque_offset': 0.02}


class Foreground(Background):
    """A background that does every job at once in the foreground."""

    def begin(self, job, *, urgent=False):
        """Do a job at once."""
        at_once(job)


@pytest.fixture(scope='session')
def arm(robot):
    """Return the humanoid arm with friction and offsets."""
    model = ArmModel(robot)
    for name, value in FRICTION.items():
        model = model.with_effect(make_effect(name, robot), np.full(6, value))
    return model


@pytest.fixture(scope='session')
def structure(arm):
    """Return the same arm without values of its effects."""
    return ArmModel(arm.robot, arm.effects)


def multisine(joints, duration, rate, seed, amplitude=0.5, base_hz=0.1):
    """Return three harmonics per joint with random phases, exact to the second derivative."""
    t = np.arange(round(duration * rate)) / rate
    tones = [(k * base_hz, share * amplitude) for k, share in ((1, 1.0), (2, 0.6), (5, 0.2))]
    return sum_of_sines(joints, t, np.random.default_rng(seed), tones)


def recorded(arm, motion, seed=0, torque_noise=0.0, position_noise=0.0, source='bag'):
    """Return a recording of an arm along a motion, with white sensor noise."""
    rng = np.random.default_rng(seed)
    tau = arm.torque(motion)
    return Recording(
        joints=motion.joints,
        t=motion.t,
        q=motion.q + position_noise * rng.normal(size=motion.q.shape),
        tau=tau + torque_noise * rng.normal(size=tau.shape),
        source=source,
        temperature=motion.temperature,
    )


@pytest.fixture(scope='session')
def recording(arm):
    """Return a recording of 20 s with noise of both sensors."""
    motion = multisine(arm.robot.joints, 20.0, 200.0, seed=1)
    return recorded(arm, motion, torque_noise=0.02, position_noise=1e-6)


@pytest.fixture(scope='session')
def identified(structure, recording):
    """Return the identification of the arm from this recording."""
    return identify(structure, [recording], rng=np.random.default_rng(0))
