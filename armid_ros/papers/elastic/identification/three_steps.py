# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The three steps in order: from measured experiments to physical parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.motion import ElasticRun, FloatArray
from armid_ros.papers.elastic.identification.interaction import (
    decouple,
    fit_joints,
    joint_signals,
    measured_response,
)
from armid_ros.papers.elastic.identification.rigid import fit_rigid, RigidFit
from armid_ros.papers.elastic.identification.subspace import StateSpace
from armid_ros.papers.elastic.identification.tuning import tune, Tuning
from armid_ros.robots.two_link import TwoLinkParameters
from armid_ros.simulation.controller import VelocityLoop
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class MeasuredJoint:
    """
    Frequency responses of one joint as measured: from its motor torque to motor and link velocity.

    Attributes
    ----------
    frequency : ndarray, shape (K,)
        [Hz].
    decoupled, coupled : ndarray of complex, shape (K, 2)
        With the interaction torque as a second input, and without [rad/s / (N m)].

    """

    frequency: FloatArray
    decoupled: npt.NDArray[np.complex128]
    coupled: npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class TwoInertiaIdentification:
    """
    Results of the three steps.

    Attributes
    ----------
    joints : tuple of str
        Names of the joints.
    rigid : RigidFit
        Step 1.
    measured : tuple of MeasuredJoint
        Measured responses without a model, for comparison.
    systems : tuple of StateSpace
        Step 2, of both joints.
    untuned : TwoLinkParameters
        Parameters after step 3a.
    interaction_gain : ndarray, shape (2,)
        Gain of the interaction torques in step 3a; 1 if beta and gamma are right.
    experiments : int
        Number of experiments through the resonances.
    angles : ndarray, shape (S,)
        Poses of joint 2 that the experiments went through [rad].
    tuning : Tuning or None
        Step 3b; None without step responses.

    """

    joints: tuple[str, ...]
    rigid: RigidFit
    measured: tuple[MeasuredJoint, MeasuredJoint]
    systems: tuple[StateSpace, StateSpace]
    untuned: TwoLinkParameters
    interaction_gain: FloatArray
    experiments: int
    angles: FloatArray
    tuning: Tuning | None

    @property
    def parameters(self) -> TwoLinkParameters:
        """Return the parameters after the last step."""
        return self.untuned if self.tuning is None else self.tuning.parameters


def identify_two_inertia(
    runs: Sequence[ElasticRun],
    drives: TwoLinkParameters,
    *,
    steps: Sequence[ElasticRun] = (),
    loop: VelocityLoop | None = None,
    start: TwoLinkParameters | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> TwoInertiaIdentification:
    """
    Identify a planar two-link arm with elastic joints.

    Parameters
    ----------
    runs : sequence of ElasticRun
        Experiments through the resonances, with some slow motion.
    drives : TwoLinkParameters
        Gears and torque constants; other parameters are not used.
    steps : sequence of ElasticRun
        Step responses under a velocity loop for the tuning; without them there is no tuning.
    loop : VelocityLoop, optional
        The loop's gains.
    start : TwoLinkParameters, optional
        Initial values of the tuning instead of those of step 3a; Coulomb friction is always that
        of step 1.
    progress : callable, optional
        Callback with the share that is done and the next step.

    Raises
    ------
    IdentificationError
        If the data do not determine the parameters; the message names the step and the remedy.

    """
    if steps and loop is None:
        raise IdentificationError('tuning to step responses needs the gains of their loop')
    progress(0.0, 'step 1: rigid arm')
    rigid = fit_rigid(runs)
    first, beta, gamma, rotor = rigid.estimate.values[:4].tolist()
    if not (first > 0.0 and beta > 0.0 and first * beta > gamma**2):
        raise IdentificationError(
            f'step 1 found alpha + mm gear^2 = {first:.3g}, beta = {beta:.3g} and gamma = '
            f'{gamma:.3g} kg m^2, which no two links have. Is the slow motion strong enough? Do '
            'torques and velocities of a joint have the same sign?'
        )
    alpha = max(first - max(rotor, 0.0), 1.01 * gamma**2 / beta)
    known = replace(
        drives, alpha=alpha, beta=beta, gamma=gamma, coulomb=rigid.coulomb / drives.gear
    )
    progress(0.05, 'step 2: decoupled joints')
    joints, systems = runs[0].motor.joints, decouple(runs, known)
    progress(0.35, 'measured responses')
    t = runs[0].motor.t
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    window = min(1.0, min(len(run.motor) for run in runs) * dt)
    found: list[MeasuredJoint] = []
    for joint in range(2):
        signals = joint_signals(runs, known, joint, decoupled=True)
        alone = joint_signals(runs, known, joint, decoupled=False)
        frequency, decoupled = measured_response(signals, dt, window=window)
        _, coupled = measured_response(alone, dt, window=window)
        found.append(MeasuredJoint(frequency, decoupled[:, :, 0], coupled[:, :, 0]))
    measured = found[0], found[1]
    progress(0.45, 'step 3: physical parameters')
    untuned, gain = fit_joints(systems, joints, known)
    tuning = None
    if steps and loop is not None:
        progress(0.5, 'step 3: tuning to step responses')
        begin = untuned if start is None else replace(start, coulomb=untuned.coulomb)
        tuning = tune(steps, begin, loop)
    progress(1.0, 'done')
    # poses that represent all poses
    angles = np.quantile(
        np.concatenate([run.link.q[:, 1] for run in runs]), np.linspace(0.02, 0.98, 25)
    )
    return TwoInertiaIdentification(
        joints, rigid, measured, systems, untuned, gain, len(runs), angles, tuning
    )
