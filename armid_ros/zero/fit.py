# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torque zeros and gains, gravity, tool and dry friction from an arm at rest.

The reading of a joint is gain (weight + offset + friction against the approach), as an `ArmModel`
has it; weight is that of the described links and of a tool. The fit is generalised least squares
with a variance of each joint that is estimated from the residuals. Weak priors keep confounded
parameters finite. A quantity that the rests do not improve enough is not determined.

"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE
from armid_ros.effects.load import described_spread
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.zero.rests import count_poses
import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

#: What may be held known, and the effect that then is not fitted.
KNOWN = {'gain': 'torque_gain', 'tilt': 'base_tilt', 'tool': 'payload'}
#: Largest half of a 95 % interval of a determined quantity: of zeros and friction as a share of
#: the largest reading of the joint, of gravity [m/s^2], tilt [deg], mass as a share of that of the
#: arm, and centre [m].
_USEFUL = {
    **{'zero': 0.2, 'friction': 0.2, 'gain': 0.1, 'gravity': 0.4, 'tilt': 2.0, 'mass': 0.04},
    'center': 0.1,
}
#: Standard deviation of the prior of each parameter, ten times what is useful: a share of the
#: largest reading of the joint, the gain itself, [rad], [m/s^2], a share of the mass of the arm.
_PRIORS = {
    **{'torque_offset': 1.0, 'coulomb_torque': 1.0, 'gain_error': 0.5, 'tilt_x': 0.3},
    **{'tilt_y': 0.3, 'gravity_difference': 2.0, 'payload_m': 0.3},
    **dict.fromkeys(('payload_mx', 'payload_my', 'payload_mz'), 0.1),
}
#: Effects whose parameters are shares of the largest reading of their joint, or of the mass.
_SCALED = ('torque_offset', 'coulomb_friction', 'payload')
#: Poses below which most quantities are not determined.
_FEW = 5
#: Residual of a reading that is left out, over the standard deviation of its joint.
_OUTLYING = 4.5
#: What determines most quantities.
MORE = 'record a run of armid zero plan'


@dataclass(frozen=True)
class Quantity:
    """
    A fitted quantity.

    Attributes
    ----------
    name, joint, unit : str
        Name, joint (empty for the whole arm) and unit.
    value, reach : float
        Value, and half of its 95 % interval; 0: held known.
    reason, remedy : str
        Why it is not determined, and what determines it; empty if it is.

    """

    name: str
    joint: str
    unit: str
    value: float
    reach: float
    reason: str = ''
    remedy: str = ''


@dataclass(frozen=True)
class ZeroFit:
    """
    The fit of K rests in some poses.

    Attributes
    ----------
    arm : ArmModel
        The model with the fitted values; of the last recording, if payloads differ.
    estimate : Estimate
        Fitted values of the effects.
    quantities : tuple of Quantity
        In the order of `quantities_of`.
    before, residual : ndarray, shape (n,)
        Rms of reading minus description, and of reading minus fit [N m or N].
    rests, poses, outliers : int
        Numbers of rests, of different poses, and of readings that are left out.

    """

    arm: ArmModel
    estimate: Estimate
    quantities: tuple[Quantity, ...]
    before: FloatArray
    residual: FloatArray
    rests: int
    poses: int
    outliers: int

    def of(self, name: str, joint: str = '') -> Quantity:
        """Return a quantity by its name and joint."""
        return next(one for one in self.quantities if (one.name, one.joint) == (name, joint))


def arm_at_rest(robot: Robot, known: Collection[str] = ()) -> ArmModel:
    """Return an arm at rest with the effects to fit; with known gains the size of gravity too."""
    names = ['payload', 'base_tilt', 'coulomb_friction', 'torque_offset', 'torque_gain']
    if 'gain' in known and 'tilt' not in known:
        names.append('gravity_magnitude')
    arm = ArmModel(robot, quasi_static=True)
    for name in names:
        if name not in {KNOWN[one] for one in known}:
            arm = arm.with_effect(CATALOGUE.find(name).on(robot))
    return arm


