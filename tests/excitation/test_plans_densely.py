# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A plan keeps limits, floor and clearance at 1 kHz, by code of its own."""

from armid_ros.arm import ArmModel
from armid_ros.excitation import (
    ClearanceModel,
    CollisionScene,
    design,
    DesignSettings,
    plan_run,
    transfer_limits,
    TransferPlanner,
)
from armid_ros.robots import load_robot
import coal
import numpy as np
import pinocchio as pin
import pytest

ARMS = (
    'ur3_robot', 'ur5_robot', 'ur10_robot', 'ur3_joint_limited_robot', 'ur5_joint_limited_robot',
    'ur10_joint_limited_robot', 'panda', 'z1', 'xarm7', 'so100', 'ur5_gripper', 'talos_left_arm',
)  # fmt: skip
#: Height at which the floor itself is, without the clearance that plans keep [m]: that of the
#: base, but for an arm that hangs from a torso.
FLOORS = dict.fromkeys(ARMS, 0.0) | {'talos_left_arm': -1.1}


def planned(path):
    robot = load_robot(path)
    floor = FLOORS[path.stem]
    arm, scene = ArmModel(robot), CollisionScene.of(robot, 0.01, str(floor) if floor else None)
    settings = DesignSettings(
        period=4.0, harmonics=3, n_periods=1, run_in=1.0, speed='fast', starts=1,
        iterations=2, time_budget=60.0,
    )  # fmt: skip
    found = design(arm, settings, np.random.default_rng(0), collision=scene.bodies)
    clearance = ClearanceModel.of(scene.bodies, scene.clearance)
    planner = TransferPlanner(arm, transfer_limits(robot), clearance)
    start = planner.free_start()
    return robot, plan_run(found.excitation, planner, start, 100.0)


def geometry(path, model, driven):
    """Return the meshes with all pairs that do not touch by construction, and the floor."""
    roots = [str(parent) for parent in path.parents]
    bodies = pin.buildGeomFromUrdf(
        model, str(path), pin.GeometryType.COLLISION, package_dirs=roots
    )
    bodies.addAllCollisionPairs()
    excluded = path.parents[1] / 'srdf' / f'{path.stem}.srdf'  # by the vendor, as they never meet
    if excluded.is_file():
        pin.removeCollisionPairs(model, bodies, str(excluded))
    still = bodies.createData()
    pin.computeCollisions(model, model.createData(), bodies, still, pin.neutral(model), False)
    touching = [k for k, result in enumerate(still.collisionResults) if result.isCollision()]
    for pair in [bodies.collisionPairs[k].copy() for k in touching]:
        bodies.removeCollisionPair(pair)
    for pair in [p.copy() for p in bodies.collisionPairs]:
        one, other = (
            int(bodies.geometryObjects[k].parentJoint) for k in (pair.first, pair.second)
        )
        if one == other or int(model.parents[max(one, other)]) == min(one, other):
            bodies.removeCollisionPair(pair)
    half = coal.Halfspace(np.array([0.0, 0.0, 1.0]), FLOORS[path.stem])
    floor = bodies.addGeometryObject(pin.GeometryObject('floor', 0, 0, pin.SE3.Identity(), half))
    first = model.getJointId(driven[0])
    for k, body in enumerate(bodies.geometryObjects):
        if int(body.parentJoint) > first:
            bodies.addCollisionPair(pin.CollisionPair(k, floor))
    return bodies


def violations(path, robot, run):
    """Return what the run does that the URDF forbids."""
    model = pin.buildModelFromUrdf(str(path))
    if model.nq != model.nv:
        pytest.skip('continuous joints have another state in Pinocchio')
    driven = [model.joints[model.getJointId(name)].idx_v for name in robot.joints]
    motion = run.at(np.arange(0.0, run.duration, 1e-3))
    q, dq, ddq = (np.zeros((len(motion.t), model.nv)) for _ in range(3))
    q += pin.neutral(model)
    q[:, driven], dq[:, driven], ddq[:, driven] = motion.q, motion.dq, motion.ddq
    lower, upper, fastest, strongest = (
        limit[driven]
        for limit in (
            model.lowerPositionLimit,
            model.upperPositionLimit,
            model.velocityLimit,
            model.effortLimit,
        )
    )
    found = []
    if np.any(motion.q < lower) or np.any(motion.q > upper):
        found.append('position')
    if np.any(np.abs(np.diff(motion.q, axis=0)) > 1e-3 * fastest):
        found.append('velocity')
    if np.any(np.abs(np.diff(motion.q, 2, axis=0)) > 1.01e-6 * fastest / 0.25):
        found.append('acceleration')
    data, bodies = model.createData(), geometry(path, model, robot.joints)
    near = bodies.createData()
    for state in zip(q, dq, ddq, strict=True):
        if np.any(np.abs(pin.rnea(model, data, *state))[driven] > strongest):
            found.append('torque')
        if pin.computeCollisions(model, data, bodies, near, state[0], True):
            found.append('collision')
    return found


@pytest.mark.long
@pytest.mark.parametrize('name', ARMS)
def test_a_plan_keeps_everything_at_a_kilohertz(name, example_robot):
    path = example_robot(f'{name}.urdf')
    robot, run = planned(path)
    assert violations(path, robot, run) == []
