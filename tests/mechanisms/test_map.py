# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The map from driven to moving joints: derivatives, closed loops, limits, refusals."""

from dataclasses import replace

from armid_ros.errors import RobotError
from armid_ros.excitation import ClearanceModel
from armid_ros.model import inverse_dynamics, inverse_dynamics_derivatives, regressor
from armid_ros.model.kinematics import points_motion
from armid_ros.model.rigid_body import gravity_sensitivity, random_motion
from armid_ros.robots import collision_model, load_robot
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tests.mechanisms.machines import load, MACHINES

STEP = 1e-5


@pytest.fixture(scope='module')
def motion(robot):
    return random_motion(robot, np.random.default_rng(0), 20)


def difference(function, motion, name):
    """Differentiate a function of a motion by the positions or velocities, last axis."""
    ends = [
        [
            function(replace(motion, **{name: getattr(motion, name) + sign * STEP * unit}))
            for unit in np.eye(motion.n_joints)
        ]
        for sign in (1.0, -1.0)
    ]
    return np.stack([(a - b) / (2.0 * STEP) for a, b in zip(*ends, strict=True)], axis=-1)


def test_jacobian_and_drift_are_derivatives_of_the_positions(robot, motion):
    jacobian = robot.mechanism.along(motion)[1]
    found = difference(lambda one: robot.positions(one.q), motion, 'q')
    np.testing.assert_allclose(found, jacobian, atol=1e-7)
    ahead, behind = (
        robot.mechanism.along(replace(motion, q=motion.q + step * motion.dq))[1]
        for step in (STEP, -STEP)
    )
    drift = np.einsum('kmn,kn->km', (ahead - behind) / (2.0 * STEP), motion.dq)
    states = robot.mechanism.states(motion.q, motion.dq)
    np.testing.assert_allclose(states.drift, drift, atol=1e-6)


def test_mujoco_finds_no_violated_equality_at_the_positions(name, robot, motion):
    model = mujoco.MjModel.from_xml_string(MACHINES[name])
    data = mujoco.MjData(model)
    places = [int(model.jnt_qposadr[model.joint(joint).id]) for joint in robot.moving]
    for q in robot.positions(motion.q):
        data.qpos[places] = q
        mujoco.mj_forward(model, data)
        assert data.ne
        assert np.abs(data.efc_pos[: data.ne]).max() < 1e-9


def test_driven_joints_within_their_limits_keep_all_joints_within_theirs(robot):
    u = np.random.default_rng(1).uniform(*robot.position_range(), (500, robot.n_joints))
    q, jacobian, _ = robot.mechanism.states(u)
    assert np.all(q >= robot.tree.lower - 1e-9)
    assert np.all(q <= robot.tree.upper + 1e-9)
    assert np.all(np.abs(jacobian) <= robot.mechanism.largest + 1e-9)


def test_torques_do_the_work_of_all_moving_joints(robot, motion):
    moved, _ = robot.mechanism.along(motion)
    tau = inverse_dynamics(robot, motion)
    power = np.sum(inverse_dynamics(robot.tree, moved) * moved.dq, axis=1)
    np.testing.assert_allclose(np.sum(tau * motion.dq, axis=1), power, rtol=1e-9, atol=1e-9)
    y = regressor(robot, motion)
    np.testing.assert_allclose(y @ robot.rigid_parameters, tau, rtol=1e-8, atol=1e-8)
    still = inverse_dynamics(robot, motion.at_rest())
    weight = gravity_sensitivity(robot, motion.q) @ robot.gravity
    np.testing.assert_allclose(weight, still, rtol=1e-8, atol=1e-8)


def test_a_single_state_has_the_torque_and_inertia_of_the_motion(robot, motion):
    data = robot.model.createData()
    state = motion.q[3], motion.dq[3], motion.ddq[3]
    tau = inverse_dynamics(robot, motion)[3]
    np.testing.assert_allclose(robot.inverse_dynamics(data, *state), tau, rtol=1e-9)
    by_ddq = inverse_dynamics_derivatives(robot, motion)[2][3]
    np.testing.assert_allclose(robot.inertia(data, motion.q[3]), by_ddq, atol=1e-9)
    assert np.linalg.eigvalsh(by_ddq)[0] > 0.0


def test_derivatives_of_the_torque(robot, motion):
    by_q, by_dq, _ = inverse_dynamics_derivatives(robot, motion)
    for found, argument in ((by_q, 'q'), (by_dq, 'dq')):
        wanted = difference(lambda one: inverse_dynamics(robot, one), motion, argument)
        np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-4)


