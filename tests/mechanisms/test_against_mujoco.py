# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Machines with coupled joints in MuJoCo: torque, motion, and a payload that is named."""

from armid_ros.api.diagnosis import diagnose
from armid_ros.api.identification import identify
from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.model import inverse_dynamics
from armid_ros.motion import Motion
from armid_ros.recording import Recording
from armid_ros.robots import load_robot
from armid_ros.simulation import Plant
from armid_ros.simulation.integrator import step
import mujoco
import numpy as np
import pytest

from tests.mechanisms.machines import compiled, MACHINES, RATE, recorded

VISCOUS, COULOMB = 0.4, 0.3  # N m s/rad, N m
CARRIED = {
    'palletiser': 'flange',
    'parallelogram': 'flange',
    'wrist': 'hand',
    'gripper': 'follower',
}


def desired(robot, seconds, seed=0):
    """Return a sum of three sines for every joint, within its limits."""
    rng, t = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    half = np.minimum(0.5 * (robot.upper - robot.lower), 1.0)
    states = np.zeros((3, len(t), robot.n_joints))
    for joint in range(robot.n_joints):
        for order in (1, 2, 3):
            w, phase = 2.0 * np.pi * (0.15 * order + 0.02 * joint), rng.uniform(0.0, 2.0 * np.pi)
            size, angle = 0.28 * half[joint], w * t + phase
            states[:, :, joint] += size * np.array(
                [np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)]
            )
    middle = np.clip(0.0, robot.lower, robot.upper)
    return Motion(robot.joints, t, middle + states[0], states[1], states[2])


@pytest.fixture(scope='module')
def run(name, robot):
    """Record with friction and measurement noise, with a payload [kg] or without."""

    def of(seconds, seed, payload=0.0):
        model = compiled(name, (CARRIED[name], payload))
        for joint in robot.joints:
            dof = model.jnt_dofadr[model.joint(joint).id]
            model.dof_damping[dof], model.dof_frictionloss[dof] = VISCOUS, COULOMB
        motion, _ = recorded(model, robot, desired(robot, seconds, seed), gain=100.0)
        rng = np.random.default_rng(seed)
        noise = 0.01 * np.sqrt(np.mean(motion.tau**2, axis=0))
        q = motion.q + rng.normal(0.0, 2e-5, motion.q.shape)
        tau = motion.tau + noise * rng.normal(size=motion.tau.shape)
        return Recording(
            joints=robot.joints, t=motion.t, q=q, tau=tau, source=f'{seed} with {payload} kg'
        )

    return of


def test_the_torque_is_that_of_mujoco(name, robot):
    motion, positions = recorded(compiled(name), robot, desired(robot, 3.0))
    error = inverse_dynamics(robot, motion) - motion.tau
    rms = np.sqrt(np.mean(error**2, axis=0) / np.mean(motion.tau**2, axis=0))
    assert np.all(np.ptp(motion.q, axis=0) > 0.3 * np.minimum(robot.upper - robot.lower, 1.0))
    assert rms.max() < 0.005
    model = mujoco.MjModel.from_xml_string(MACHINES[name])
    places = [int(model.jnt_qposadr[model.joint(joint).id]) for joint in robot.moving]
    np.testing.assert_allclose(robot.positions(motion.q), positions[:, places], atol=2e-4)


def test_a_released_machine_falls_as_in_mujoco(name, robot):
    """Without a motor torque, from rest: the projected dynamics of the plant."""
    u = np.clip(0.3, robot.lower, robot.upper) * np.linspace(0.4, 0.8, robot.n_joints)
    model = compiled(name)
    model.jnt_limited[:] = 0
    data = mujoco.MjData(model)
    places = [int(model.jnt_qposadr[model.joint(joint).id]) for joint in robot.all_joints]
    data.qpos[places] = robot.positions(u)
    own = [int(model.jnt_qposadr[model.joint(joint).id]) for joint in robot.joints]
    damping = np.full(robot.n_joints, VISCOUS)
    model.dof_damping[own] = damping
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), damping)
    plant = Plant(arm, 5e-4, hard_stops=False)
    state = plant.state(u)
    for _ in range(400):
        state = step(plant, state, np.zeros(robot.n_joints))
    mujoco.mj_step(model, data, int(0.2 * RATE))
    fallen = np.abs(state.q - u).max()
    assert fallen > 0.02
    np.testing.assert_allclose(state.q, data.qpos[own], atol=0.003 * max(fallen, 0.1))


@pytest.mark.parametrize(
    'name',
    [
        *(pytest.param(loop, marks=pytest.mark.long) for loop in ('palletiser', 'parallelogram')),
        *('wrist', 'gripper'),
    ],
    indirect=True,
)
def test_identification_and_a_payload_that_is_named(name, robot, run):
    days = [run(10.0, seed) for seed in (0, 1)]
    found = identify(robot, days[0], validate=days[1])
    assert found.training.relative_error_percent < 5.0
    assert found['viscous_coefficient', 'j1'] == pytest.approx(VISCOUS, abs=0.05)
    loaded = [run(10.0, seed, 0.5) for seed in (2, 3)]
    result = diagnose(found, loaded[0], validate=loaded[1], baseline=days)
    assert result.verdict == 'named'
    assert result.names == ('payload',)
    (finding,) = result.core.findings
    assert finding.values[0] == pytest.approx(0.5, abs=0.05)
    body = robot.tree.description.by_name[finding.joints[0]].child
    assert body == CARRIED[name]


def test_the_online_estimate_predicts_the_torque(robot, run):
    recording = run(6.0, 4)
    arm = ArmModel.of(robot, effects='viscous_friction,coulomb_friction,torque_offset')
    identifier = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    rows = zip(recording.t, recording.q, recording.tau, strict=True)
    samples = [identifier.update(t, q, None, tau) for t, q, tau in rows]
    late = [one for one in samples if one is not None and one.t > 4.0]
    error = np.array([one.measured - one.predicted for one in late])
    tau = np.array([one.measured for one in late])
    assert np.linalg.norm(error) < 0.05 * np.linalg.norm(tau)


def test_exported_descriptions_have_the_couplings(robot, run, tmp_path):
    found = identify(robot, run(6.0, 5), physical=True)
    found.save(tmp_path / 'out')
    states = found.core.training[0].motion.select(slice(0, None, 100))
    wanted = inverse_dynamics(found.arm.robot, states)
    again = load_robot(tmp_path / 'out' / 'identified.urdf', joints=robot.joints)
    assert again.moving == robot.moving
    tau = inverse_dynamics(again, states)
    np.testing.assert_allclose(tau, wanted, atol=1e-6 * np.abs(wanted).max())
    model = mujoco.MjModel.from_xml_path(str(tmp_path / 'out' / 'identified.mjcf.xml'))
    assert model.neq > 0