def quantities_of(arm: ArmModel) -> dict[tuple[str, str, str], float]:
    """
    Return the quantities of a fitted arm by name, joint and unit.

    A zero is the reading without any torque. The centre of the tool is in the frame of the last
    joint.

    """
    values = {e.name: v for e, v in zip(arm.effects, arm.values, strict=True)}
    gain = 1.0 + values.get('torque_gain', np.zeros(arm.robot.n_joints))
    found: dict[tuple[str, str, str], float] = {}
    for j, joint in enumerate(arm.robot.joints):
        unit = 'N' if arm.robot.prismatic[j] else 'N m'
        found['zero', joint, unit] = gain[j] * values['torque_offset'][j]
        found['gain', joint, ''] = gain[j]
        found['friction', joint, unit] = gain[j] * values['coulomb_friction'][j]
    gravity = arm.body.gravity
    found |= {(f'gravity_{axis}', '', 'm/s^2'): gravity[k] for k, axis in enumerate('xyz')}
    found['gravity', '', 'm/s^2'] = np.linalg.norm(gravity)
    found['tilt', '', 'deg'] = np.degrees(np.linalg.norm(values.get('base_tilt', 0.0)))
    mass, *moments = values.get('payload', np.zeros(4))[:4]
    found['mass', '', 'kg'] = mass
    found |= {(f'center_{a}', '', 'm'): moments[k] / (mass or 1.0) for k, a in enumerate('xyz')}
    return {key: float(value) for key, value in found.items()}


