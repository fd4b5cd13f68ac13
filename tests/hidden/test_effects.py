# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each hidden effect against its definition: measured torque minus Pinocchio's, on true states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.ndimage import minimum_filter1d
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from tests.hidden.arrays import FloatArray, Signals
from tests.hidden.cases import Draft, draw, simulate
from tests.hidden.catalogue import CATALOGUED, HIDDEN
from tests.hidden.sensing import SENSING
from tests.hidden.specification import CaseSpec

pytestmark = pytest.mark.long

SAMPLES = slice(2200, -1000, 7)  # from the first period on

#: Beyond this frequency transmissions are not looked at [Hz].
SMOOTH = 8.0


@dataclass(frozen=True)
class Seen:
    """What a perfect observer sees of one motion, in the shapes (N, n)."""

    robot: Robot
    values: dict[str, float]
    joints: list[int]
    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    tau: FloatArray
    plain: FloatArray
    known: dict[str, FloatArray]

    def rigid(self, robot: Robot | None = None, q: FloatArray | None = None) -> FloatArray:
        """Return the torque of a rigid arm, by default of this one along this motion."""
        model = (robot or self.robot).model
        data = model.createData()
        states = zip(self.q if q is None else q, self.dq, self.ddq, strict=True)
        return np.array([pin.rnea(model, data, *state) for state in states])

    def with_body(self, prefix: str, suffix: str) -> FloatArray:
        """Return the torque that ten more inertial parameters of a link cause."""
        names = ('m', 'mx', 'my', 'mz', 'Ixx', 'Ixy', 'Iyy', 'Ixz', 'Iyz', 'Izz')
        parameters = self.robot.rigid_parameters.copy()
        ten = slice(10 * self.joints[0], 10 * self.joints[0] + 10)
        parameters[ten] += [self.values[prefix + name + suffix] for name in names]
        return self.rigid(self.robot.with_inertias(parameters)) - self.rigid()

    def alone(self, torque: FloatArray) -> FloatArray:
        """Return a torque of the effect's own joint among zeros of the others."""
        everywhere = np.zeros_like(self.q)
        everywhere[:, self.joints[0]] = torque
        return everywhere

    @property
    def own(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration of the effect's own joint, each (N,)."""
        return tuple(x[:, self.joints[0]] for x in (self.q, self.dq, self.ddq))

    def drives(self, name: str) -> FloatArray:
        """Return the torque of known drives."""
        shape = {
            'viscous_friction': self.dq,
            'coulomb_friction': np.sign(self.dq),
            'rotor_inertia': self.ddq,
        }
        return self.known[name] * shape[name]

    @property
    def gear(self) -> FloatArray:
        """Torque that the transmission of the effect's own joint passes on, (N,)."""
        return (self.tau - sum(self.drives(name) for name in self.known))[:, self.joints[0]]


def _friction(seen: Seen, name: str) -> FloatArray:
    q, dq, _ = seen.own
    v = seen.values
    if name == 'viscous_friction':
        return seen.alone(v['viscous_coefficient'] * dq)
    if name == 'coulomb_friction':
        return seen.alone(v['coulomb_torque'] * np.sign(dq))
    if name == 'stribeck_friction':
        hump = np.exp(-((dq / v['stribeck_velocity']) ** 2))
        return seen.alone(v['stribeck_torque'] * hump * np.sign(dq))
    if name == 'asymmetric_friction':
        return seen.alone(v['coulomb_asymmetry'] + v['viscous_asymmetry'] * np.abs(dq))
    if name == 'quadratic_friction':
        return seen.alone(v['quadratic_coefficient'] * dq * np.abs(dq))
    if name == 'load_dependent_friction':
        load = seen.rigid()[:, seen.joints[0]]
        return seen.alone(v['load_coefficient'] * np.abs(load) * np.sign(dq))
    if name == 'thermal_friction':
        return seen.alone(v['viscous_change'] * (1 - np.exp(-seen.t / v['warm_up_time'])) * dq)
    state, states = 0.0, []
    for way in np.diff(q, prepend=q[0]):
        target = np.sign(way)
        state = target + (state - target) * np.exp(-np.abs(way) / v['breakaway_distance'])
        states.append(state)
    return seen.alone(v['presliding_torque'] * np.array(states))


def _coupled(seen: Seen) -> FloatArray:
    i, k = seen.joints
    tau = np.zeros_like(seen.q)
    dry = seen.values['coupled_coulomb_torque'] * np.sign(seen.dq[:, i] + seen.dq[:, k])
    for row, other in ((i, k), (k, i)):
        tau[:, row] = seen.values['coupled_viscous_coefficient'] * seen.dq[:, other] + dry
    return tau


def _crosstalk(seen: Seen) -> FloatArray:
    listener, source = seen.joints
    tau = np.zeros_like(seen.q)
    tau[:, listener] = next(iter(seen.values.values())) * seen.plain[:, source]
    return tau


def _coupling(seen: Seen) -> FloatArray:
    i, k = seen.joints
    tau = np.zeros_like(seen.q)
    tau[:, i] = -seen.values['coupling_stiffness'] * seen.q[:, k]
    tau[:, k] = -seen.values['coupling_stiffness'] * seen.q[:, i]
    return tau


def _lag(seen: Seen) -> FloatArray:
    """Return what a first-order filter takes away: lag times the slope of what it gives."""
    slope = np.gradient(seen.tau, seen.t, axis=0)
    return seen.alone(-seen.values['lag'] * slope[:, seen.joints[0]])


def _delay(seen: Seen) -> FloatArray:
    past = [np.interp(seen.t - seen.values['delay'], seen.t, tau) for tau in seen.plain.T]
    return np.column_stack(past) - seen.plain


def _gravity(seen: Seen, gravity: FloatArray) -> FloatArray:
    return seen.rigid(seen.robot.with_gravity(gravity)) - seen.rigid()


def _tilt(seen: Seen) -> FloatArray:
    """Turn gravity by -r, as the base that turned by r sees it."""
    turn = Rotation.from_rotvec([-seen.values['tilt_x'], -seen.values['tilt_y'], 0.0])
    return _gravity(seen, turn.apply(np.array(seen.robot.gravity)))


def _bumper(seen: Seen) -> FloatArray:
    beyond = np.maximum(seen.own[0] - seen.values['upper_position'], 0.0)
    return seen.alone(seen.values['upper_stiffness'] * beyond)


def _ripple(seen: Seen) -> FloatArray:
    angle = seen.values['ripple_order'] * seen.own[0]
    return seen.alone(
        seen.values['ripple_sine'] * np.sin(angle) + seen.values['ripple_cosine'] * np.cos(angle)
    )


def _saturation(seen: Seen) -> FloatArray:
    reported = seen.tau[:, seen.joints[0]]
    limit = seen.values['saturation_torque']
    return seen.alone(reported - np.clip(reported, -limit, limit))


def _twisted(seen: Seen, twist: FloatArray) -> FloatArray:
    """Return what it changes that the link is behind the motor; smooth, as it is derived twice."""
    j, model, data = seen.joints[0], seen.robot.model, seen.robot.model.createData()
    rate = 1.0 / (seen.t[1] - seen.t[0])
    twist = sosfiltfilt(butter(2, SMOOTH, fs=rate, output='sos'), twist)
    q, dq, ddq = seen.q.copy(), seen.dq.copy(), seen.ddq.copy()
    for values in (q, dq, ddq):
        values[:, j] -= twist
        twist = np.gradient(twist, seen.t)
    states = zip(q, dq, ddq, strict=True)
    return np.array([pin.rnea(model, data, *state) for state in states]) - seen.rigid()


DEFINITIONS: dict[str, Callable[[Seen], FloatArray]] = {
    'coupled_joint_friction': _coupled,
    'torque_offset': lambda s: s.alone(np.full(len(s.t), s.values['torque_offset'])),
    'torque_drift': lambda s: s.alone(
        s.values['drift'] * (1.0 - np.exp(-s.t / s.values['drift_time']))
    ),
    'torque_gain': lambda s: s.alone(s.values['gain_error'] * s.plain[:, s.joints[0]]),
    'torque_crosstalk': _crosstalk,
    'torque_lag': _lag,
    'time_delay': _delay,
    'encoder_offset': lambda s: s.rigid(q=s.q + s.alone(s.values['encoder_offset'])) - s.rigid(),
    'payload': lambda s: s.with_body('payload_', ''),
    'link_inertia': lambda s: s.with_body('', '_difference'),
    'gravity_magnitude': lambda s: _gravity(
        s,
        s.robot.gravity * (1.0 + s.values['gravity_difference'] / np.linalg.norm(s.robot.gravity)),
    ),
    'base_tilt': _tilt,
    'rotor_inertia': lambda s: s.alone(s.values['rotor_inertia'] * s.own[2]),
    'torque_ripple': _ripple,
    'actuator_saturation': _saturation,
    'joint_spring': lambda s: s.alone(
        s.values['spring_stiffness'] * s.own[0] + s.values['spring_preload']
    ),
    'soft_limit': _bumper,
    'joint_coupling': _coupling,
    'joint_elasticity': lambda s: _twisted(s, s.values['compliance'] * s.gear),
    'backlash': lambda s: _twisted(s, 0.5 * s.values['backlash'] * np.sign(s.gear)),
}


def spec_of(name: str, machine: str = 'panda') -> CaseSpec:
    """Return a case of an effect that is not in any list."""
    bare = set(HIDDEN[name].needs) <= {'rotor_inertia'}
    return CaseSpec(f'test/{name}', 'single', machine, (name,), (1.0,), True, bare, 1.0, 5)


def see(draft: Draft, speed: str) -> tuple[Seen, Signals]:
    """Move an arm and look at it."""
    effect = draft.effects[0]
    signals = simulate(draft, [speed])[0].signals
    plain = signals
    if isinstance(effect, SENSING):  # the arm itself moves as without it
        plain = simulate(replace(draft, effects=()), [speed])[0].signals
    seen = Seen(
        robot=draft.robot,
        values={p.name: p.value for p in effect.parameters},
        joints=[draft.robot.index(joint) for joint in effect.joints],
        t=signals.t,
        q=signals.q,
        dq=signals.dq,
        ddq=signals.ddq,
        tau=signals.tau,
        plain=plain.tau,
        known=dict(draft.known),
    )
    return seen, signals


def glides(dq: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where a joint moves, and has moved for some time, so that nothing holds it."""
    fast = np.abs(dq) > 0.02 * np.abs(dq).max(axis=0)
    return minimum_filter1d(fast, 41, axis=0)


@pytest.mark.parametrize('name', [n for n in CATALOGUED if 'inter' not in n])
def test_torque_is_what_the_definition_says(name: str) -> None:
    draft = draw(spec_of(name))
    draft = replace(draft, effects=tuple(effect.scaled(2.0) for effect in draft.effects))
    for speed in ('medium', 'fast', 'slow'):  # not every motion goes where the effect is
        seen, signals = see(draft, speed)
        definition = DEFINITIONS.get(name)
        expected = definition(seen) if definition else _friction(seen, name)
        if np.abs(expected).max() > 0.0:
            break
    left = seen.tau - seen.rigid() - sum(seen.drives(drive) for drive in draft.known)
    if HIDDEN[name].dt < 1e-3:
        low_pass = butter(2, SMOOTH, fs=1.0 / HIDDEN[name].dt, output='sos')
        left, expected = (
            sosfiltfilt(low_pass, left, axis=0),
            sosfiltfilt(low_pass, expected, axis=0),
        )
    moving = glides(signals.dq)
    if name == 'coupled_joint_friction':
        moving &= glides(signals.dq[:, seen.joints].sum(axis=1, keepdims=True))
    if name == 'backlash':  # on a flank, and for some time
        flank = np.abs(seen.gear) > 0.1 * np.abs(seen.gear).max()
        moving &= minimum_filter1d(flank, 2401)[:, np.newaxis]
    difference = np.where(moving, left - expected, 0.0)[SAMPLES]
    whole = np.where(moving, expected, 0.0)[SAMPLES]
    floor = 2e-4 * np.abs(seen.tau).max(axis=0)
    strong = np.abs(whole).max(axis=0) > 10.0 * floor
    assert strong.any()
    error = np.sqrt((difference**2).mean(axis=0)) - floor
    size = np.sqrt((whole**2).mean(axis=0))
    assert np.all(error[strong] < 0.03 * size[strong]), error / size
    assert np.all(error[~strong] < 0.01 * size.max())


@pytest.mark.parametrize('name', ['human_interaction', 'interface_slack'])
def test_straps_pull_towards_their_anchors(name: str) -> None:
    draft = draw(spec_of(name, 'ur10'))
    effect = draft.effects[0]
    seen, _ = see(draft, 'medium')
    left = (seen.tau - seen.rigid() - sum(seen.drives(drive) for drive in draft.known))[SAMPLES]
    model, joint = draft.robot.model, seen.joints[0]
    data = model.createData()
    expected = []
    for q, dq in zip(seen.q[SAMPLES], seen.dq[SAMPLES], strict=True):
        pin.computeJointJacobians(model, data, q)
        place = data.oMi[joint + 1]
        arm = place.rotation @ np.array(effect.attachment)
        spatial = pin.getJointJacobian(model, data, joint + 1, pin.LOCAL_WORLD_ALIGNED)
        jacobian = spatial[:3] - pin.skew(arm) @ spatial[3:]
        way = place.translation + arm - np.array(effect.anchor)
        if name == 'human_interaction':
            pull = seen.values['interaction_stiffness'] * way
            pull = pull + seen.values['interaction_damping'] * (jacobian @ dq)
        else:
            length = np.linalg.norm(way)
            taut = max(length - seen.values['slack'], 0.0)
            pull = seen.values['slack_stiffness'] * taut * way / length
        expected.append(jacobian.T @ pull)
    expected = np.array(expected)
    assert np.ptp(expected, axis=0).max() > 0.5
    assert np.sqrt(((left - expected) ** 2).mean()) < 0.01 * np.sqrt((expected**2).mean())
