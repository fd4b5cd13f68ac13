# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Torque zeros and gains, gravity, tool and dry friction from an arm at rest.

The reading of a joint is gain (weight + offset + friction against the approach), as in `ArmModel`.
The weight is that of the described links and of a tool. The fit is generalised least squares;
the variance of each joint comes from its residuals. Weak priors keep confounded
parameters finite. A quantity with a wide interval is not determined.

"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from armid_ros import ArmModel, make_effect, Robot
from armid_ros.api.table import Summary
from armid_ros.estimate import measured
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.stats import t as student

SCHEMA = 'armid/zero/1'
#: Quantities that the user may fix, each with the effects that are then not fitted.
_EFFECTS_OF_KNOWN = {'gain': 'torque_gain', 'tilt': 'base_tilt', 'tool': 'payload'}
#: Quantity of each effect; if it is not determined, the effect is not in the model.
_QUANTITY = {'torque_gain': 'gain', 'torque_offset': 'zero', 'base_tilt': 'tilt'}
_QUANTITY |= {'payload': 'mass'}
#: Largest half-width of a 95 % interval of a determined quantity: zeros and friction as shares
#: of the largest reading of the joint, gravity [m/s^2], tilt [deg], mass as a share of the mass
#: of the arm, and centre [m].
_MAX_HALF_WIDTH = {'zero': 0.2, 'friction': 0.2, 'gain': 0.1, 'gravity': 0.4, 'tilt': 2.0}
_MAX_HALF_WIDTH |= {'mass': 0.04, 'center': 0.1}
#: Prior standard deviation of each parameter, ten times a useful accuracy: torques as shares of
#: the largest reading of the joint, payload as a share of the mass of the arm, others in SI
#: units.
_PRIOR_STD = {'torque_offset': 1.0, 'coulomb_torque': 1.0, 'gain_error': 0.5, 'payload_m': 0.3}
_PRIOR_STD |= {'tilt_x': 0.3, 'tilt_y': 0.3, 'gravity_difference': 2.0}
_PRIOR_STD |= dict.fromkeys(('payload_mx', 'payload_my', 'payload_mz'), 0.1)
#: Remedy for most quantities that are not determined.
_REMEDY = 'record a trajectory of armid zero plan'


@dataclass(frozen=True)
class FittedQuantity:
    """
    Fitted quantity with the half-width of its 95 % confidence interval (0 for a known quantity).

    The joint is empty for a quantity of the whole arm. The reason why the quantity is not
    determined ends with a remedy; it is empty for a determined one.

    """

    name: str
    joint: str
    unit: str
    value: float
    half_width: float
    reason: str


@dataclass(frozen=True)
class ZeroFit:
    """
    Result of a fit of torque sensor zeros and gains, gravity and tool to K rests of an arm.

    Attributes
    ----------
    arm : ArmModel
        The model with the fitted values; of the last recording, if payloads differ.
    quantities : tuple of FittedQuantity
        In the order of `quantities_of`.
    before, residual : ndarray, shape (n,)
        Rms of reading minus description, and of reading minus fit [N m or N].
    largest : ndarray, shape (n,)
        Largest reading of each joint, at least 5 % of that of any joint [N m or N].
    rests, poses, outliers : int
        Numbers of rests, of different poses, and of readings that are left out.

    """

    arm: ArmModel
    quantities: tuple[FittedQuantity, ...]
    before: FloatArray
    residual: FloatArray
    largest: FloatArray
    rests: int
    poses: int
    outliers: int

    def of(self, name: str, joint: str = '') -> FittedQuantity:
        """Return the fitted quantity with a name and a joint; joint '' means the whole arm."""
        return next(one for one in self.quantities if (one.name, one.joint) == (name, joint))

    def model(self) -> ArmModel:
        """Return an arm model with all determined zeros, gains and tilt, and a point-mass tool."""
        arm = ArmModel(self.arm.robot)
        for effect, values in zip(self.arm.effects, self.arm.values, strict=True):
            if effect.name == 'payload' and values[0] > 0.0:
                point = pin.Inertia(values[0], values[1:4] / values[0], np.zeros((3, 3)))
                values = point.toDynamicParameters()
            if name := _QUANTITY.get(effect.name):
                owners = effect.joints if name in ('gain', 'zero') else ('',)
                known = [not self.of(name, joint).reason for joint in owners]
                arm = arm.with_effect(effect, values * known)
        return arm


