# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Tests of an identified model: bias by encoder noise, and simulation of held-out recordings.

Bias by encoder noise is tested on the training data. The description and the identified arm are
simulated in closed loop along held-out data. Tests that cannot be made are listed with reasons.

Forward validation: recorded torques drive a model, and its positions are compared with the
recorded positions. Errors of an integrated torque grow without bounds, so feedback holds the model
near the recorded motion: tau = tau_recorded + M (omega^2 e + 2 omega de). A torque error d of a
joint makes a position error of about d / (M omega^2). The feedback has the same inertia matrix for
every model, so that errors are comparable.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.identification.fitting.instruments import check_noise, NoiseCheck
from armid_ros.identification.fitting.nonlinear import linearised
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.signals import Conditioning, decimate, no_stretch, segments
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.simulation import Controller, Plant, simulate
from armid_ros.simulation.controller import BANDWIDTH, LinearFeedback
import numpy as np

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class ForwardScore:
    """
    Position errors of a simulated arm that is driven by recorded torques.

    Attributes
    ----------
    source : str
        Source of the recording.
    joints, units : tuple of str
        Joints in column order, and the units of their positions.
    position_error : ndarray, shape (n,)
        Root mean square of the position error [rad or m]; times 1000, mrad.
    torque_error : ndarray, shape (n,)
        Root mean square of recorded minus predicted torque, filtered as for the fit [N m].
    feedback_torque : ndarray, shape (n,)
        Root mean square torque of the feedback [N m].
    motion : Motion
        Recorded motion, filtered.
    simulated : ndarray, shape (N, n)
        Position of the simulated arm [rad or m].

    """

    source: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    position_error: FloatArray
    torque_error: FloatArray
    feedback_torque: FloatArray
    motion: Motion
    simulated: FloatArray

    @property
    def worst(self) -> str:
        """Return the largest position error and its joint as text."""
        joint = int(np.argmax(self.position_error))
        return (
            f'{1e3 * self.position_error[joint]:.3g} m{self.units[joint]} ({self.joints[joint]})'
        )

    def document(self) -> dict[str, dict[str, float]]:
        """Return the position and torque errors of every joint as a dictionary for JSON."""
        named = {
            'position_rms': self.position_error,
            'torque_rms': self.torque_error,
            'feedback_torque_rms': self.feedback_torque,
        }
        return {
            name: dict(zip(self.joints, values.tolist(), strict=True))
            for name, values in named.items()
        }


@dataclass(frozen=True, eq=False)
class _RecordedTorque(Controller):
    """Controller that adds feedback, scaled by inertia, to recorded torques."""

    motion: Motion
    feedback: LinearFeedback

    def feedforward(self, desired: Motion) -> FloatArray:
        """Return the recorded torque at the times of a reference motion, shape (N, n) [N m]."""
        assert self.motion.tau is not None
        t = self.motion.t
        return np.column_stack([np.interp(desired.t, t, column) for column in self.motion.tau.T])


def _forward_score(
    arm: ArmModel, recording: Recording, used: Conditioning, nominal: ArmModel, duration: float
) -> ForwardScore:
    """Return errors of an arm simulated with recorded torques and feedback of `nominal`."""
    motion = next(iter(segments(recording, used)), None)
    if motion is None:
        raise no_stretch(recording, used)
    motion = motion.select(motion.t <= motion.t[0] + duration)
    reference = replace(motion, t=motion.t - motion.t[0])
    # With slower feedback, the friction of a light joint dominates. No model predicts to the
    # millisecond when it changes its sign.
    feedback = LinearFeedback.of(nominal, bandwidth=BANDWIDTH, weighs=False)
    controller = _RecordedTorque(reference, feedback)
    along = arm.along(reference)
    # practically infinite position limits [rad or m]
    far, free = np.full(motion.n_joints, 1e4), np.full(motion.n_joints, np.inf)
    robot = replace(along.robot, lower=-far, upper=far, velocity_limit=free, torque_limit=free)
    plant = Plant(replace(along, robot=robot), hard_stops=False)
    run = simulate(plant, reference, rng=np.random.default_rng(0), controller=controller)
    t = run.truth.t
    recorded = np.column_stack([np.interp(t, reference.t, column) for column in reference.q.T])
    given = controller.feedforward(run.truth)
    assert motion.tau is not None
    residual = decimate(motion.tau - arm.torque(motion), used)
    return ForwardScore(
        source=recording.source,
        joints=motion.joints,
        units=arm.robot.position_units,
        position_error=np.sqrt(np.mean((run.truth.q - recorded) ** 2, axis=0)),
        torque_error=np.sqrt(np.mean(residual**2, axis=0)),
        feedback_torque=np.sqrt(np.mean((run.tau - given) ** 2, axis=0)),
        motion=motion,
        simulated=np.column_stack([np.interp(reference.t, t, q) for q in run.truth.q.T]),
    )


