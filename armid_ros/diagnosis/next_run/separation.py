# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Predicted separation of a named effect from a rival by a motion, as a z-score.

    z^2 = min over the rival's values of |f_A - f_B|^2 / sigma^2

where f_A is the torque of the patched model, and f_B that of the model with the rival, fitted
jointly with the nuisance parameters.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.verdict.finding import Diagnosis
from armid_ros.effects import Effect
from armid_ros.excitation import FourierTrajectory
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin
from scipy import linalg

#: Rate at which a motion is evaluated [Hz]; the noise is scaled from the rate of rows.
_RATE = 50.0
#: Largest torque of a known payload, as a share of the usable torque of a joint. The usable
#: torque is its limit, or twice its largest torque in the motion if smaller.
_MAX_TORQUE_SHARE = 0.15


@dataclass(frozen=True)
class Load:
    """
    Known mass that is mounted on the last link when a motion is repeated.

    Attributes
    ----------
    mass : float
        Mass of the load [kg].
    frame : str
        Frame at which it is fixed: that of the last link farthest from the last joint.

    """

    mass: float
    frame: str

    @staticmethod
    def along(arm: ArmModel, trajectory: FourierTrajectory) -> Load:
        """Return the largest payload that the motors can carry along a motion, rounded down."""
        robot = arm.robot
        motion = trajectory.one_period(int(trajectory.period * _RATE))
        last = robot.model.getJointId(robot.tip)
        frames = [f for f in robot.model.frames if f.parentJoint == last]
        frame = max(frames, key=lambda f: float(np.linalg.norm(f.placement.translation))).name
        columns = arm.rigid_columns(motion)[:, :, _of_last_link(robot)]
        unit = np.abs(columns @ _point_mass(robot, frame)).max(axis=0)
        usable = np.minimum(robot.torque_limit, 2.0 * np.abs(arm.joint_torque(motion)).max(0))
        bearing = unit > 1e-3 * unit.max()
        mass = float(np.min(_MAX_TORQUE_SHARE * usable[bearing] / unit[bearing]))
        digit = 10.0 ** np.floor(np.log10(max(mass, 1e-3)))
        return Load(float(np.floor(mass / digit) * digit), str(frame))

    def on(self, arm: ArmModel) -> ArmModel:
        """Return the arm whose last link carries the load."""
        parameters = arm.robot.rigid_parameters.copy()
        parameters[_of_last_link(arm.robot)] += self.mass * _point_mass(arm.robot, self.frame)
        return replace(arm, robot=arm.robot.with_inertias(parameters))


def _of_last_link(robot: Robot) -> slice:
    """Return the slice of the last link's parameters among all inertial parameters."""
    last = robot.moving.index(robot.tip)
    return slice(10 * last, 10 * last + 10)


def _point_mass(robot: Robot, frame: str) -> FloatArray:
    """Return the inertial parameters of 1 kg at a frame of the last link, shape (10,)."""
    place = robot.model.frames[robot.model.getFrameId(frame)].placement.translation
    if np.linalg.norm(place) < 0.01:  # m: no lever arm
        place = robot.model.inertias[robot.model.getJointId(robot.tip)].lever
    return np.array(pin.Inertia(1.0, place, np.zeros((3, 3))).toDynamicParameters())


class Separation(NamedTuple):
    """Names of two effects, and the predicted z-score of the difference of their torques."""

    name: str
    rival: str
    z: float

    @property
    def distinct(self) -> bool:
        """Whether the motion separates the two effects by at least one standard deviation."""
        return self.z >= 1.0


def separation(
    diagnosis: Diagnosis,
    named: Effect,
    rival: Effect,
    trajectory: FourierTrajectory,
    load: Load | None = None,
) -> Separation:
    """
    Predict as a z-score how well a motion separates a named effect from a rival.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis with the patched arm, its nuisance parameters, and the floor of the gap.
    named, rival : Effect
        The two effects.
    trajectory : FourierTrajectory
        The motion; two periods of it are recorded.
    load : Load, optional
        Load that the arm carries in a second run.

    """
    assert diagnosis.explanation is not None
    motion = trajectory.motion(np.arange(2.0 * trajectory.period * _RATE) / _RATE)
    arms = [diagnosis.arm, *([] if load is None else [load.on(diagnosis.arm)])]
    used = diagnosis.data[0].used
    # the floor of the gap is assumed to be the same in the next run
    sigma = np.sqrt(np.mean(np.square(diagnosis.explanation.evidence.sigma), axis=0))
    weight = informative_weight(motion, used.rate_hz / used.decimation / _RATE, sigma)

    def stacked(columns: list[FloatArray]) -> FloatArray:
        weighted = np.concatenate(columns) * np.tile(weight, (len(arms), 1))[:, :, np.newaxis]
        return np.asarray(weighted.reshape(weighted.shape[0] * weighted.shape[1], -1))

    target = stacked([arm.columns_of(named, motion) for arm in arms])
    target = target @ diagnosis.arm.values_of(named)
    basis = basis_of(stacked([_nuisance_columns(diagnosis, arm, named, motion) for arm in arms]))
    residual = target - basis @ (basis.T @ target)
    columns = stacked([arm.columns_of(rival, motion) for arm in arms])
    remainder = columns - basis @ (basis.T @ columns)
    scale = np.linalg.norm(columns, axis=0)
    visible = np.linalg.norm(remainder, axis=0) > 1e-6 * np.maximum(scale, 1e-300)
    own = basis_of(remainder[:, visible])
    z = float(np.linalg.norm(residual - own @ (own.T @ residual)))
    return Separation(named.name, rival.name, z)


def informative_weight(motion: Motion, rows: float, sigma: FloatArray) -> FloatArray:
    """
    Return sample weights: sqrt(rows) / sigma where a joint moves, else zero, (N, n).

    The noise is white over rows: a higher rate of samples adds no information. Below 2 % of its
    top speed a joint is not informative, as its dry friction is arbitrary.

    """
    moving = np.abs(motion.dq) > 0.02 * np.abs(motion.dq).max(axis=0)
    return np.asarray(np.where(moving, np.sqrt(rows) / sigma, 0.0))


def _nuisance_columns(
    diagnosis: Diagnosis, arm: ArmModel, named: Effect, motion: Motion
) -> FloatArray:
    """Return the regressor columns of the nuisance parameters in a motion, shape (N, n, f)."""
    assert diagnosis.explanation is not None
    given = diagnosis.explanation.given
    known = zip(given.effects, given.values, strict=True)
    unknown = [effect for effect, values in known if not np.any(values)]
    found = [own.effect for own in diagnosis.explanation.fitted.named]
    effects = arm.effects if diagnosis.refitted else [*unknown, *found]
    blocks = [arm.columns_of(effect, motion) for effect in effects if effect != named]
    if diagnosis.refitted:
        blocks.append(arm.rigid_columns(motion))
    return np.concatenate([np.empty((*motion.q.shape, 0)), *blocks], axis=2)


def basis_of(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the column space, without directions of rounding errors."""
    length = np.linalg.norm(columns, axis=0)
    columns = columns[:, length > 0.0] / length[length > 0.0]
    return np.asarray(linalg.orth(columns, rcond=1e-7)) if columns.size else columns
