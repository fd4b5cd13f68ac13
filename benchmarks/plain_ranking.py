# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The plain ranking: which cause, alone, takes most of what a model leaves on another recording.

The rival of the diagnosis. Body (held softly to the description), viscous and dry friction and
offsets are fitted to day 1; the misfit of each joint there, each recording told by the others, is
the unit. Every cause is fitted alone to what that model leaves of day 2, and judged on a recording
that was left out, all ways round: by the share of the power that it takes, less a price per
parameter. Without a day 1 the description is the model, friction is fitted beside every cause, and
the unit is what a full fit leaves. Motions are low-passed at 6 Hz, joints at rest do not count;
there is nothing else to it.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import time

from armid_ros.arm import ArmModel
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy.signal import butter, sosfiltfilt

from benchmarks.two_days import Answer, Named
from tests.hidden.lived.chain import Chain

CUT_OFF, ROWS_PER_SECOND = 6.0, 25.0  # Hz

#: Price of a parameter, as a share of the power.
PRICE = 0.002

#: What takes less than this share is not named.
LEAST = 0.15

#: Share of its largest speed below which a joint rests.
RESTING = 0.02

#: How softly bodies are held to the description, in columns of length 1.
_RIDGE = 1e-3


@dataclass(frozen=True)
class Rows:
    """
    A recording as the ranking has it; R rows.

    Attributes
    ----------
    q, dq, ddq : ndarray, shape (R, n)
        Motion.
    sign : ndarray, shape (R, n)
        Direction of motion, filtered like the torque.
    tau, slope : ndarray, shape (R, n)
        Torque and its derivative.
    moving : ndarray, shape (R, n)
        1 where a joint moves; 0 where it rests, and dry friction may be anything.

    """

    q: FloatArray
    dq: FloatArray
    ddq: FloatArray
    sign: FloatArray
    tau: FloatArray
    slope: FloatArray
    moving: FloatArray


def plain_ranking(
    arm: ArmModel,
    recordings: Sequence[Recording],
    *,
    validate: Sequence[Recording] = (),
    baseline: Sequence[Recording] = (),
    contributions: Sequence[FloatArray] = (),
) -> Answer:
    """
    Rank causes and name the first, in the form of an answer of the diagnosis.

    Its shares are not of a gap, so that the torque of the cause tells nothing of them.

    """
    begin = time.process_time()
    chain = Chain.of(arm.robot)
    ranked = ranking(chain, [*recordings, *validate], baseline)
    headline = tuple(ranked[:1]) if ranked[0].share > LEAST else ()
    verdict = 'named' if headline else 'unknown'
    return Answer(verdict, headline, tuple(ranked[1:6]), time.process_time() - begin)


def ranking(
    chain: Chain, recordings: Sequence[Recording], baseline: Sequence[Recording]
) -> list[Named]:
    """Return all causes with the share each takes, the largest first."""
    asked = [rows_of(recording) for recording in recordings]
    first = [rows_of(recording) for recording in baseline]
    if first:
        unit, values = _misfit(chain, first)
        beside: list[FloatArray] = [np.zeros((*rows.q.shape, 0)) for rows in asked]
    else:
        unit, _ = _misfit(chain, asked)
        values = np.zeros(13 * chain.n_joints)
        beside = [_drives(rows) for rows in asked]
    left = [(_beyond(chain, rows) - _columns(chain, rows) @ values) / unit for rows in asked]
    weights = [rows.moving[:, :, np.newaxis] / unit[:, np.newaxis] for rows in asked]
    before = _left_out(left, [c * w for c, w in zip(beside, weights, strict=True)])
    causes = [list(_causes(chain, rows)) for rows in asked]
    named = []
    for k, (name, joints, _) in enumerate(causes[0]):
        columns = [
            np.concatenate([own[k][2], more], axis=2) * weight
            for own, more, weight in zip(causes, beside, weights, strict=True)
        ]
        share = 1.0 - _left_out(left, columns) / before
        named.append(Named(name, joints, share=share - PRICE * causes[0][k][2].shape[2]))
    return sorted(named, key=lambda one: -one.share)


def rows_of(recording: Recording) -> Rows:
    """Filter and thin out a recording."""
    assert recording.tau is not None
    rate = (len(recording.t) - 1) / recording.t[-1]
    t = np.arange(len(recording.t)) / rate
    even = [
        np.column_stack([np.interp(t, recording.t, column) for column in values.T])
        for values in (recording.q, recording.tau)
    ]
    low = butter(4, CUT_OFF, fs=rate, output='sos')
    q, tau = (sosfiltfilt(low, values, axis=0) for values in even)
    dq = np.gradient(q, 1.0 / rate, axis=0)
    sign = sosfiltfilt(low, np.tanh(dq / (0.02 * np.abs(dq).max(axis=0) + 1e-9)), axis=0)
    ddq, slope = (np.gradient(values, 1.0 / rate, axis=0) for values in (dq, tau))
    thin = slice(round(0.3 * rate), -round(0.3 * rate), max(round(rate / ROWS_PER_SECOND), 1))
    moving = (np.abs(dq) > RESTING * np.abs(dq).max(axis=0)).astype(float)
    return Rows(*(values[thin] for values in (q, dq, ddq, sign, tau, slope, moving)))