def arm_at_rest(robot: Robot, known: Collection[str] = ()) -> ArmModel:
    """Return a static arm model with the effects that `fit_rests` fits, excluding `known`."""
    names = ['payload', 'base_tilt', 'coulomb_friction', 'torque_offset', 'torque_gain']
    if 'gain' in known and 'tilt' not in known:
        names.append('gravity_magnitude')
    arm = ArmModel(robot, quasi_static=True)
    for name in names:
        if name not in {_EFFECTS_OF_KNOWN[one] for one in known}:
            arm = arm.with_effect(make_effect(name, robot))
    return arm


def quantities_of(arm: ArmModel) -> dict[tuple[str, str, str], float]:
    """
    Return zeros, gains, friction, gravity and tool of an arm; keys are (name, joint, unit).

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
    found['gravity', '', 'm/s^2'] = float(np.linalg.norm(gravity))
    found['tilt', '', 'deg'] = float(np.degrees(np.linalg.norm(values.get('base_tilt', 0.0))))
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
    Fit torque sensor zeros and gains, gravity, tool and friction to the rests of an arm.

    Parameters
    ----------
    rests : sequence of Motion
        Rests of each recording, see `find_rests`.
    robots : sequence of Robot
        The described arm in each recording, with its known payload.
    known : collection of str
        Quantities that are fixed to their described values: 'gain', 'tilt' or 'tool'.
    link_error : float
        Standard deviation of masses and first moments of links, as a share of their size; 0: the
        description is exact.

    """
    arms = [arm_at_rest(robot, known) for robot in robots]
    y = np.concatenate([np.asarray(one.tau) for one in rests])
    scales = np.maximum(np.abs(y), 0.05 * np.abs(y).max()).max(axis=0)
    units = dict(zip(rests[0].joints, scales, strict=True))
    units[''] = float(robots[0].rigid_parameters[::10].sum()) or 10.0  # [kg], a common arm
    links = link_error * robots[0].described_spread
    links[:, 4:] = 0.0  # inertia
    prior = [*links.ravel()]
    for name in arms[0].parameters[links.size :]:
        share = name.effect in ('torque_offset', 'coulomb_friction', 'payload')
        owner = '' if name.effect == 'payload' else name.joint
        prior.append(_PRIOR_STD.get(name.name, 0.0) * (units[owner] if share else 1.0))
    solved = _solved(arms, rests, np.array(prior), scales)
    arm = arms[-1].with_theta(arms[-1].theta + solved.x)
    q = np.concatenate([one.q for one in rests])
    # poses at least 0.1 rad or m from all previous poses
    poses = sum(bool(np.all(np.abs(q[:k] - q[k]).max(axis=1) > 0.1)) for k in range(len(q)))
    few = f'{poses} poses are too few; {_REMEDY}' if solved.freedom < 3.0 else ''
    before, after = (y - _predicted(arms, rests, x)[0] for x in (0.0 * solved.x, solved.x))
    return ZeroFit(
        arm,
        _quantities(arm, solved, units, few),
        np.sqrt(np.mean(before**2, axis=0)),
        np.sqrt(np.mean(after**2, axis=0, where=solved.used)),
        scales,
        len(y),
        poses,
        solved.outliers,
    )


