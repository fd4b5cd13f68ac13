# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A motion that separates two names: one the arm can make, worth what is said."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import next_run
from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.next_run.separation import Load, separation
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.effects import CATALOGUE
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    ClearanceModel,
    FourierTrajectory,
    Limits,
    random_feasible,
    trajectory_faults,
)
from armid_ros.excitation.feasibility import CLEARANCE, excitation_faults, templates
from armid_ros.model import inverse_dynamics
from armid_ros.recording import Recording
from armid_ros.robots import collision_model, robot_from_urdf
import numpy as np
import pytest

from tests.clearance import path_clearance
from tests.diagnosis.conftest import diagnosed, LINK, POSITION_NOISE, TORQUE_NOISE
from tests.diagnosis.test_floor import cut

OFFSET = 0.05


def offset(motion, tau):
    """Return a constant torque of the elbow."""
    return np.tile([0.0, OFFSET], (len(motion), 1))


def heavier(robot):
    """Return a robot whose last link carries something."""
    parameters = robot.rigid_parameters.copy()
    parameters[-10:] += [0.5, 0.0, 0.0, 0.1, 0.02, 0.0, 0.02, 0.0, 0.0, 0.0]
    return robot.with_inertias(parameters)


@pytest.fixture(scope='module')
def named(bench):
    """Return the diagnosis of an offset of the elbow."""
    found = diagnosed(bench.arm, bench.recordings(offset))
    assert [f.name for f in found.findings] == ['torque_offset']
    return found


@pytest.fixture(scope='module')
def doubtful(named):
    """Return the same with two other names left possible, as poorer data would."""
    (step,) = named.explanation.steps
    rivals = [
        next(t for t in named.explanation.candidates if t.key[:2] == (name, ('elbow',)))
        for name in ('encoder_offset', 'torque_drift')
    ]
    steps = (replace(step, rivals=tuple(rivals)),)
    return replace(named, verdict='ambiguous', explanation=replace(named.explanation, steps=steps))


@pytest.fixture(scope='module')
def chosen(doubtful):
    """Return what to run next."""
    return next_run(doubtful, np.random.default_rng(1))


def test_nothing_is_to_be_run_where_no_name_is_in_doubt(named):
    (step,) = named.explanation.steps
    sure = replace(named.explanation, steps=(replace(step, rivals=()),))
    found = replace(named, verdict='named', explanation=sure)
    assert next_run(found, np.random.default_rng(1)) is None


def test_a_run_that_tells_nothing_is_none(bench):
    """A load of a link is that link: any motion would be in vain."""
    hidden = bench.recordings(
        lambda motion, tau: (
            inverse_dynamics(heavier(bench.robot), motion) - inverse_dynamics(bench.robot, motion)
        )
    )
    found = diagnosed(bench.arm, hidden)
    (one,) = found.findings
    assert {one.name, *one.ambiguous_with} == {'payload', 'link_inertia'}
    with pytest.raises(TrajectoryError, match='planned motions'):
        next_run(found, np.random.default_rng(1))


def test_the_arm_can_make_the_run_without_hitting_its_own_pedestal(bench, chosen):
    bodies = collision_model(bench.robot)
    clearance = ClearanceModel.of(bodies, CLEARANCE)
    limits = Limits.of(bench.robot, speed=0.9)
    run = chosen.excitation
    assert not trajectory_faults(bench.arm, limits, run.trajectory, clearance)
    assert not excitation_faults(bench.arm, limits, run)
    assert path_clearance(bodies, run.motion(100.0).q).min() >= CLEARANCE
    assert run.n_periods == 2


def test_every_motion_to_choose_from_keeps_clear_where_careless_ones_do_not(bench):
    rng = np.random.default_rng(2)
    bodies = collision_model(bench.robot)
    careless = [
        random_feasible(bench.arm, Limits.of(bench.robot, speed=0.4), 10.0, 5, rng)
        for _ in range(12)
    ]
    assert min(path_clearance(bodies, t.one_period(200).q).min() for t in careless) < 0.0
    for template in templates(('elbow',)):
        motion = template.draw(bench.arm, ClearanceModel.of(bodies), rng).one_period(400)
        assert path_clearance(bodies, motion.q).min() >= CLEARANCE
        still = np.ptp(motion.q, axis=0) == 0.0
        assert list(still) == ([True, False] if template.joints else [False, False])


def test_the_run_separates_the_names_as_far_as_was_said(bench, doubtful, chosen):
    motion = chosen.excitation.motion(200.0)
    rng = np.random.default_rng(3)
    tau = bench.torque(motion) + offset(motion, None)
    recording = Recording(
        joints=motion.joints,
        t=motion.t,
        q=motion.q + POSITION_NOISE * rng.normal(size=motion.q.shape),
        tau=tau + TORQUE_NOISE * rng.normal(size=motion.q.shape),
        source='next run',
    )
    data = cut([recording])
    sigma = [noise_floor(data[0], bench.arm).sigma]
    rows = data[0].informative.sum(axis=0)

    evidence = Evidence.over_noise(data, sigma)
    problem = JointFit.over_noise(bench.arm, evidence, np.random.default_rng(0)).as_described()

    def squares(name):
        effect = CATALOGUE[name].on(bench.robot, ('elbow',))
        kept = tuple(range(len(effect.parameters(bench.robot))))
        fitted = problem.fit([NamedEffect(effect, kept, np.zeros(len(kept)))])
        return float(np.sum(evidence.chi2_per_row(evidence.residuals(fitted.arm)) * rows))

    own = squares('torque_offset')
    for pair in chosen.separations:
        measured = np.sqrt(max(squares(pair.rival) - own, 0.0))
        assert measured == pytest.approx(pair.z, rel=0.5)
    assert chosen.document()['expected_z'] > 5.0


def test_only_a_known_payload_tells_a_gain_from_the_mass():
    joint = """<joint name="hinge" type="revolute"><parent link="base"/><child link="bob"/>
        <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="6"/></joint>"""
    bob = LINK.format(name='bob', mass=3.0, com=0.15)
    robot = robot_from_urdf(f'<robot name="pendulum"><link name="base"/>{bob}{joint}</robot>')
    gain = CATALOGUE['torque_gain'].on(robot)
    arm = ArmModel(robot).with_effect(gain, [0.05])
    used = SimpleNamespace(rate_hz=100.0, decimation=4)
    found = SimpleNamespace(
        arm=arm,
        refitted=True,
        data=[SimpleNamespace(used=used)],
        explanation=SimpleNamespace(
            given=SimpleNamespace(effects=(), values=()),
            fitted=SimpleNamespace(named=[NamedEffect(gain, (0,), np.zeros(1))]),
            evidence=SimpleNamespace(sigma=[np.array([0.02])]),
        ),
    )
    trajectory = FourierTrajectory(
        robot.joints, 8.0, np.zeros(1), np.array([[0.8, 1.0]]), np.array([[0.5, 0.4]])
    )
    pair = gain, CATALOGUE['link_inertia'].on(robot)
    assert separation(found, *pair, trajectory).z < 1e-3
    assert separation(found, *pair, trajectory, load=Load(1.0, 'bob')).z > 10.0
