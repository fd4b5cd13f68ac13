# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torques, regressors and derivatives of a rigid-body arm along motions.

Only this module loops over samples, since Pinocchio's algorithms take one configuration at a
time. The compiled kernel, if there is one, computes torques and regressors. All quantities are
linear in the gravity vector and in the inertial parameters of the robot.

"""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

from armid_ros.estimate import ParameterName
from armid_ros.model.compiled import BodyOfKernel, kernel_body
from armid_ros.motion import FloatArray, Motion, Temperatures
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Inertial parameters of one link in Pinocchio's order: mass, first moments, inertia about the
#: origin of the joint frame.
LINK_PARAMETERS = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
LINK_UNITS = ('kg', 'kg m', 'kg m', 'kg m') + ('kg m^2',) * 6
_BODIES: WeakKeyDictionary[Robot, BodyOfKernel | None] = WeakKeyDictionary()


def rigid_parameter_names(robot: Robot) -> tuple[ParameterName, ...]:
    """
    Return names and units of the ten inertial parameters of each of the m moving bodies.

    Returns
    -------
    tuple of ParameterName, length 10 m
        Names such as 'm1', 'mx1', ... 'Izz1', 'm2', numbered by moving joint from 1.

    """
    return tuple(
        ParameterName(f'{name}{number}', joint, unit)
        for number, joint in enumerate(robot.moving, start=1)
        for name, unit in zip(LINK_PARAMETERS, LINK_UNITS, strict=True)
    )


def link_unit(name: str) -> str:
    """Return the unit of an inertial parameter such as 'mx2'; empty for other names."""
    return dict(zip(LINK_PARAMETERS, LINK_UNITS, strict=True)).get(name.rstrip('0123456789'), '')


def _body_of(robot: Robot) -> BodyOfKernel | None:
    """Return a robot in the format of the compiled kernel; None if there is no kernel."""
    if robot not in _BODIES:
        _BODIES[robot] = kernel_body(robot)
    return _BODIES[robot]


def inverse_dynamics(robot: Robot, motion: Motion) -> FloatArray:
    """
    Compute rigid-body joint torques along a motion by recursive Newton-Euler.

    Returns
    -------
    ndarray, shape (N, n)
        Torque [N m] or force [N].

    """
    if robot.mechanism is not None:
        motion, jacobian = robot.mechanism.along(motion)
        return _projected(jacobian, inverse_dynamics(robot.tree, motion))
    tau = np.empty((len(motion), robot.n_joints))
    body = _body_of(robot)
    if body is not None:
        body.along(motion, 'torques', tau)
        return tau
    model, data = robot.model, robot.model.createData()
    for k, (q, dq, ddq) in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        tau[k] = pin.rnea(model, data, q, dq, ddq)
    return tau


def inverse_dynamics_derivatives(
    robot: Robot, motion: Motion
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Differentiate rigid-body joint torques by position, velocity and acceleration.

    Returns
    -------
    by_q, by_dq, by_ddq : ndarray, shape (N, n, n)
        dtau/dq [N m/rad], dtau/d(dq) [N m s/rad], and the inertia matrix [kg m^2].

    Notes
    -----
    Source: Carpentier and Mansard 2018; Pinocchio's computeRNEADerivatives. It divides by sums of
    link masses, so it needs positive masses. If a fit has a negative mass, a ballast is added to
    all links, and the derivatives of the ballast alone are subtracted: they are linear. With
    coupled joints, the derivatives are projected; with loops, those by position and velocity are
    central differences.

    """
    if robot.mechanism is not None:
        moved, jacobian = robot.mechanism.along(motion)
        own = [
            _projected(jacobian, x) @ jacobian
            for x in inverse_dynamics_derivatives(robot.tree, moved)
        ]
        if robot.mechanism.constant:
            return own[0], own[1], own[2]
        return _difference(robot, motion, 'q'), _difference(robot, motion, 'dq'), own[2]
    lightest = float(np.min(robot.rigid_parameters[:: len(LINK_PARAMETERS)]))
    if lightest < 0.0:
        ballast = np.zeros_like(robot.rigid_parameters)
        ballast[:: len(LINK_PARAMETERS)] = 1.0 - lightest
        heavier = robot.with_inertias(robot.rigid_parameters + ballast)
        pairs = zip(
            inverse_dynamics_derivatives(heavier, motion),
            inverse_dynamics_derivatives(robot.with_inertias(ballast), motion),
            strict=True,
        )
        by_q, by_dq, by_ddq = (whole - added for whole, added in pairs)
        return by_q, by_dq, by_ddq
    model, data = robot.model, robot.model.createData()
    n = robot.n_joints
    by_q, by_dq, by_ddq = np.empty((3, len(motion), n, n))
    for k, (q, dq, ddq) in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        by_q[k], by_dq[k], by_ddq[k] = pin.computeRNEADerivatives(model, data, q, dq, ddq)
    return by_q, by_dq, by_ddq