def _causes(chain: Chain, rows: Rows) -> Iterator[tuple[str, tuple[str, ...], FloatArray]]:
    """Yield every cause with its joints and columns, shape (R, n, p)."""
    n = chain.n_joints
    motion = rows.q, rows.dq, rows.ddq
    still = np.zeros_like(rows.q)
    bodies = chain.columns(*motion)
    load = chain.torque(*motion)
    pulls = [chain.with_gravity(unit).torque(rows.q, still, still) for unit in np.eye(3)]
    yield 'gravity', (), np.stack(pulls, axis=2)
    yield 'time_delay', (), -rows.slope[:, :, np.newaxis]
    for j, joint in enumerate(chain.joints):
        name = 'payload' if j == n - 1 else 'link_inertia'
        yield name, (joint,), bodies[:, :, 10 * j : 10 * j + 10]
        for name, values in (
            ('torque_offset', np.ones(len(rows.q))),
            ('viscous_friction', rows.dq[:, j]),
            ('coulomb_friction', rows.sign[:, j]),
            ('torque_gain', rows.tau[:, j]),
            ('rotor_inertia', rows.ddq[:, j]),
            ('load_dependent_friction', np.abs(load[:, j]) * rows.sign[:, j]),
        ):
            yield name, (joint,), _alone(n, j, values)
        spring = [_alone(n, j, values) for values in (rows.q[:, j], np.ones(len(rows.q)))]
        yield 'joint_spring', (joint,), np.concatenate(spring, axis=2)
        aside = rows.q.copy()
        aside[:, j] += 1e-4
        change = (chain.torque(aside, rows.dq, rows.ddq) - load) / 1e-4
        yield 'encoder_offset', (joint,), change[:, :, np.newaxis]
        place, jacobian = chain.point(j, _middle(chain, j), rows.q)
        force = np.moveaxis(jacobian, 2, 0)  # (R, n, 3)
        stiff = np.einsum('jxn,xn->nj', jacobian, place)[:, :, np.newaxis]
        yield 'human_interaction', (joint,), np.concatenate([force, stiff], axis=2)


def _alone(n: int, joint: int, values: FloatArray) -> FloatArray:
    """Return one column in one joint, shape (R, n, 1)."""
    column = np.zeros((len(values), n, 1))
    column[:, joint, 0] = values
    return column


def _middle(chain: Chain, joint: int) -> FloatArray:
    body = chain.bodies[joint]
    return body[1:4] / max(float(body[0]), 1e-9)


def _drives(rows: Rows) -> FloatArray:
    """Return viscous friction, dry friction and offset of every joint, shape (R, n, 3 n)."""
    n = rows.q.shape[1]
    kinds = (rows.dq, rows.sign, np.ones_like(rows.q))
    return np.concatenate([values[:, :, np.newaxis] * np.eye(n) for values in kinds], axis=2)


def _columns(chain: Chain, rows: Rows) -> FloatArray:
    """Return the columns of bodies and drives, shape (R, n, 13 n); zero at rest."""
    columns = np.concatenate([chain.columns(rows.q, rows.dq, rows.ddq), _drives(rows)], axis=2)
    return columns * rows.moving[:, :, np.newaxis]


def _beyond(chain: Chain, rows: Rows) -> FloatArray:
    """Return what the description leaves of the torque, shape (R, n); zero at rest [N m]."""
    return (rows.tau - chain.torque(rows.q, rows.dq, rows.ddq)) * rows.moving


def _misfit(chain: Chain, recordings: Sequence[Rows]) -> tuple[FloatArray, FloatArray]:
    """Return rms of each joint on recordings left out, and the values fitted to all of them."""
    columns = [_columns(chain, rows) for rows in recordings]
    left = [_beyond(chain, rows) for rows in recordings]
    scale = np.concatenate(left).std(axis=0) + 1e-9
    residuals = []
    for k in range(len(recordings)):
        others = [i for i in range(len(recordings)) if i != k] or [k]
        values = _fit([left[i] for i in others], [columns[i] for i in others], scale, _RIDGE)
        residuals.append(left[k] - columns[k] @ values)
    count = np.concatenate([rows.moving for rows in recordings]).sum(axis=0)
    unit = np.sqrt((np.concatenate(residuals) ** 2).sum(axis=0) / count)
    return unit, _fit(left, columns, scale, _RIDGE)


def _left_out(left: Sequence[FloatArray], columns: Sequence[FloatArray]) -> float:
    """Return the power that is left of recordings, each told by a fit to the others."""
    power = 0.0
    ones = np.ones(left[0].shape[1])
    for k in range(len(left)):
        others = [i for i in range(len(left)) if i != k] or [k]
        values = _fit([left[i] for i in others], [columns[i] for i in others], ones, 1e-6)
        power += float(((left[k] - columns[k] @ values) ** 2).sum())
    return power


def _fit(
    left: Sequence[FloatArray], columns: Sequence[FloatArray], scale: FloatArray, ridge: float
) -> FloatArray:
    count = columns[0].shape[2]
    if count == 0:
        return np.zeros(0)
    design = (np.concatenate(columns) / scale[:, np.newaxis]).reshape(-1, count)
    size = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
    design = design / size
    target = (np.concatenate(left) / scale).ravel()
    return np.linalg.solve(design.T @ design + ridge * np.eye(count), design.T @ target) / size
