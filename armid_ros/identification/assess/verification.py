# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an identification is put to beside its torque error, and what came of it.

Encoder noise is tested for on the training data; on held-out data the description and the
identified arm are simulated in closed loop. What cannot be done is said, with the reason.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.identification.assess.consistency import check_noise, NoiseCheck
from armid_ros.identification.assess.forward import forward_validation, ForwardScore
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np

#: Motion that is simulated, shared by the held-out recordings; it takes a tenth of that [s].
SIMULATED = 60.0
#: At most this much of one recording [s].
LONGEST = 30.0
#: Samples that tell the bias of encoder noise well enough, all simulations together.
_ENOUGH = 300_000
_MOST_REPEATS = 6
#: A joint is worse where its error grows by this share, and by this share of the largest error of
#: joints of its kind; reversals of friction vary by less from one model to the next.
_WORSE = 0.05


@dataclass(frozen=True)
class ForwardValidation:
    """
    A held-out recording, simulated before and after the identification.

    Attributes
    ----------
    before, after : ForwardScore or None
        Of the description and of the identified arm; None if it cannot be simulated.

    """

    before: ForwardScore | None
    after: ForwardScore

    def sentence(self) -> str:
        """Say how far the simulations are off."""
        before = '' if self.before is None else f'{self.before.worst} before, '
        comment = self.comment()
        return (
            f'simulated in closed loop along {np.ptp(self.after.motion.t):.0f} s of '
            f'{self.after.source}: position error at most {before}{self.after.worst} after'
            f'{"; " if comment else ""}{comment}'
        )

    @property
    def worse(self) -> tuple[str, ...]:
        """Joints that are farther off after than before, by more than simulations vary."""
        if self.before is None:
            return ()
        before, after = self.before.position_error, self.after.position_error
        units = np.array(self.after.units)
        largest = np.array([after[units == unit].max() for unit in units])
        grown = after - before > _WORSE * np.maximum(before, largest)
        return tuple(name for name, more in zip(self.after.joints, grown, strict=True) if more)

    def comment(self) -> str:
        """Say where it got worse, or that the largest error did not get better; '' otherwise."""
        if self.before is None:
            return ''
        if self.worse:
            return f'it is worse than before in {", ".join(self.worse)}'
        before, after = self.before.position_error, self.after.position_error
        first = int(np.argmax(after))
        changed = bool(np.any(after < (1.0 - _WORSE) * before))
        if changed and after[first] > (1.0 - _WORSE) * before[first]:
            return f'it is no better than before in {self.after.joints[first]}'
        return ''

    def document(self) -> dict[str, Any]:
        """Return the errors for programs to read."""
        return {
            'bag': self.after.source,
            'seconds': float(np.ptp(self.after.motion.t)),
            'before': None if self.before is None else _errors(self.before),
            'after': _errors(self.after),
        }


@dataclass(frozen=True)
class Verification:
    """
    What an identification was put to.

    Attributes
    ----------
    noise : NoiseCheck or None
        What encoder noise does to it; None if that could not be found out.
    forward : tuple of ForwardValidation
        Simulations along held-out recordings.
    left_out : tuple of str
        What was not done, and why.

    """

    noise: NoiseCheck | None
    forward: tuple[ForwardValidation, ...]
    left_out: tuple[str, ...]

    def sentences(self) -> tuple[str, ...]:
        """Say in words what was found; ``left_out`` says what was not done."""
        said = [] if self.noise is None else [*self.noise.sentences()]
        return (*said, *(pair.sentence() for pair in self.forward))


def verify(
    result: Identification,
    description: ArmModel,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    *,
    rng: np.random.Generator,
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> Verification:
    """
    Test an identification for encoder noise, and simulate it along held-out recordings.

    Parameters
    ----------
    result : Identification
        The identification.
    description : ArmModel
        The model before it.
    recordings : sequence of Recording
        What it was fitted to.
    held_out : sequence of Recording
        What it was not.
    rng : numpy.random.Generator
        Draws the noise of the simulations.
    progress : callable, optional
        Told the share that is done, 0 to 1, and what is being done.

    """
    left_out = []
    noise = None
    repeats = _ENOUGH // max(1, sum(len(recording) for recording in recordings))
    repeats = int(np.clip(repeats, 2, _MOST_REPEATS))
    try:
        noise = check_noise(
            result,
            recordings,
            rng=rng,
            repeats=repeats,
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
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> tuple[tuple[ForwardValidation, ...], tuple[str, ...]]:
    """
    Simulate two models in closed loop along held-out recordings.

    Parameters
    ----------
    before, after : ArmModel
        What was believed, and what was found; the second one gives the feedback of both.
    used : Conditioning
        Filters.
    held_out : sequence of Recording
        Data that neither was fitted to.
    progress : callable, optional
        Told the share that is done, 0 to 1, and what is being done.

    Returns
    -------
    pairs : tuple of ForwardValidation
        One a recording that could be simulated.
    left_out : tuple of str
        What was not done, and why.

    """
    if not held_out:
        return (), ('not simulated: no recording was held out',)
    if after.quasi_static:
        return (), ('not simulated: a quasi-static model has no inertia',)
    pairs: list[ForwardValidation] = []
    left_out: list[str] = []
    duration = min(LONGEST, SIMULATED / len(held_out))
    for index, recording in enumerate(held_out):
        progress(index / len(held_out), 'simulating held-out recordings')
        try:
            patched = forward_validation(after, recording, used, nominal=after, duration=duration)
        except ArmidError as error:
            left_out.append(f'{recording.source}: not simulated: {error}')
            continue
        plain = None
        try:
            plain = forward_validation(before, recording, used, nominal=after, duration=duration)
        except ArmidError as error:
            left_out.append(f'{recording.source}: the description is not simulated: {error}')
        pairs.append(ForwardValidation(plain, patched))
    return tuple(pairs), tuple(left_out)


def _errors(score: ForwardScore) -> dict[str, dict[str, float]]:
    return {
        name: dict(zip(score.joints, values.tolist(), strict=True))
        for name, values in (
            ('position_rms', score.position_error),
            ('torque_rms', score.torque_error),
            ('feedback_torque_rms', score.feedback_torque),
        )
    }
