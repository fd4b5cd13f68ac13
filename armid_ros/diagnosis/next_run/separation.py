# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The separation of a named effect from a rival by a motion.

    D_T = min over the rival's values of |f_A - f_B|^2 / sigma^2

with f_A the torque of the patched model and f_B that of the model with the rival, fitted jointly
with the nuisance parameters. The square root is the number of standard deviations between the two.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.verdict.finding import Diagnosis
from armid_ros.effects import Effect
from armid_ros.excitation import FourierTrajectory
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

#: Standard deviations below which a run does not separate two effects.
NOTHING = 1.0
#: Rate at which a motion is evaluated [Hz]; the noise is scaled from the rate of rows.
_RATE = 50.0
#: Number of recorded periods.
_PERIODS = 2
#: A joint slower than this share of its top speed is not informative: dry friction is arbitrary.
_SLOW = 0.02
#: Largest torque of a known payload, as a share of the usable torque of a joint. The usable
#: torque is its limit, or twice its largest torque in the motion if smaller.
_LOAD = 0.15
#: Distance below which a frame is at the last joint [m].
_NEAR = 0.01
#: Singular values of columns below this share of the largest are zero.
_DEPENDENT = 1e-7


@dataclass(frozen=True)
class Doubt:
    """
    A named effect and a rival.

    Attributes
    ----------
    named : NamedEffect
        The named effect, as fitted.
    rival : Effect
        The rival.

    """

    named: NamedEffect
    rival: Effect

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the joints of both effects; empty if one effect acts on the whole arm."""
        if not self.named.effect.joints or not self.rival.joints:
            return ()
        return tuple(dict.fromkeys((*self.named.effect.joints, *self.rival.joints)))


@dataclass(frozen=True)
class Separation:
    """
    Predicted separation of a named effect from a rival by a motion.

    Attributes
    ----------
    name, rival : str
        Names of the two effects.
    power : float
        Squared separation D_T of the run [-].

    """

    name: str
    rival: str
    power: float

    @property
    def z(self) -> float:
        """Return the z-score of the difference."""
        return float(np.sqrt(self.power))

    @property
    def distinct(self) -> bool:
        """Whether the run separates the two effects."""
        return self.z >= NOTHING

    @staticmethod
    def of(
        diagnosis: Diagnosis, doubt: Doubt, trajectory: FourierTrajectory, load: Load | None = None
    ) -> Separation:
        """
        Predict the separation of two effects by a run.

        Parameters
        ----------
        diagnosis : Diagnosis
            Diagnosis with the arm, its nuisance parameters, and the unit of its gap.
        doubt : Doubt
            The two effects.
        trajectory : FourierTrajectory
            The motion; two periods of it are recorded.
        load : Load, optional
            Load that the arm carries in a second run.

        """
        motion = trajectory.motion(np.arange(_PERIODS * trajectory.period * _RATE) / _RATE)
        arms = [diagnosis.arm]
        if load is not None:
            arms.append(load.on(diagnosis.arm))
        weight = _weight(diagnosis, motion)
        named = doubt.named.effect
        target = _stack([a.columns_of(named, motion) for a in arms], weight)
        target = target @ diagnosis.arm.values_of(named)
        free = _stack([_free(diagnosis, a, named, motion) for a in arms], weight)
        basis = basis_of(free)
        rest = target - basis @ (basis.T @ target)
        columns = _stack([a.columns_of(doubt.rival, motion) for a in arms], weight)
        remainder = columns - basis @ (basis.T @ columns)
        scale = np.linalg.norm(columns, axis=0)
        visible = np.linalg.norm(remainder, axis=0) > 1e-6 * np.maximum(scale, 1e-300)
        own = basis_of(remainder[:, visible])
        power = float(np.sum((rest - own @ (own.T @ rest)) ** 2))
        return Separation(named.said_as, doubt.rival.said_as, power)


@dataclass(frozen=True)
class Load:
    """
    Known mass for a second run of the same motion.

    Attributes
    ----------
    mass : float
        Mass of the load [kg].
    frame : str
        Frame of the last link that is farthest from the last joint; the load is fixed there.

    """

    mass: float
    frame: str

    @staticmethod
    def along(arm: ArmModel, trajectory: FourierTrajectory) -> Load:
        """Return a load whose torque is at most `_LOAD` of the usable torque of each joint."""
        motion = trajectory.one_period(int(trajectory.period * _RATE))
        frame = _tip(arm.robot)
        columns = arm.rigid_columns(motion)[:, :, _carrier(arm.robot)]
        unit = np.abs(columns @ _point(arm.robot, frame)).max(axis=0)
        able = np.minimum(arm.robot.torque_limit, 2.0 * np.abs(arm.joint_torque(motion)).max(0))
        felt = unit > 1e-3 * unit.max()
        mass = float(np.min(_LOAD * able[felt] / unit[felt]))
        digit = 10.0 ** np.floor(np.log10(max(mass, 1e-3)))
        return Load(float(np.floor(mass / digit) * digit), frame)

    def on(self, arm: ArmModel) -> ArmModel:
        """Return the arm with the load."""
        parameters = arm.robot.rigid_parameters.copy()
        parameters[_carrier(arm.robot)] += self.mass * _point(arm.robot, self.frame)
        return replace(arm, robot=arm.robot.with_inertias(parameters))


def _carrier(robot: Robot) -> slice:
    """Return the indices of the parameters of the last link."""
    last = robot.moving.index(robot.tip)
    return slice(10 * last, 10 * last + 10)


def _tip(robot: Robot) -> str:
    """Return the frame of the last link that is farthest from the last joint."""
    last = robot.model.getJointId(robot.tip)
    frames = [f for f in robot.model.frames if f.parentJoint == last]
    return str(max(frames, key=lambda f: float(np.linalg.norm(f.placement.translation))).name)


def _point(robot: Robot, frame: str) -> FloatArray:
    """Return the parameters of 1 kg at a frame, or at the centre of mass if it is at the joint."""
    place = robot.model.frames[robot.model.getFrameId(frame)].placement.translation
    if np.linalg.norm(place) < _NEAR:
        place = robot.model.inertias[robot.model.getJointId(robot.tip)].lever
    body = pin.Inertia(1.0, place, np.zeros((3, 3)))
    return np.array(body.toDynamicParameters())


def _weight(diagnosis: Diagnosis, motion: Motion) -> FloatArray:
    """
    Return the weight of each sample: sqrt(rows per sample) / sigma, shape (N, n).

    The noise is white over rows: a higher rate of samples adds no information. The unit of the
    gap is assumed to be the same in the next run.

    """
    assert diagnosis.explanation is not None
    used = diagnosis.data[0].used
    rows = used.rate_hz / used.decimation / _RATE
    sigma = np.sqrt(np.mean([unit**2 for unit in diagnosis.explanation.evidence.sigma], axis=0))
    return informative_weight(motion, rows, sigma)


def informative_weight(motion: Motion, rows: float, sigma: FloatArray) -> FloatArray:
    """Return sqrt(rows per sample) / sigma where a joint moves, and zero elsewhere, (N, n)."""
    moving = np.abs(motion.dq) > _SLOW * np.abs(motion.dq).max(axis=0)
    return np.asarray(np.where(moving, np.sqrt(rows) / sigma, 0.0))


def _stack(columns: list[FloatArray], weight: FloatArray) -> FloatArray:
    """Return weighted and stacked columns (N, n, p) of one or two runs, shape (rows, p)."""
    blocks = [block * weight[:, :, np.newaxis] for block in columns]
    return np.concatenate(
        [block.reshape(block.shape[0] * block.shape[1], block.shape[2]) for block in blocks]
    )


def _free(diagnosis: Diagnosis, arm: ArmModel, named: Effect, motion: Motion) -> FloatArray:
    """Return the nuisance columns, fitted with either of two effects, shape (N, n, f)."""
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
    """Return an orthonormal basis of columns (R, p), which are scaled to equal length first."""
    length = np.linalg.norm(columns, axis=0)
    columns = columns[:, length > 0.0] / length[length > 0.0]
    if not columns.shape[1]:
        return columns
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(basis[:, size > _DEPENDENT * size[0]])
