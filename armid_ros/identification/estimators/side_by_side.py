# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
All estimators on the same data: bias, held-out torque, closed-loop position error, time.

The bias of a real recording is not known, so it is that of twins: recordings of the identified
arm along the smoothed motion, with the noise that encoders and torques have, whose parameters are
known.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.identification.assess.consistency import (
    calm_recording,
    INSTRUMENT_SHARE,
    position_noise,
)
from armid_ros.identification.assess.forward import forward_validation
from armid_ros.identification.estimators.names import Estimator
from armid_ros.identification.identify import (
    Identification,
    IdentificationSettings,
    identify,
    Score,
)
from armid_ros.identification.physical.fit_among_bodies import PhysicalSettings
from armid_ros.identification.rows.signals import segments, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.simulation import Plant
import numpy as np

#: Twins whose mean error is called bias.
TWINS = 4
#: At most this much of each held-out recording is simulated [s].
_LONGEST = 30.0


@dataclass(frozen=True)
class ComparisonSettings:
    """
    How estimators are compared.

    Attributes
    ----------
    methods : sequence of str
        Estimators.
    signals : SignalSettings
        Filters, the same for all.
    seed : int
        Of every random number.
    twins : int
        Simulated recordings for the bias; none for no bias.

    """

    methods: Sequence[Estimator]
    signals: SignalSettings = field(default_factory=SignalSettings)
    seed: int = 0
    twins: int = TWINS


@dataclass(frozen=True)
class MethodScore:
    """
    How one estimator did.

    Attributes
    ----------
    method : str
        Its name.
    training, held_out : float or None
        Relative torque error [%]; None where nothing is held out, or it failed.
    position_error : float or None
        Root mean square position error of the worst joint [mrad or mm], simulated in closed loop
        along held-out data (training data where there are none); None if it is not simulated.
    bias, scatter : float or None
        Torque of the mean error of the parameters on twins, and of its standard deviation, as a
        share of the torque [%].
    seconds : float
        What the fit took.
    note : str
        Why it failed, or what a person should know.

    """

    method: Estimator
    training: float | None
    held_out: float | None
    position_error: float | None
    bias: float | None
    scatter: float | None
    seconds: float
    note: str = ''

    def document(self) -> dict[str, Any]:
        """Return the numbers for programs to read."""
        return {
            'method': self.method,
            'training_error_percent': self.training,
            'held_out_error_percent': self.held_out,
            'closed_loop_position_error_milli': self.position_error,
            'bias_percent': self.bias,
            'scatter_percent': self.scatter,
            'seconds': self.seconds,
            'note': self.note,
        }