def _predicted(
    arms: Sequence[ArmModel], rests: Sequence[Motion], x: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return torques (K, n) predicted for parameter changes x (P,), and derivatives (K, n, P)."""
    pairs = [(a.with_theta(a.theta + x), motion) for a, motion in zip(arms, rests, strict=True)]
    torque = np.concatenate([arm.torque(motion) for arm, motion in pairs])
    return torque, np.concatenate([arm.columns(motion) for arm, motion in pairs])


class _Solution(NamedTuple):
    """
    Solution of the fit: changes of P parameters, and covariance of the F free parameters.

    Covariances (F, F) are from the variances of joints and from the scatter of the rests;
    information (F, F) is without the prior; freedom is the fewest redundant readings of a joint.

    """

    x: FloatArray
    free: npt.NDArray[np.intp]
    covariance: FloatArray
    scattered: FloatArray
    information: FloatArray
    used: npt.NDArray[np.bool_]
    outliers: int
    freedom: float


def _solved(
    arms: Sequence[ArmModel], rests: Sequence[Motion], prior: FloatArray, scales: FloatArray
) -> _Solution:
    """Fit parameters with prior standard deviations > 0 by Gauss-Newton, without outliers."""
    y = np.concatenate([np.asarray(one.tau) for one in rests])
    # readings without a motion of the joint before only bound its dry friction
    approached = np.concatenate([one.dq for one in rests]).astype(bool)
    x, free, used, sigma = np.zeros(len(prior)), np.flatnonzero(prior), approached, 0.02 * scales
    for _ in range(60):
        torque, columns = _predicted(arms, rests, x)
        w = columns[:, :, free] * (used / sigma)[:, :, np.newaxis]
        information = np.einsum('kjp,kjr->pr', w, w)
        covariance = np.linalg.inv(information + np.diag(prior[free] ** -2.0))
        pull = np.einsum('kjp,kj->p', w, (y - torque) / sigma) - x[free] / prior[free] ** 2
        step = covariance @ pull
        x[free] += step
        freedom = used.sum(axis=0) - np.einsum('kjp,pr,kjr->j', w, covariance, w)
        residual = np.abs(y - torque - columns[:, :, free] @ step)
        before, least = sigma, 1e-6 * scales
        sigma = np.sqrt((used * residual**2).sum(axis=0) / np.maximum(freedom, 0.1)) + least
        if freedom.min() > 8.0:  # readings are enough to leave out outliers
            # 6.7 median residuals are 4.5 standard deviations, as where dry friction is reversed
            used = approached & (residual <= 6.7 * np.median(residual, axis=0) + least)
        small = np.all(step**2 < 1e-6 * np.diag(covariance))
        if small and np.all(np.abs(before / sigma - 1.0) < 1e-3):
            break
    leverage = np.minimum(np.einsum('kjp,pr,kjr->kj', w, covariance, w), 0.9)
    rest = (y - _predicted(arms, rests, x)[0]) / sigma / (1.0 - leverage)
    moved = np.einsum('kjp,kj->kp', w, rest) @ covariance
    outliers, redundant = int(np.sum(approached & ~used)), float(freedom.min())
    scattered = moved.T @ moved
    return _Solution(x, free, covariance, scattered, information, used, outliers, redundant)


def _quantities(
    arm: ArmModel, solved: _Solution, units: Mapping[str, float], few: str
) -> tuple[FittedQuantity, ...]:
    """Return all fitted quantities; a nonempty `few` is the reason why none is determined."""
    factor = float(student.ppf(0.975, max(solved.freedom, 1.0)))
    middle, std = quantities_of(arm), np.sqrt(np.diag(solved.covariance))
    found, tool = [], True
    slopes = np.zeros((len(middle), len(std)))
    for k, place in enumerate(solved.free):
        step = 0.01 * std[k] * np.eye(1, len(arm.theta), place)[0]
        ends = [quantities_of(arm.with_theta(arm.theta + s * step)) for s in (-1.0, 1.0)]
        low, high = (np.array([*end.values()]) for end in ends)
        slopes[:, k] = (high - low) / (0.02 * std[k])
    for ((name, joint, unit), value), slope in zip(middle.items(), slopes, strict=True):
        variance = max(slope @ one @ slope for one in (solved.covariance, solved.scattered))
        half = factor * float(np.sqrt(variance))
        scale = units[joint] if name in ('zero', 'friction', 'mass') else 1.0
        limit = scale * _MAX_HALF_WIDTH[name.split('_')[0]]
        reason = few if half > 0.0 else ''
        if half > limit:
            reason = few or _reason(arm, solved, slope, limit / factor)
        if name == 'mass':
            tool = abs(value) > half
        elif reason and name.startswith('center') and not tool:
            reason = 'no tool mass was found; give --known tool'
        found.append(FittedQuantity(name, joint, unit, value, half, reason))
    return tuple(found)


def _reason(arm: ArmModel, solved: _Solution, slope: FloatArray, limit: float) -> str:
    """Return why a quantity with derivatives `slope` (F,) is not determined, and a remedy."""
    std = np.sqrt(np.diag(solved.covariance))
    most = int(np.argmax(np.abs(slope) * std))
    correlation = np.abs(solved.covariance[most]) / std
    correlation[most] = 0.0
    own, other = (arm.parameters[solved.free[k]] for k in (most, np.argmax(correlation)))
    alone = abs(slope[most]) / np.sqrt(max(solved.information[most, most], 1e-300)) < limit
    names = own.name + (other.name if alone else '')
    remedy = 'give --known tilt if the base is level'
    if 'payload' in names:
        remedy = 'record a known payload as well (--payload), or give --known tool'
    elif 'gain_error' in names:
        remedy = 'the weight torque is too small: give --known gain, or record with a tool'
    elif own.name == 'coulomb_torque':
        remedy = _REMEDY
    mixed = f'not separable from {other.words} of {other.joint or "the base"}'
    return f'{mixed if alone else "no rest depends on it"}; {remedy}'


def fit_document(
    found: ZeroFit, known: Collection[str], link_error: float, external: bool
) -> dict[str, Any]:
    """Return the JSON document of a fit, the content of zero.json."""
    gains = [one.value for one in found.quantities if one.name == 'gain' and not one.reason]
    links = f'links within {100.0 * link_error:g} %' if link_error else 'links as described'
    held = [links, *known]
    held += [] if 'gain' in known else [f'gravity of {found.of("gravity").value:.4g} m/s^2']
    verdict = 'in part' if any(one.reason for one in found.quantities) else 'determined'
    if all(one.reason for one in found.quantities if one.name == 'zero'):
        verdict = 'not determined'
    # a residual is acceptable up to a tenth of the largest reading of the joint
    if np.any(found.residual > 0.1 * found.largest) or min(gains, default=1.0) < 0.0:
        verdict = 'not explained'
    rms = zip(found.arm.robot.joints, found.before, found.residual, strict=True)
    return {
        'schema': SCHEMA,
        'robot': found.arm.robot.name,
        'verdict': verdict,
        'external': external,
        'held': held,
        'rests': found.rests,
        'poses': found.poses,
        'outliers': found.outliers,
        'quantities': [asdict(one) for one in found.quantities],
        'joints': [{'joint': j, 'before': float(b), 'residual': float(r)} for j, b, r in rms],
    }


def fit_summary(found: ZeroFit, document: dict[str, Any], step: str, noise: FloatArray) -> Summary:
    """Return the terminal summary of a fit; `noise` is each joint's torque noise at rest, (n,)."""
    names = ('zero', 'gain', 'friction')
    rows = [
        (joint, *(_cell(found.of(name, joint)) for name in names), f'{residual:.2g}')
        for joint, residual in zip(found.arm.robot.joints, found.residual, strict=True)
    ]
    tilt, mass = found.of('tilt'), found.of('mass')
    center = [found.of(f'center_{axis}') for axis in 'xyz']
    parts = []
    if tilt.half_width and not tilt.reason:
        parts.append(f'base tilted by {_cell(tilt)} deg')
    if mass.half_width and not mass.reason:
        place = f' at {", ".join(_cell(one).split(" ± ")[0] for one in center)} m'
        known = any(not one.reason for one in center)
        parts.append(f'tool of {_cell(mass)} kg{place if known else ""}')
    determined = sum(not one.reason for one in found.quantities)
    title = ', '.join(parts) or f'{determined} of {len(found.quantities)} quantities'
    lines = [
        f'{found.rests} rests in {found.poses} poses; outliers left out: {found.outliers}; '
        f'held known: {", ".join(document["held"])}'
    ]
    sticking = [
        joint
        for joint, residual, least in zip(
            found.arm.robot.joints, found.residual, noise, strict=True
        )
        if residual > 5.0 * least  # dry friction of unknown size
    ]
    if sticking:
        lines.append(
            f'dry friction holds {", ".join(sticking)} with another torque in each rest: zeros '
            'and tool are less certain, and friction is a lower bound; record more poses'
        )
    undetermined: dict[str, list[str]] = {}
    for one in found.quantities:
        if one.reason:
            undetermined.setdefault(one.reason, []).append(f'{one.name} {one.joint}'.strip())
    for why, which in undetermined.items():
        text = ', '.join(which) if len(which) < 9 else f'{len(which)} values'
        lines.append(f'not determined: {text}: {why}')
    if document['verdict'] == 'not explained':
        step = 'check --robot, --gravity, --effort-scale and contacts of the arm'
    elif document['verdict'] == 'not determined':
        step = _REMEDY
    heads = ('joint', *names, 'residual [N m or N]')
    return Summary(title, document['verdict'], heads, rows, lines, [step])


def _cell(one: FittedQuantity) -> str:
    if one.reason:
        return 'not det.'
    value, half = measured(one.value, one.half_width)
    return f'{value} ± {half}' if one.half_width else f'{value} (known)'