def _projected(jacobian: FloatArray, torques: FloatArray) -> FloatArray:
    """Convert torques (N, m, ...) of moving joints to torques of driven joints by J^T."""
    return np.asarray(np.einsum('kmn,km...->kn...', jacobian, torques))


def _difference(robot: Robot, motion: Motion, name: str) -> FloatArray:
    """Differentiate joint torques by `name`, 'q' or 'dq', with central differences, (N, n, n)."""
    step = 1e-5
    slopes = []
    for shift in step * np.eye(robot.n_joints):
        ends = [
            inverse_dynamics(
                robot, replace(motion, **{name: getattr(motion, name) + sign * shift})
            )
            for sign in (1.0, -1.0)
        ]
        slopes.append((ends[0] - ends[1]) / (2.0 * step))
    return np.stack(slopes, axis=2)


def regressor(robot: Robot, motion: Motion) -> FloatArray:
    """
    Compute the regressor Y, with tau = Y pi, in each sample of a motion.

    Parameters
    ----------
    robot : Robot
        Arm with axes, lengths and gravity; its inertial parameters are not used.
    motion : Motion
        N samples of the n joints.

    Returns
    -------
    ndarray, shape (N, n, 10 m)
        Y of each sample, with driven joints as rows and ``rigid_parameter_names`` as columns.

    Notes
    -----
    Source: Atkeson, An and Hollerbach 1986; Pinocchio's computeJointTorqueRegressor.

    Examples
    --------
    >>> import armid_ros as ar
    >>> robot = ar.load_robot('my_arm.urdf')
    >>> motion = ar.design_excitation(robot, duration=6.0, starts=1, iterations=1).motion(100.0)
    >>> y = ar.regressor(robot, motion)
    >>> y.shape == (len(motion), 3, 30)
    True
    >>> tau = y @ robot.rigid_parameters  # [N m]

    """
    if robot.mechanism is not None:
        motion, jacobian = robot.mechanism.along(motion)
        return _projected(jacobian, regressor(robot.tree, motion))
    n = robot.n_joints
    y = np.zeros((len(motion), n, len(LINK_PARAMETERS) * n))
    body = _body_of(robot)
    if body is not None:
        body.along(motion, 'regressors', y)
        return y
    model, data = robot.model, robot.model.createData()
    for k, (q, dq, ddq) in enumerate(zip(motion.q, motion.dq, motion.ddq, strict=True)):
        y[k] = pin.computeJointTorqueRegressor(model, data, q, dq, ddq)
    return y


def regressor_slopes(robot: Robot, motion: Motion, weights: FloatArray) -> FloatArray | None:
    """
    Differentiate sum(weights * regressor) of each sample by q, dq and ddq, shape (3, N, n).

    The weights have the shape of the regressor. The result is None for a robot with a mechanism,
    and without the compiled kernel.

    """
    body = None if robot.mechanism is not None else _body_of(robot)
    if body is None:
        return None
    slopes = np.empty((3, *motion.q.shape))
    body.along(motion, 'regressor_slopes', weights, slopes)
    return slopes


def gravity_sensitivity(robot: Robot, q: FloatArray) -> FloatArray:
    """
    Differentiate joint torques by the components of the gravity vector.

    Parameters
    ----------
    robot : Robot
        The arm.
    q : ndarray, shape (N, n)
        Joint positions.

    Returns
    -------
    ndarray, shape (N, n, 3)
        Derivatives dtau/dg [N m per m/s^2], with g in the base frame.

    """
    if robot.mechanism is not None:
        positions, jacobian, _ = robot.mechanism.states(q)
        return _projected(jacobian, gravity_sensitivity(robot.tree, positions))
    columns = np.empty((len(q), robot.n_joints, 3))
    for axis, unit_gravity in enumerate(np.eye(3)):
        model = robot.with_gravity(unit_gravity).model
        data = model.createData()
        for k, position in enumerate(q):
            columns[k, :, axis] = pin.computeGeneralizedGravity(model, data, position)
    return columns


def random_motion(robot: Robot, rng: np.random.Generator, n_samples: int | None = None) -> Motion:
    """
    Draw random joint states in which all base parameters of the robot are identifiable.

    Positions are uniform within the limits (one turn without limits), velocities and accelerations
    are normal with a standard deviation of 1 rad/s and 1 rad/s^2 (or m). Temperatures rise from
    state to state. The default number of states identifies all base parameters.

    """
    n = robot.n_joints
    if n_samples is None:
        # enough for any number of joints, as each state has a row for every joint
        n_samples = min(40 * n, 560)
    ends = np.array([0.0, n_samples])
    return Motion(
        joints=robot.joints,
        t=np.arange(n_samples, dtype=float),
        q=rng.uniform(*robot.position_range(), (n_samples, n)),
        dq=rng.normal(size=(n_samples, n)),
        ddq=rng.normal(size=(n_samples, n)),
        temperature=Temperatures(ends, np.tile([[20.0], [60.0]], n)),
    )
