# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Step 1: parameters of the two-link arm with rigid joints, far below its resonances.

tau = (M + diag(mm gear^2)) q'' + h + (dl + dm gear^2) q' + fm gear sgn(q'). The identifiable
parameters are alpha + mm1 gear^2, beta, gamma, mm2 gear^2, the sums of friction and the Coulomb
torques. Motor and link friction, and inertias of joint 1, are identifiable only as sums.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.fitting.covariance import sandwich, score_products
from armid_ros.identification.fitting.least_squares import NormalEquations, solve
from armid_ros.identification.rows.regression import by_stretch, Regression, weighted_rows
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.identification.interaction import direction, link_columns
import numpy as np
from scipy.signal import butter, sosfiltfilt

#: Cut-off of the signals [Hz]: about a tenth of the lowest resonance of such arms.
CUTOFF = 2.5
#: Time at both ends in which the filter has not settled [s].
_SETTLING_TIME = 0.4
#: Rows per period of the cut-off frequency.
_ROWS_PER_PERIOD = 10


@dataclass(frozen=True, eq=False)
class RigidFit:
    """
    Eight identified parameters of a two-link arm whose joints are modelled as rigid.

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


def fit_rigid(runs: Sequence[ElasticRun]) -> RigidFit:
    """
    Fit a two-link arm with rigid joints to slow motion by weighted least squares.

    Torques and columns pass the same low-pass filter. Accelerations come from accelerometers on
    the links, positions from encoders at the links. Friction depends on the velocity of the
    motors.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Measured experiments with some motion below the cutoff.

    Raises
    ------
    IdentificationError
        If no experiment is usable, or the parameters are not identifiable from them.

    """
    problem = [part for number, run in enumerate(runs) for part in _rows(run, str(number))]
    if not problem:
        raise IdentificationError(
            f'the rigid fit needs an experiment longer than {2 * _SETTLING_TIME:g} s'
        )
    normal = NormalEquations.of(problem)
    products = normal.summed()[:-1, :-1]
    scale = np.sqrt(np.diag(products))
    if not np.all(scale > 0.0):
        raise IdentificationError('the rigid fit needs motion of both joints, but one rests')
    sizes = np.linalg.eigvalsh(products / np.outer(scale, scale))
    # smallest singular value of identifiable columns, relative to the largest
    if sizes[0] < 1e-6**2 * sizes[-1]:
        raise IdentificationError(
            'the slow motion does not determine the inertias; let both joints accelerate '
            'in several poses'
        )
    solution = solve(problem)
    joints = runs[0].motor.joints
    names = (
        ParameterName('alpha + mm gear^2', joints[0], 'kg m^2'),
        ParameterName('beta', '', 'kg m^2'),
        ParameterName('gamma', '', 'kg m^2'),
        ParameterName('mm gear^2', joints[1], 'kg m^2'),
        *(ParameterName('dl + dm gear^2', joint, 'N m s/rad') for joint in joints),
        *(ParameterName('fm gear', joint, 'N m') for joint in joints),
    )
    # the filter correlates errors of neighbouring rows
    rows, target = weighted_rows(problem, solution.weights)
    scores = rows * (target - rows @ solution.values)[:, np.newaxis]
    scores = scores.reshape(-1, len(joints), rows.shape[1]).sum(axis=1)
    # correlation time of errors: two periods of the cut-off
    middle = score_products(by_stretch(problem, scores), 2 * _ROWS_PER_PERIOD)
    freedom = len(rows) / max(len(rows) - rows.shape[1], 1)
    bread = np.asarray(np.linalg.inv(rows.T @ rows), dtype=np.float64)
    estimate = Estimate(names, solution.values, freedom * sandwich(bread, middle))
    return RigidFit(estimate, normal.relative_error_percent(solution.values))


def _rows(run: ElasticRun, source: str) -> list[Regression]:
    """Return the filtered regression rows of an experiment; [] if the experiment is too short."""
    motor, link = run.motor, run.link
    assert motor.tau is not None
    dt = float(motor.t[-1] - motor.t[0]) / (len(motor) - 1)
    ends = round(_SETTLING_TIME / dt)
    if len(motor) <= 2 * ends + 1:
        return []
    table = np.zeros((len(link), 2, 9))
    table[:, :, :3] = link_columns(link.q, link.dq, link.ddq)
    table[:, 1, 3] = link.ddq[:, 1]
    table[:, [0, 1], [4, 5]] = motor.dq
    # drives hold their torque between samples, which delays it by half a sample
    between = 0.5 * (table[:-1] + table[1:])
    between[:, [0, 1], [6, 7]] = direction(motor.dq)[:-1]
    between[:, :, 8] = motor.tau[:-1]
    sections = butter(4, CUTOFF, fs=1.0 / dt, output='sos')
    kept = slice(ends, -ends, max(round(1.0 / (_ROWS_PER_PERIOD * CUTOFF) / dt), 1))
    rows = sosfiltfilt(sections, between, axis=0)[kept]
    moved = link.select(slice(0, -1)).select(kept).with_torque(rows[:, :, 8])
    return [Regression(source, moved, np.ones(moved.q.shape, dtype=bool), rows[:, :, :8])]
