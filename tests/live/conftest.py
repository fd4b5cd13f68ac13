# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a moving arm with a known model, with and without a change."""

from armid_ros.arm import ArmModel
from armid_ros.effects import parse_effect
from armid_ros.nodes.live import DiagnosisRequest, Worker
from armid_ros.recording import Recording
from armid_ros.simulation import Reference, Sensors, SimulatedArm
import numpy as np
import pytest

RATE = 200.0
KNOWN = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
MORE_FRICTION = 'viscous_friction@elbow_pitch:viscous_coefficient=0.3'


class InProcess:
    """An assistant that runs each task at once, in this process."""

    def __init__(self):
        self._worker, self._results = Worker(), []

    @property
    def busy(self):
        return bool(self._results)

    def ask(self, *task):
        self._results.append(self._worker.run(*task))

    def poll(self):
        return self._results.pop(0) if self._results else None

    def close(self):
        pass


def moving(robot, duration, rng):
    """Return a motion of three harmonics per joint that begins and ends at rest."""
    t = np.arange(0.0, duration, 0.01)[:, np.newaxis]
    q = np.zeros((len(t), robot.n_joints))
    for rate, share in ((0.9, 1.0), (1.9, 0.6), (4.7, 0.2)):
        phase = rng.uniform(0.0, 2.0 * np.pi, robot.n_joints)
        q += 0.25 * share * (np.sin(rate * t + phase) - np.sin(phase))
    x = np.clip(t / 3.0, 0.0, 1.0)
    q *= x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    y = np.clip((t[-1] - t) / 3.0, 0.0, 1.0)
    q *= y**3 * (10.0 - 15.0 * y + 6.0 * y**2)
    dq = np.gradient(q, 0.01, axis=0)
    dq[[0, -1]] = 0.0
    ddq = np.gradient(dq, 0.01, axis=0)
    return Reference(robot.joints, t[:, 0], robot.middle_pose + q, dq, ddq)


def recorded(before, after, then=None):
    """Record an arm that gets the effect `then` after `before` seconds."""
    rng = np.random.default_rng(5)
    arm = ArmModel.of('humanoid_arm', effects=KNOWN)
    motion = moving(arm.robot, before + after + 4.0, rng)
    sensors = Sensors(torque_noise=0.05, resolution=2e-5)
    simulated = SimulatedArm(arm, rng=rng, sensors=sensors, start=motion.q[0])
    simulated.set_trajectory(motion)
    samples = []
    for count in range(round((before + after) * RATE)):
        if then and count == round(before * RATE):
            simulated.become(arm.with_effect(*parse_effect(then, arm.robot)))
        samples.append(simulated.advance(5))
    columns = {name: np.array([getattr(s, name) for s in samples]) for name in ('q', 'dq', 'tau')}
    t = np.array([s.t for s in samples])
    return Recording(joints=arm.robot.joints, t=t - t[0], source='run', **columns)


@pytest.fixture(scope='session')
def known_arm():
    return ArmModel.of('humanoid_arm', effects=KNOWN)


@pytest.fixture(scope='session')
def healthy():
    return recorded(12.0, 0.0)


@pytest.fixture(scope='session')
def changed():
    """Return a run of 20 s in which friction rises after 8 s."""
    return recorded(8.0, 12.0, MORE_FRICTION)


@pytest.fixture(scope='session')
def asked(known_arm, changed):
    """Return the request for a diagnosis of the run."""
    return DiagnosisRequest(known_arm, changed, end=20.0)


@pytest.fixture(scope='session')
def answered(asked):
    """Return the worker that answered the request, and its answer."""
    worker = Worker()
    return worker, worker.run('diagnose', asked)