@dataclass(frozen=True)
class ForwardValidation:
    """
    Errors in simulations of a held-out recording, with the models before and after identification.

    Attributes
    ----------
    before, after : ForwardScore or None
        Scores of the description and of the identified arm; None if it cannot be simulated.

    """

    before: ForwardScore | None
    after: ForwardScore

    def sentence(self) -> str:
        """Return a sentence on the position errors of both simulations."""
        comment = self.comment()
        return (
            f'simulated in closed loop along {np.ptp(self.after.motion.t):.0f} s of '
            f'{self.after.source}: position error at most {self.errors()}'
            f'{"; " if comment else ""}{comment}'
        )

    @property
    def same(self) -> bool:
        """Whether both models lead to the same simulated motion."""
        before = self.before
        return before is not None and np.array_equal(before.simulated, self.after.simulated)

    def errors(self) -> str:
        """Return the largest position error of each model as text."""
        if self.before is None or self.same:
            return self.after.worst
        return f'{self.before.worst} with the given model, {self.after.worst} with the new one'

    @property
    def worse(self) -> tuple[str, ...]:
        """Return the joints whose position error is clearly larger after the identification."""
        if self.before is None:
            return ()
        before, after = self.before.position_error, self.after.position_error
        units = np.array(self.after.units)
        largest = np.array([after[units == unit].max() for unit in units])
        # growth of an error that counts as worse, as a share of it and of the largest error of
        # joints of the same unit; reversals of friction vary by less between models
        grown = after - before > 0.05 * np.maximum(before, largest)
        return tuple(name for name, more in zip(self.after.joints, grown, strict=True) if more)

    def comment(self) -> str:
        """Return a sentence on joints whose position error increased; empty if none did."""
        return f'the error increased in {", ".join(self.worse)}' if self.worse else ''

    def document(self) -> dict[str, Any]:
        """Return the errors of both simulations as a dictionary for JSON."""
        return {
            'bag': self.after.source,
            'seconds': float(np.ptp(self.after.motion.t)),
            'before': None if self.before is None else self.before.document(),
            'after': self.after.document(),
        }


@dataclass(frozen=True)
class Verification:
    """
    Results of tests of an identified model: bias by encoder noise, and simulations.

    Attributes
    ----------
    noise : NoiseCheck or None
        Effect of encoder noise; None if it was not tested.
    forward : tuple of ForwardValidation
        Simulations along held-out recordings.
    left_out : tuple of str
        Omitted tests, with reasons.

    """

    noise: NoiseCheck | None
    forward: tuple[ForwardValidation, ...]
    left_out: tuple[str, ...]


def verify(
    result: Identification,
    description: ArmModel,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    *,
    rng: np.random.Generator,
    progress: Progress = lambda share, what: None,
) -> Verification:
    """
    Test an identified model for bias by encoder noise, and by simulation of held-out recordings.

    Parameters
    ----------
    result : Identification
        The identification.
    description : ArmModel
        Model before the identification.
    recordings, held_out : sequence of Recording
        Training data, and held-out data.
    rng : numpy.random.Generator
        Generator of the noise of the simulations.
    progress : callable, optional
        Called with the finished share, 0 to 1, and the present task.

    """
    left_out = []
    noise = None
    # number of simulations with enough samples in total for the bias of encoder noise
    repeats = 300_000 // max(1, sum(len(recording) for recording in recordings))
    try:
        noise = check_noise(
            lambda some: linearised(result.arm, result.base, some, result.used)[0],
            result.estimate,
            result.settings.least_squares,
            recordings,
            result.used,
            rng=rng,
            repeats=int(np.clip(repeats, 2, 6)),
            progress=lambda share: progress(share, 'testing for encoder noise'),
        )
    except (ArmidError, np.linalg.LinAlgError) as error:
        left_out.append(f'not tested for encoder noise: {error}')
    forward, missing = simulate_held_out(
        description, result.arm, result.used, held_out, progress=progress
    )
    return Verification(noise, forward, (*left_out, *missing))


def simulate_held_out(
    before: ArmModel,
    after: ArmModel,
    used: Conditioning,
    held_out: Sequence[Recording],
    *,
    progress: Progress = lambda share, what: None,
) -> tuple[tuple[ForwardValidation, ...], tuple[str, ...]]:
    """
    Simulate two models in closed loop along held-out recordings; return their errors.

    Returns a result for each simulated recording, and omitted tests with reasons. The second model
    defines the feedback of both. `progress` is called with the finished share, 0 to 1, and the
    present task.

    """
    if not held_out:
        return (), ('not simulated: no recording was held out',)
    if after.quasi_static:
        return (), ('not simulated: a quasi-static model has no inertia',)
    pairs: list[ForwardValidation] = []
    left_out: list[str] = []
    # total simulated motion of all held-out recordings, and of one recording at most [s].
    # Simulation takes a tenth of that time.
    duration = min(30.0, 60.0 / len(held_out))
    for index, recording in enumerate(held_out):
        progress(index / len(held_out), 'simulating held-out recordings')
        patched = plain = None
        try:
            patched = _forward_score(after, recording, used, after, duration)
            plain = _forward_score(before, recording, used, after, duration)
        except ArmidError as error:
            subject = '' if patched is None else 'the description is '
            left_out.append(f'{recording.source}: {subject}not simulated: {error}')
        if patched is not None:
            pairs.append(ForwardValidation(plain, patched))
    return tuple(pairs), tuple(left_out)
