# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How large a gap is: what an oracle that fits everything but the hidden effect leaves over.

The gap of a joint is e - 1, where e is the mean of (residual / sigma)^2 over all periods of all
bags. The residual comes from perfect instruments and the true motion; sigma, per bag and joint,
is what real instruments add to it, errors of the position carried through the model included.
Where known dry friction may hold a joint, its torque says nothing, and the joint does not count.
Both go through one zero-phase filter. A *refitted* gap has the rigid parameters and the known
drives fitted, a *fixed* gap has them true. The gap of a case is that of its worst joint.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.ndimage import maximum_filter1d
from scipy.signal import butter, sosfiltfilt

from tests.hidden.arrays import FloatArray

CUT_OFF = 10.0  # Hz, above all of the motion
ROWS_PER_SECOND = 25.0

#: A joint may be held below this share of its largest speed, and this long before and after [s].
HELD_SPEED, HELD_TIME = 0.01, 0.1


@dataclass(frozen=True)
class Gap:
    """
    The excess loss of each joint.

    Attributes
    ----------
    refit, fixed : ndarray, shape (n,)
        With everything but the effect fitted, and with everything but the effect true.

    """

    refit: FloatArray
    fixed: FloatArray


@dataclass(frozen=True)
class Evidence:
    """
    One bag as the oracle has it.

    Attributes
    ----------
    clean, noisy : Recording
        What perfect and what real instruments recorded.
    dq_true, ddq_true : ndarray, shape (N, n)
        True velocity and acceleration at the stamps.
    periods : tuple of (float, float)
        Beginning and end of each period [s].

    """

    clean: Recording
    noisy: Recording
    dq_true: FloatArray
    ddq_true: FloatArray
    periods: tuple[tuple[float, float], ...]


def measure_gap(
    robot: Robot, known: Mapping[str, FloatArray], evidence: Sequence[Evidence]
) -> Gap:
    """
    Compute the gap that several bags show.

    Parameters
    ----------
    robot : Robot
        With the true rigid parameters.
    known : mapping of str to ndarray, shape (n,)
        True values of the known drives.
    evidence : sequence of Evidence
        The bags.

    """
    rows = [_rows(robot, known, bag) for bag in evidence]
    residual = np.concatenate([r * w for r, w, _ in rows])  # (R, n)
    columns = np.concatenate([c * w[:, :, np.newaxis] for _, w, c in rows])  # (R, n, p)
    count = np.count_nonzero(np.concatenate([w for _, w, _ in rows]), axis=0)
    design = columns.reshape(-1, columns.shape[2])
    scale = np.linalg.norm(design, axis=0)
    design = design[:, scale > 1e-9] / scale[scale > 1e-9]
    u, values, _ = np.linalg.svd(design, full_matrices=False)
    u = u[:, values > 1e-6 * values[0]]
    stacked = residual.ravel()
    left = (stacked - u @ (u.T @ stacked)).reshape(residual.shape)
    return Gap((left**2).sum(axis=0) / count, (residual**2).sum(axis=0) / count)


def noise_floor(
    robot: Robot, known: Mapping[str, FloatArray], bag: Evidence
) -> tuple[FloatArray, FloatArray]:
    """Return sigma of the joints, shape (n,), from the truth, and from the repeated period."""
    first, second = (_select(bag, period) for period in bag.periods[:2])
    count = len(first)
    rows = np.concatenate([first, second])
    clean, noisy, _ = _residuals(robot, known, bag, rows)
    difference = noisy[count:] - noisy[:count]
    free = ~_held(known, bag)[rows]
    truth = ((noisy - clean) ** 2 * free).sum(axis=0) / free.sum(axis=0)
    both = free[count:] & free[:count]
    repeated = (difference**2 * both).sum(axis=0) / both.sum(axis=0) / 2.0
    return np.sqrt(truth), np.sqrt(repeated)


def _rows(
    robot: Robot, known: Mapping[str, FloatArray], bag: Evidence
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what one bag contributes.

    Returns
    -------
    residual, weight : ndarray, shape (R, n)
        Torque left over [N m], and 1 / sigma or 0 [1 / (N m)].
    columns : ndarray, shape (R, n, p)
        Of what is fitted.

    """
    chosen = np.concatenate([_select(bag, period) for period in bag.periods])
    clean, noisy, drives = _residuals(robot, known, bag, chosen)
    free = ~_held(known, bag)[chosen]
    if not free.any(axis=0).all():
        raise FloatingPointError(f'{robot.name}: a joint is stuck')
    sigma = np.sqrt(((noisy - clean) ** 2 * free).sum(axis=0) / free.sum(axis=0))
    q, dq, ddq = _motion(bag.clean)
    data = robot.model.createData()
    rigid = np.array(
        [
            pin.computeJointTorqueRegressor(robot.model, data, q[i], dq[i], ddq[i]).copy()
            for i in chosen
        ]
    )
    columns = [rigid]
    for name, drive in drives.items():
        there = np.flatnonzero(known[name])
        spread = np.zeros((len(chosen), robot.n_joints, len(there)))
        spread[:, there, range(len(there))] = drive[:, there]
        columns.append(spread)
    return clean, free / sigma, np.concatenate(columns, axis=2)


def _residuals(
    robot: Robot, known: Mapping[str, FloatArray], bag: Evidence, rows: npt.NDArray[np.intp]
) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """Return what model and known drives leave over in some rows, and the drives' columns."""
    shapes = {
        'viscous_friction': bag.dq_true,
        'coulomb_friction': np.sign(bag.dq_true),
        'rotor_inertia': bag.ddq_true,
    }
    drives = {name: _low_pass(shapes[name], bag.clean)[rows] for name in known}
    friction = sum(values * drives[name] for name, values in known.items())
    left = []
    for recording in (bag.clean, bag.noisy):
        assert recording.tau is not None
        torque = _low_pass(recording.tau, recording)[rows]
        left.append(torque - _inverse_dynamics(robot, recording, rows) - friction)
    return left[0], left[1], drives


def _inverse_dynamics(
    robot: Robot, recording: Recording, rows: npt.NDArray[np.intp]
) -> FloatArray:
    data = robot.model.createData()
    states = zip(*(values[rows] for values in _motion(recording)), strict=True)
    return np.array([pin.rnea(robot.model, data, *state) for state in states])


def _motion(recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray]:
    q = _low_pass(recording.q, recording)
    dq = np.gradient(q, recording.period, axis=0)
    ddq = np.zeros_like(q)
    ddq[1:-1] = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / recording.period**2
    return q, dq, ddq


def _low_pass(values: FloatArray, recording: Recording) -> FloatArray:
    sections = butter(4, CUT_OFF, fs=1.0 / recording.period, output='sos')
    return sosfiltfilt(sections, values, axis=0)


def _held(known: Mapping[str, FloatArray], bag: Evidence) -> npt.NDArray[np.bool_]:
    """Return where dry friction may hold each joint, shape (N, n)."""
    dry = known.get('coulomb_friction', np.zeros(bag.dq_true.shape[1])) > 0.0
    slow = np.abs(bag.dq_true) < HELD_SPEED * np.abs(bag.dq_true).max(axis=0)
    reach = 2 * round(HELD_TIME / bag.clean.period) + 1
    return maximum_filter1d(slow, reach, axis=0) & dry


def _select(bag: Evidence, period: tuple[float, float]) -> npt.NDArray[np.intp]:
    """Return the samples of a period that count, as indices."""
    times = np.arange(period[0], period[1] - 1e-9, 1.0 / ROWS_PER_SECOND)
    return np.searchsorted(bag.clean.t, times - 1e-9)
