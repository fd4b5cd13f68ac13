# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 1: the arm as if its joints were rigid, at frequencies far below its resonances.

tau = (M + diag(mm gear^2)) q'' + h + (dl + dm gear^2) q' + fm gear sgn(q'). Motor and link inertia
of joint 1 cannot be told apart then, nor motor and link friction of any joint; alpha + mm1 gear^2,
beta, gamma, mm2 gear^2, the sums of friction and the Coulomb torques can.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.identification.interaction import direction
import numpy as np
from scipy.signal import butter, sosfiltfilt

#: What is kept of a signal [Hz]: a tenth of the lowest resonance of such arms, and some more.
CUTOFF = 2.5
#: Ends that the filter has not settled in [s].
_ENDS = 0.4
#: Rows kept in the time of a period at the cutoff, and periods over which their errors last.
_KEPT, _LASTING = 10, 2


@dataclass(frozen=True, eq=False)
class RigidFit:
    """
    The eight parameters of the rigid arm.

    Attributes
    ----------
    estimate : Estimate
        alpha + rotor inertia 1, beta, gamma, rotor inertia 2 [kg m^2], total viscous friction
        [N m s/rad] and Coulomb torque [N m] of both joints, all at the joints.
    relative_error : float
        100 |tau - model| / |tau| of the filtered torques [%].

    """

    estimate: Estimate
    relative_error: float

    @property
    def coulomb(self) -> FloatArray:
        """Coulomb torque at the joints, shape (2,) [N m]."""
        return self.estimate.values[6:8]

    @property
    def total_damping(self) -> FloatArray:
        """Viscous friction of motor and link, shape (2,) [N m s/rad]."""
        return self.estimate.values[4:6]


def fit_rigid(runs: Sequence[ElasticRun], *, cutoff: float = CUTOFF) -> RigidFit:
    """
    Fit the rigid arm to slow motion by least squares.

    Torques and columns pass the same low-pass filter. Accelerations are those of the links'
    accelerometers, positions those of their encoders, friction follows the motors.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Measured experiments with some motion below the cutoff.
    cutoff : float
        Of the filter [Hz].

    Raises
    ------
    IdentificationError
        If no experiment is usable, or the parameters are not identifiable from them.

    """
    tables, torques = [], []
    for run in runs:
        assert run.motor.tau is not None
        t = run.motor.t
        dt = float(t[-1] - t[0]) / (len(t) - 1)
        # drives hold their torque from one sample to the next: that is half a sample later
        columns, signs = _columns(run), direction(run.motor.dq)[:-1]
        between = 0.5 * (columns[:-1] + columns[1:])
        between[:, [0, 1], [6, 7]] = signs
        whole = np.concatenate([between, run.motor.tau[:-1, :, np.newaxis]], axis=2)
        sections = butter(4, cutoff, fs=1.0 / dt, output='sos')
        ends = round(_ENDS / dt)
        if len(t) <= 2 * ends + 1:
            continue
        kept = sosfiltfilt(sections, whole, axis=0)[
            ends : -ends : max(round(1.0 / (_KEPT * cutoff) / dt), 1)
        ]
        tables.append(kept[:, :, :-1])
        torques.append(kept[:, :, -1])
    if not tables:
        raise IdentificationError(
            f'the rigid fit needs experiments of more than {2 * _ENDS:g} s; there are none'
        )
    return _solve(tables, torques, runs[0].motor.joints)


def _columns(run: ElasticRun) -> FloatArray:
    """Return the derivatives of both torques by the parameters, without Coulomb, (N, 2, 8)."""
    link, motor = run.link, run.motor
    cosine, sine = np.cos(link.q[:, 1]), np.sin(link.q[:, 1])
    (v1, v2), (a1, a2) = link.dq.T, link.ddq.T
    table = np.zeros((len(link), 2, 8))
    table[:, 0, 0] = a1
    table[:, :, 1] = (a1 + a2)[:, np.newaxis]
    table[:, 0, 2] = cosine * (2.0 * a1 + a2) - sine * (2.0 * v1 * v2 + v2**2)
    table[:, 1, 2] = cosine * a1 + sine * v1**2
    table[:, 1, 3] = a2
    for joint in range(2):
        table[:, joint, 4 + joint] = motor.dq[:, joint]
    return table


def _solve(
    tables: Sequence[FloatArray], torques: Sequence[FloatArray], joints: tuple[str, ...]
) -> RigidFit:
    """Solve both joints together, each weighted by its own noise."""
    table, torque, weight = np.concatenate(tables), np.concatenate(torques), np.ones(2)
    for _ in range(3):
        rows = (table / weight[:, np.newaxis]).reshape(-1, 8)
        scale = np.linalg.norm(rows, axis=0)
        if not np.all(scale > 0.0):
            raise IdentificationError('the rigid fit needs motion of both joints; one stands')
        solution, _, _, sizes = np.linalg.lstsq(
            rows / scale, (torque / weight).ravel(), rcond=None
        )
        if sizes[-1] < 1e-6 * sizes[0]:
            raise IdentificationError(
                'the slow motion does not tell the rigid parameters apart; let both joints '
                'accelerate in several poses'
            )
        values = solution / scale
        left = torque - table @ values
        weight = np.sqrt(np.mean(left**2, axis=0)) + 1e-12
    ends = np.cumsum([len(part) for part in tables])[:-1]
    covariance = _covariance(
        np.split(table / weight[:, np.newaxis], ends), np.split(left / weight, ends)
    )
    names = (
        ParameterName('alpha + mm gear^2', joints[0], 'kg m^2'),
        ParameterName('beta', '', 'kg m^2'),
        ParameterName('gamma', '', 'kg m^2'),
        ParameterName('mm gear^2', joints[1], 'kg m^2'),
        *(ParameterName('dl + dm gear^2', joint, 'N m s/rad') for joint in joints),
        *(ParameterName('fm gear', joint, 'N m') for joint in joints),
    )
    error = 100.0 * float(np.linalg.norm(left) / np.linalg.norm(torque))
    return RigidFit(Estimate(names, values, covariance), error)


def _covariance(tables: Sequence[FloatArray], left: Sequence[FloatArray]) -> FloatArray:
    """
    Return the covariance of the parameters, shape (8, 8), from experiments and their residuals.

    Rows are closer than the filter lets them change, so that errors last from row to row; scores
    are added up over the time that they do (Newey and West 1987).

    """
    scores = [
        np.einsum('njp,nj->np', table, rest) for table, rest in zip(tables, left, strict=True)
    ]
    information = sum(np.einsum('njp,njq->pq', table, table) for table in tables)
    seen = np.asarray(sum(score.T @ score for score in scores))
    lags = _LASTING * _KEPT
    for lag in range(1, lags):
        product = np.asarray(sum(score[:-lag].T @ score[lag:] for score in scores))
        seen = seen + (1.0 - lag / lags) * (product + product.T)
    rows = sum(rest.size for rest in left)
    inverse = np.linalg.inv(information)
    return np.asarray(rows / max(rows - len(inverse), 1) * inverse @ seen @ inverse)
