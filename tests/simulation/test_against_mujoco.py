# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The plant against MuJoCo, an engine with other dynamics, contact and friction code."""

from xml.etree import ElementTree

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.robots import load_robot, Robot
from armid_ros.simulation import Controller, Plant, Reference, simulate, SimulatedRun
import mujoco
import numpy as np
import pytest

from tests.simulation.conftest import gravity_pd

DT = 1e-3
SUBSTEPS = 5


def mujoco_model(
    robot: Robot, damping: np.ndarray, friction: np.ndarray, armature: np.ndarray
) -> mujoco.MjModel:
    """Let MuJoCo read the robot's URDF, without what is not dynamics."""
    root = ElementTree.fromstring(robot.urdf)
    for link in root.iter('link'):
        for element in [e for e in link if e.tag != 'inertial']:
            link.remove(element)
    for joint in root.findall('joint'):
        if joint.get('name') not in robot.joints:
            joint.set('type', 'fixed')
        elif joint.get('type') == 'revolute':
            joint.set('type', 'continuous')
        for element in [e for e in joint if e.tag not in ('origin', 'parent', 'child', 'axis')]:
            joint.remove(element)
    for element in [e for e in root if e.tag not in ('link', 'joint')]:
        root.remove(element)
    compiler = ElementTree.SubElement(root, 'mujoco')
    ElementTree.SubElement(compiler, 'compiler', fusestatic='true', balanceinertia='false')
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding='unicode'))
    assert [model.joint(j).name for j in range(model.njnt)] == list(robot.joints)
    model.opt.timestep = DT / SUBSTEPS
    model.opt.gravity[:] = robot.gravity
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.tolerance = 1e-14
    model.dof_damping[:] = damping
    model.dof_frictionloss[:] = friction
    model.dof_armature[:] = armature
    model.dof_solref[:] = [2.0 * model.opt.timestep, 1.0]  # as stiff as it can be
    model.dof_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    return model


@pytest.fixture(scope='module', params=['humanoid_arm', 'ur10_robot.urdf', 'panda.urdf'])
def case(request, example_robot) -> tuple[mujoco.MjModel, Controller, SimulatedRun]:
    """Move a robot with friction and rotors by springs and dampers for 2 s."""
    shipped = request.param == 'humanoid_arm'
    robot = load_robot(request.param if shipped else example_robot(request.param))
    n = robot.n_joints
    drive = np.where(np.isfinite(robot.torque_limit), robot.torque_limit, 50.0)
    damping, friction = 0.02 * drive, 0.03 * drive
    armature = np.linspace(0.5, 0.05, n) * (0.02 if shipped else 1.0)
    arm = ArmModel(robot)
    arm = arm.with_effect(make_effect('viscous_friction', robot), damping)
    arm = arm.with_effect(make_effect('coulomb_friction', robot), friction)
    arm = arm.with_effect(make_effect('rotor_inertia', robot), armature)
    middle = np.where(np.isfinite(robot.lower), (robot.lower + robot.upper) / 2, 0.0)
    t = np.linspace(0.0, 2.0, 201)[:, np.newaxis]
    w = 2.0 * np.pi * np.linspace(0.5, 1.0, n)
    reference = Reference(
        robot.joints,
        t[:, 0],
        middle + 0.15 * (1.0 - np.cos(w * t)),
        0.15 * w * np.sin(w * t),
        0.15 * w**2 * np.cos(w * t),
    )
    controller = gravity_pd(ArmModel(robot))
    run = simulate(
        Plant(arm, DT, hard_stops=False),
        reference,
        rng=np.random.default_rng(0),
        controller=controller,
    )
    return mujoco_model(robot, damping, friction, armature), controller, run


def test_the_same_controller_moves_both_alike(case) -> None:
    model, controller, run = case
    limit = controller.feedback.robot.torque_limit
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.truth.q[0], run.truth.dq[0]
    error = 0.0
    wanted = run.reference
    for k in range(len(run.t)):
        error = max(error, np.abs(data.qpos - run.truth.q[k]).max())
        desired = wanted.q[k], wanted.dq[k], wanted.ddq[k]
        torque = controller.torque(data.qpos, data.qvel, desired, np.zeros(model.nv))
        data.qfrc_applied[:] = np.clip(torque, -limit, limit)
        mujoco.mj_step(model, data, SUBSTEPS)
    stuck = np.mean(run.truth.dq == 0.0, axis=0)
    assert np.ptp(run.truth.q, axis=0).max() > 0.25
    assert stuck.max() > 0.05
    assert error < 1e-4


def test_the_torque_of_one_moves_the_other_alike(case) -> None:
    """
    Open loop, so that nothing pulls the two together again.

    What is recorded is the mean of neighbouring steps, u_k-1 and u_k; the steps' own torques
    follow from the first.

    """
    model, _, run = case
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.truth.q[0], run.truth.dq[0]
    torque = run.truth.tau[0]
    for k in range(1000):
        data.qfrc_applied[:] = torque
        mujoco.mj_step(model, data, SUBSTEPS)
        torque = 2.0 * run.truth.tau[k + 1] - torque
    travel = np.ptp(run.truth.q[:1001], axis=0)
    error = np.abs(data.qpos - run.truth.q[1000])
    assert np.all(error < 0.005 * np.maximum(travel, 0.1))