def compare_methods(
    arm: ArmModel,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    settings: ComparisonSettings,
    *,
    clock: Callable[[], float],
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> tuple[MethodScore, ...]:
    """
    Fit an arm to recordings by several estimators.

    Parameters
    ----------
    arm : ArmModel
        Structure and description.
    recordings, held_out : sequence of Recording
        What is fitted, and what is predicted.
    settings : ComparisonSettings
        What is compared, and how.
    clock : callable
        Returns the time that is counted [s].
    progress : callable, optional
        Told the share that is done, 0 to 1, and what is being done.

    Raises
    ------
    IdentificationError
        If weighted least squares, which all are held against, cannot identify anything.

    """
    methods, seed = settings.methods, settings.seed
    if not methods:
        return ()
    plain = _fit(arm, recordings, 'wls', settings.signals, seed)
    nominal = _simulated(arm, recordings, plain, settings.signals, seed)
    pairs = _twins(plain, recordings, settings.twins, seed)
    fixed = SignalSettings(plain.used.cutoff_hz, plain.used.decimation)
    scores = []
    for index, method in enumerate(methods):
        progress(index / len(methods), f'comparing methods: {method}')
        begin = clock()
        try:
            result = _fit(arm, recordings, method, settings.signals, seed)
        except ArmidError as error:
            spent = clock() - begin
            scores.append(MethodScore(method, None, None, None, None, None, spent, str(error)))
            continue
        seconds = clock() - begin
        bias, scatter = _errors(arm, plain, pairs, method, fixed, seed)
        scores.append(
            MethodScore(
                method,
                Score.of(result.training).relative_error_percent,
                Score.of(result.predict(held_out)).relative_error_percent if held_out else None,
                _position_error(result, nominal, held_out or recordings),
                bias,
                scatter,
                seconds,
                '; '.join(note for note in result.notes if note not in plain.notes),
            )
        )
    return tuple(scores)


def _fit(
    arm: ArmModel,
    recordings: Sequence[Recording],
    method: Estimator,
    signals: SignalSettings,
    seed: int,
) -> Identification:
    settings = IdentificationSettings(method, signals)
    return identify(arm, recordings, settings, rng=np.random.default_rng(seed))


def _simulated(
    arm: ArmModel,
    recordings: Sequence[Recording],
    plain: Identification,
    signals: SignalSettings,
    seed: int,
) -> ArmModel:
    """Return an arm whose inertia the feedback of all simulations can have."""
    try:
        Plant(plain.arm)
    except ArmidError:
        settings = IdentificationSettings('wls', signals, PhysicalSettings())
        return identify(arm, recordings, settings, rng=np.random.default_rng(seed)).arm
    return plain.arm


def _position_error(
    result: Identification, nominal: ArmModel, recordings: Sequence[Recording]
) -> float | None:
    """Return the worst joint's position error in closed loop [milli]; None if not simulated."""
    squares = []
    for recording in recordings:
        try:
            score = forward_validation(
                result.arm, recording, result.used, nominal=nominal, duration=_LONGEST
            )
        except ArmidError:
            return None
        squares.append(score.position_error**2)
    return float(1e3 * np.sqrt(np.mean(squares, axis=0)).max())


def _twins(
    plain: Identification, recordings: Sequence[Recording], count: int, seed: int
) -> list[list[Recording]]:
    """Return recordings of the identified arm itself, with the noise of the measured ones."""
    used, arm = plain.used, plain.arm
    rng = np.random.default_rng([seed, 1])
    torque_noise = plain.joint_std * np.sqrt(used.decimation)
    exact = []
    for recording in recordings:
        noise = position_noise(recording)
        calm = calm_recording(recording, INSTRUMENT_SHARE * used.cutoff_hz)
        for motion in segments(calm, used):
            exact.append((recording.source, noise, motion, arm.torque(motion)))
    return [
        [
            Recording(
                joints=motion.joints,
                t=motion.t - motion.t[0],
                q=motion.q + noise * rng.normal(size=motion.q.shape),
                tau=tau + torque_noise * rng.normal(size=tau.shape),
                source=f'twin of {source}',
            )
            for source, noise, motion, tau in exact
        ]
        for _ in range(count)
    ]


def _errors(
    arm: ArmModel,
    plain: Identification,
    twins: Sequence[Sequence[Recording]],
    method: Estimator,
    signals: SignalSettings,
    seed: int,
) -> tuple[float | None, float | None]:
    """Return the torque of bias and of scatter on twins [%]; None where the estimator fails."""
    errors: list[FloatArray] = []
    for twin in twins:
        try:
            found = _fit(arm, twin, method, signals, seed)
        except ArmidError:
            return None, None
        predicted = np.concatenate([fit.predicted for fit in found.training])
        truth = replace(found, arm=plain.arm).predict(twin)
        errors.append(predicted - np.concatenate([fit.predicted for fit in truth]))
    if len(errors) < 2:
        return None, None
    tau = np.linalg.norm(np.concatenate([fit.predicted for fit in truth]))
    mean = np.mean(errors, axis=0)
    spread = np.sqrt(np.sum(np.var(errors, axis=0, ddof=1)))
    return float(100.0 * np.linalg.norm(mean) / tau), float(100.0 * spread / tau)