def fit_rests(
    rests: Sequence[Motion],
    robots: Sequence[Robot],
    known: Collection[str] = (),
    link_error: float = 0.0,
) -> ZeroFit:
    """
    Fit an arm at rest.

    Parameters
    ----------
    rests : sequence of Motion
        Rests of each recording, see `find_rests`.
    robots : sequence of Robot
        The described arm in each recording, with its known payload.
    known : collection of str
        Quantities of `KNOWN` that are held at their described values.
    link_error : float
        Standard deviation of masses and first moments of links, as a share of their size; 0: they
        are trusted.

    """
    described = [arm_at_rest(robot, known) for robot in robots]
    y = np.concatenate([np.asarray(one.tau) for one in rests])
    largest = np.maximum(np.abs(y), 0.05 * np.abs(y).max()).max(axis=0)
    scales = dict(zip(rests[0].joints, largest, strict=True))
    scales[''] = float(robots[0].rigid_parameters[::10].sum()) or 10.0  # [kg], a common arm
    links = link_error * described_spread(robots[0])
    links[:, 4:] = 0.0  # inertia
    names = described[0].parameters
    prior = np.concatenate([links.ravel(), np.zeros(len(names) - links.size)])
    for k, name in enumerate(names[links.size :], links.size):
        owner = '' if name.effect == 'payload' else name.joint
        unit = scales[owner] if name.effect in _SCALED else 1.0
        prior[k] = unit * _PRIORS.get(name.name, 0.0)

    def predicted(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return readings (K, n) and sensitivities (K, n, P) for a change of all parameters."""
        arms = [arm.with_theta(arm.theta + x) for arm in described]
        pairs = list(zip(arms, rests, strict=True))
        torque = np.concatenate([arm.torque(motion) for arm, motion in pairs])
        return torque, np.concatenate([arm.columns(motion) for arm, motion in pairs])

    # without an approach, dry friction is anything up to its bound
    known_side = np.concatenate([one.dq for one in rests]) != 0.0
    solution = _solved(predicted, y, known_side, prior, largest)
    arm = described[-1].with_theta(described[-1].theta + solution.x)
    poses = count_poses(np.concatenate([one.q for one in rests]))
    free = solution.free
    effects = free >= links.size
    left = y - predicted(solution.x)[0]
    return ZeroFit(
        arm,
        Estimate(
            tuple(names[k] for k in free[effects]),
            arm.theta[free[effects]],
            solution.covariance[np.ix_(effects, effects)],
        ),
        tuple(_judged(arm, solution, scales, poses)),
        np.sqrt(np.mean((y - predicted(0.0 * prior)[0]) ** 2, axis=0)),
        np.sqrt(np.mean(left**2, axis=0, where=solution.used)),
        len(y),
        poses,
        int(np.sum(known_side & ~solution.used)),
    )


@dataclass(frozen=True)
class _Solution:
    """Change of P parameters; covariance and information of the free ones; readings used."""

    x: FloatArray
    free: npt.NDArray[np.intp]
    covariance: FloatArray
    information: FloatArray
    used: npt.NDArray[np.bool_]
    freedom: float  # readings minus parameters of the joint with the fewest


def _solved(
    predicted: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    y: FloatArray,
    known_side: npt.NDArray[np.bool_],
    prior: FloatArray,
    scales: FloatArray,
) -> _Solution:
    """Solve by Gauss-Newton iterations; estimate variances and leave out outliers on the way."""
    x, free, used = np.zeros(len(prior)), np.flatnonzero(prior), known_side
    sigma = 0.02 * scales
    for _ in range(60):
        torque, columns = predicted(x)
        columns = columns[:, :, free]
        w = columns * (used / sigma)[:, :, np.newaxis]
        information = np.einsum('kjp,kjr->pr', w, w)
        covariance = np.linalg.inv(information + np.diag(prior[free] ** -2.0))
        pull = np.einsum('kjp,kj->p', w, (y - torque) / sigma) - x[free] / prior[free] ** 2
        step = covariance @ pull
        x[free] += step
        freedom = used.sum(axis=0) - np.einsum('kjp,pr,kjr->j', w, covariance, w)
        left = np.abs(y - torque - columns @ step)
        squares = np.sum(used * left**2, axis=0)
        before, sigma = sigma, np.sqrt(squares / np.maximum(freedom, 0.1)) + 1e-6 * scales
        # the median of normal errors is 0.67 of their standard deviation
        used = known_side & (left < _OUTLYING / 0.67 * np.median(left, axis=0) + 1e-6 * scales)
        still = np.abs(step).max(initial=0.0, where=step**2 > 1e-6 * np.diag(covariance))
        if not still and np.all(np.abs(before / sigma - 1.0) < 1e-3):
            break
    return _Solution(x, free, covariance, information, used, float(freedom.min()))


def _judged(
    arm: ArmModel, solution: _Solution, scales: Mapping[str, float], poses: int
) -> Iterator[Quantity]:
    """Return the quantities with their intervals, and why some are not determined."""
    free, covariance = solution.free, solution.covariance
    std = np.sqrt(np.diag(covariance))
    middle = quantities_of(arm)
    slopes = np.zeros((len(middle), len(free)))
    for k, place in enumerate(free):
        step = 0.01 * std[k] * np.eye(1, len(arm.theta), place)[0]
        ends = [[*quantities_of(arm.with_theta(arm.theta + s * step)).values()] for s in (-1, 1)]
        slopes[:, k] = np.subtract(ends[1], ends[0]) / (0.02 * std[k])
    factor = float(student.ppf(0.975, max(solution.freedom, 1.0)))
    names = [arm.parameters[k] for k in free]
    alone = 1.0 / np.sqrt(np.maximum(np.diag(solution.information), 1e-300))
    for (key, value), slope in zip(middle.items(), slopes, strict=True):
        reach = factor * float(np.sqrt(slope @ covariance @ slope))
        limit = _USEFUL[key[0].split('_')[0]]
        limit *= scales[key[1]] if key[0] in ('zero', 'friction', 'mass') else 1.0
        reason = remedy = ''
        if reach > limit or (reach > 0.0 and solution.freedom < 1.0):
            most = int(np.argmax(np.abs(slope) * std))
            correlation = covariance[most] / (std * std[most])
            correlation[most] = 0.0
            other = names[int(np.argmax(np.abs(correlation)))]
            mixed = factor * abs(slope[most]) * alone[most] <= limit
            reason = f'not separable from {other.words} of {other.joint or "the arm"}'
            reason = reason if mixed else 'no rest shows it'
            remedy = _remedy({names[most].name, other.name if mixed else ''})
            if poses < _FEW:
                reason, remedy = f'{poses} poses are too few', MORE
        yield Quantity(*key, value, reach, reason, remedy)


def _remedy(names: set[str]) -> str:
    """Return what separates or shows parameters."""
    if any(name.startswith('payload') for name in names):
        return 'record a known payload as well, --payload BAG=KG@LINK, or say --known tool'
    if 'gain_error' in names:
        return 'gravity hardly turns the joint: a known force or tool has to, or say --known gain'
    return MORE if names == {'coulomb_torque', ''} else 'say what is known: --known tilt'