def test_points_of_links_move_as_pinocchio_says(robot, motion):
    joint = robot.tip
    offset = np.array([[0.1, 0.2, 0.3]])
    positions, jacobians = points_motion(robot, (joint,), offset, motion.q)
    model, data = robot.model, robot.model.createData()
    for q, position in zip(robot.positions(motion.q), positions, strict=True):
        pin.forwardKinematics(model, data, q)
        np.testing.assert_allclose(data.oMi[model.getJointId(joint)].act(offset[0]), position[0])
    slope = difference(lambda one: points_motion(robot, (joint,), offset, one.q)[0], motion, 'q')
    np.testing.assert_allclose(jacobians, slope, atol=1e-6)


ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
</link><link name="lower"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial>{shape}</link>
<joint name="one" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="2"/></joint>
<joint name="two" type="revolute"><origin xyz="0.4 0 0"/><parent link="upper"/>
<child link="lower"/><axis xyz="0 1 0"/><limit lower="-0.5" upper="1" effort="9" velocity="3"/>
{inside}</joint>{more}</robot>"""


def arm(inside='', more='', shape=''):
    return load_robot(ARM.format(inside=inside, more=more, shape=shape))


def test_a_leader_is_limited_by_the_joints_that_follow_it():
    coupled = arm('<mimic joint="one" multiplier="-2" offset="0.2"/>', WRIST.replace('two', 'one'))
    assert coupled.joints == ('one', 'hand')
    np.testing.assert_allclose([coupled.lower[0], coupled.upper[0]], [-0.4, 0.35])
    np.testing.assert_allclose(coupled.velocity_limit[0], 1.5)


WRIST = """<link name="hand"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/>
</inertial></link><joint name="hand" type="continuous"><parent link="lower"/><child link="hand"/>
<axis xyz="1 0 0"/></joint>"""


def test_motors_without_a_body_drive_a_differential(tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_text(ARM.format(inside='', more='', shape=''))
    (tmp_path / 'arm.mechanism.yaml').write_text(
        'motors: {a: {effort: 3, velocity: 4}, b: {}}\n'
        'mimic: {one: {a: 0.5, b: 0.5}, two: {a: 0.5, b: -0.5, offset: 0.1}}\n'
    )
    coupled = load_robot(path)
    plain = arm()
    assert coupled.joints == ('a', 'b')
    assert coupled.moving == ('one', 'two')
    motion = random_motion(coupled, np.random.default_rng(0), 10)
    matrix = np.array([[0.5, 0.5], [0.5, -0.5]])
    moved = replace(
        motion,
        joints=plain.joints,
        q=motion.q @ matrix.T + [0.0, 0.1],
        dq=motion.dq @ matrix.T,
        ddq=motion.ddq @ matrix.T,
    )
    wanted = inverse_dynamics(plain, moved) @ matrix
    np.testing.assert_allclose(inverse_dynamics(coupled, motion), wanted, rtol=1e-12)
    assert coupled.torque_limit.tolist() == [3.0, np.inf]


def test_clearance_is_proven_with_the_speed_of_the_followers():
    ball = (
        '<collision><origin xyz="{} 0 0"/><geometry><sphere radius="0.05"/></geometry></collision>'
    )
    base = ARM.replace('<link name="base"/>', f'<link name="base">{ball.format(-0.3)}</link>')
    text = base.format(
        inside='<mimic joint="one" multiplier="1.5"/>', more=WRIST, shape=ball.format(0.2)
    )
    coupled = load_robot(text)
    model = ClearanceModel.of(collision_model(coupled))
    q = np.random.default_rng(0).uniform(*coupled.position_range(), (5, 2))
    near = model.near(q, 10.0)
    for k, step in enumerate(STEP * np.eye(2)):
        ends = [model.near(q + sign * step, 10.0).distance for sign in (1.0, -1.0)]
        np.testing.assert_allclose((ends[0] - ends[1]) / (2.0 * STEP), near.by_q[:, k], atol=1e-6)
    assert np.all(np.abs(near.by_q) <= model.levers[near.pair] + 1e-9)


LOOP = '<loop passive="two"><point link="lower" xyz="{}"/><point link="base" xyz="{}"/></loop>'


@pytest.mark.parametrize(
    ('inside', 'more', 'message'),
    [
        ('', LOOP.format('0.3 0 0', '9 0 0'), 'does not close'),
        ('', LOOP.format('0.3 0 0', '0.7 0 0').replace('base', 'bsae'), "'bsae' is not among"),
        ('', '<loop passive="two"/>', 'two points'),
        ('', '<mimic follower="tow" joint="one"/>', "'tow', which does not exist"),
        ('<mimic joint="one" offset="3"/>', WRIST, 'leave no range'),
    ],
)
def test_couplings_that_cannot_be(inside, more, message):
    with pytest.raises(RobotError, match=message):
        arm(inside, more)


def test_a_passive_joint_cannot_be_driven_and_a_faulty_file_of_coupled_joints_is_named(tmp_path):
    text = load('palletiser', tmp_path).urdf
    with pytest.raises(RobotError, match="'elbow' is a passive joint"):
        load_robot(text, joints=['j1', 'elbow'])
    path = tmp_path / 'arm.urdf'
    path.write_text(ARM.format(inside='', more='', shape=''))
    for text in ('loop: []', 'loops: [{passive: [two]}]', 'mimic: [two]'):
        (tmp_path / 'arm.mechanism.yaml').write_text(text)
        with pytest.raises(RobotError, match=r'arm\.mechanism\.yaml: '):
            load_robot(path)
