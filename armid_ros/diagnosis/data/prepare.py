# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From recordings to rows and their noise, unless the data are at fault themselves.

Asked first are time base, units, signs, order of joints, delay and clipped readings: a fault of
the data explains any gap and no physics should be blamed for it. Names, signs and units are those
that identification tells; see `identification.assess.mistakes`.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import excited
from armid_ros.diagnosis.data.evidence import noise_floor, NoiseFloor
from armid_ros.diagnosis.data.trajectory import thinnable, trajectories, Trajectory, UNSURE
from armid_ros.diagnosis.search.candidates import with_friction
from armid_ros.diagnosis.search.fit import fit
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.dead_channels import dead_channels
from armid_ros.identification.assess.hypotheses import (
    Exchanged,
    Hypothesis,
    InDegrees,
    InUnit,
    OtherUnit,
    Reversed,
)
from armid_ros.identification.assess.mistakes import find_mistake
from armid_ros.identification.assess.undriven import held_elsewhere
from armid_ros.identification.fitting.cutoff import cutoff_of_torques
from armid_ros.identification.rows.checks import (
    check_motion,
    driven_by_friction,
    TORQUE_UNITS,
    wrong_sign,
)
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.feedback import laws_of_controllers
from armid_ros.identification.rows.signals import Conditioning, conditioning, MODEL_BANDS
from armid_ros.identification.ties.recorded import band_of_motion
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import given_twice, Recording
from armid_ros.robots import Robot
import numpy as np

#: Mistakes that are of the data and of nothing that may happen to an arm.
_OF_DATA = Exchanged | InDegrees | InUnit | Reversed
#: What torques are that are so many times those of the model, and how near to the factor: masses
#: of a description are off by less.
_UNITS = {
    57.2958: 'torques are 57.3 times what the model takes, degrees against radians: convert them',
    **{
        count: f'torques are in {unit} instead of N m: convert them'
        for unit, count in TORQUE_UNITS.items()
    },
}
#: A factor of torques is that of a unit if it is within this factor of it.
_NEAR = 1.5
#: A torque of so many times the limit of its drive is said.
_BEYOND = 1.5
#: Share of samples at the very extreme of a reading, above which it is clipped.
_CLIPPED = 0.02
#: A step of a position at this multiple of the highest velocity is none of the arm.
_IMPOSSIBLE = 10.0
#: Share of steps in time that differ from the median by more than half of it.
_UNEVEN = 0.05
#: Jitter of stamps that blurs a torque at the end of the band by less than this share of it is
#: harmless.
_BLURRED = 0.1
#: A diagnosis keeps six times the band of the motion where an identification keeps ten: what is
#: beyond is mostly noise, which a gap has to stand out of.
_BANDS = 6.0
#: Where noise of positions makes the upper third of that this many times as noisy as the lower
#: one, in any joint, the upper third is cut off: there is less in it than it hides.
_GROWTH = 4.0
#: Wider rows hide more of the motion beside reversals: at least this share of it has to stay.
_MOVING = 0.7
#: Beside a partner, noise of angles is all there is: the pass band is so much wider than where the
#: motion sinks into it, or a fit takes inertia away to get rid of the noise of accelerations.
_NARROW = 1.25


def check_data(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    data: Sequence[Trajectory],
) -> tuple[list[str], list[str]]:
    """
    Look for faults of the data.

    Returns
    -------
    faults : list of str
        What makes a diagnosis meaningless, in words, with the remedy.
    notes : list of str
        What a reader should know.

    """
    mistaken = _mistaken(arm, recordings, used)
    if mistaken:
        return mistaken, []
    faults = [*_time_base(recordings, _band(data)), *_laws(arm, data)]
    for recording in recordings:
        motions = [part.at_rows for part in data if part.source == recording.source]
        faults += [*_jumps(arm.robot, recording), *dead_channels(arm, recording, motions)]
    faults += [] if faults else _signs(arm, recordings, data)
    notes = [*_clipped(recordings), *_beyond_limits(arm.robot, recordings)]
    notes += _described_friction(arm)
    measured = [part.at_rows.with_torque(part.torque) for part in data]
    for held in held_elsewhere(arm.robot, recordings, measured):
        (faults if held.spoils else notes).append(held.text)
    try:
        notes += check_motion(arm.robot, recordings, used)
    except IdentificationError as error:
        faults.append(str(error))
    return faults, notes


def _signs(
    arm: ArmModel, recordings: Sequence[Recording], data: Sequence[Trajectory]
) -> list[str]:
    """Say whose friction drives; another machine that an arm is tied to may drive it."""
    if any(one.partner is not None for one in recordings):
        return []
    motions, torques = [part.at_rows for part in data], [part.torque for part in data]
    driven = driven_by_friction(arm.robot, motions, torques)
    return [wrong_sign(driven)] if driven else []


def _mistaken(arm: ArmModel, recordings: Sequence[Recording], used: Conditioning) -> list[str]:
    """Say what every recording shows to be wrong with it: names, signs or units of joints."""
    if any(one.partner is not None for one in recordings):
        return []
    said: set[tuple[str, ...]] = set()
    for recording in recordings:
        mistake = find_mistake(arm.body, recording, used)
        if mistake is None:
            return []
        said.add(tuple(_fault(one, arm.robot) for one in mistake.hypotheses))
    if len(said) != 1:
        return []
    (sentences,) = said
    return [', or '.join(sentences)] if all(sentences) else []


def _fault(mistake: Hypothesis, robot: Robot) -> str:
    """Say what is wrong with data; empty if it is something that may happen to an arm."""
    if isinstance(mistake, OtherUnit):
        ratios = [(mistake.factor / factor, said) for factor, said in _UNITS.items()]
        return next((said for ratio, said in ratios if 1.0 / _NEAR < ratio < _NEAR), '')
    return mistake.sentence(robot) if isinstance(mistake, _OF_DATA) else ''


def _jumps(robot: Robot, recording: Recording) -> Iterator[str]:
    """Say where positions first step faster than a joint can move."""
    time = np.maximum(np.diff(recording.t), recording.period)[:, np.newaxis]
    known = np.isfinite(robot.velocity_limit) & (robot.velocity_limit > 0.0)
    limit = np.where(known, _IMPOSSIBLE * robot.velocity_limit, np.inf)
    at = np.argwhere(np.abs(np.diff(recording.q, axis=0)) > limit * time)
    if len(at):
        row, joint = at[0]
        step = recording.q[row + 1, joint] - recording.q[row, joint]
        yield (
            f'in {recording.source or "a recording"} the position of {robot.joints[joint]} jumps '
            f'by {step:.3g} at {recording.t[row + 1]:.3f} s: leave out what is faulty'
        )


def _band(data: Sequence[Trajectory]) -> float:
    """Return up to which frequency rows hold motion [Hz]."""
    return min(data[0].used.kept_hz, *(part.motion.band_hz for part in data))


def _time_base(recordings: Sequence[Recording], band_hz: float) -> list[str]:
    faults = []
    for recording in recordings:
        steps = np.diff(recording.t)
        median = float(np.median(steps))
        uneven = float(np.mean(np.abs(steps - median) > 0.5 * median))
        jitter = float(np.sqrt(np.mean(np.minimum(np.abs(steps - median), median) ** 2)))
        if uneven > _UNEVEN and 2.0 * np.pi * band_hz * jitter > _BLURRED:
            faults.append(
                f'{recording.source or "recording"}: {100 * uneven:.0f} % of the time stamps are '
                'uneven by more than half a period; record with the stamps of the driver'
            )
    return faults


def _described_friction(arm: ArmModel) -> list[str]:
    """Say that a description states friction that the model does not have."""
    robot = arm.robot
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    stated = [
        joint
        for k, joint in enumerate(robot.joints)
        if any(
            getattr(robot, f'urdf_{kind.urdf_attribute}')[k] > 0.0
            and (kind.name, joint) not in there
            for kind in CATALOGUE.values()
            if kind.urdf_attribute
        )
    ]
    if not stated:
        return []
    return [
        f'the description states friction of {", ".join(stated)} in <dynamics>, which the model '
        'does not have: it is looked for like any other; give a model that has it'
    ]


def _laws(arm: ArmModel, data: Sequence[Trajectory]) -> Iterator[str]:
    for part in data:
        rows = part.at_rows.with_torque(part.torque)
        for law in laws_of_controllers(arm.body, rows, part.informative):
            yield f'{part.source or "recording"}: {law}'


def _clipped(recordings: Sequence[Recording]) -> list[str]:
    notes = []
    for recording in recordings:
        if recording.tau is None:
            continue
        for j, joint in enumerate(recording.joints):
            reading = recording.tau[:, j]
            top = np.abs(reading).max()
            share = float(np.mean(np.abs(reading) >= top * (1.0 - 1e-9)))
            if top > 0.0 and share > _CLIPPED and len(np.unique(reading)) > 10:
                notes.append(
                    f'{recording.source or "recording"}: {100 * share:.0f} % of the torque of '
                    f'{joint} is at {top:.4g}, its highest value: a limit'
                )
    return notes


def _beyond_limits(robot: Robot, recordings: Sequence[Recording]) -> Iterator[str]:
    """Say where a torque is beyond what the description lets a drive give."""
    limit = np.where(robot.torque_limit > 0.0, robot.torque_limit, np.inf)
    for recording in recordings:
        if recording.tau is None:
            continue
        largest = np.max(np.abs(recording.tau), axis=0)
        for j in np.flatnonzero(largest > _BEYOND * limit).tolist():
            yield (
                f'{recording.source or "recording"}: the torque of {robot.joints[j]} reaches '
                f'{largest[j]:.4g}, its limit is {limit[j]:.4g}'
            )


@dataclass(frozen=True)
class Prepared:
    """
    What is looked at.

    Attributes
    ----------
    used : Conditioning
        Filters.
    data : tuple of Trajectory
        Stretches of the recordings in rows.
    base : BaseParameters
        What the motion excites of the arm.
    floors : tuple of NoiseFloor
        Noise of each trajectory beside the arm that is fitted to it.
    as_described : tuple of ndarray, shape (n,)
        Noise beside the arm as it is described [N m].

    """

    used: Conditioning
    data: tuple[Trajectory, ...]
    base: BaseParameters
    floors: tuple[NoiseFloor, ...]
    as_described: tuple[FloatArray, ...]

    @property
    def allowed(self) -> FloatArray:
        """What rows may be uncertain by, shape (n,); see `Trajectory`."""
        return self.data[0].allowed

    @property
    def sigma(self) -> list[FloatArray]:
        """Noise of each trajectory, shape (n,) [N m]."""
        return [floor.sigma for floor in self.floors]


def choose_filters(
    arm: ArmModel,
    recordings: Sequence[Recording],
    baseline: Sequence[Recording],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> Conditioning:
    """
    Return the filters of an identification, narrowed to what a diagnosis needs.

    What noise of positions does is seen best where nothing is wrong.

    """
    used = conditioning([*recordings, *baseline], settings.signals)
    if settings.partner is not None:
        return band_of_motion(recordings, used, settings.signals, _NARROW)
    if settings.signals.cutoff_hz is None:
        fuller, _ = with_friction(arm, settings.library)
        independent = fuller.base_parameters(rng).independent
        used = cutoff_of_torques(fuller, independent, baseline or recordings, used)
    if settings.signals.decimation is not None:
        return used
    band = used.rate_hz / (2.5 * MODEL_BANDS * used.decimation)
    wide = replace(used, decimation=max(1, int(used.rate_hz / (2.5 * _BANDS * band))))
    return thinnable(wide)


def prepare(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    data: Sequence[Trajectory],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    misfit: bool = False,
) -> Prepared:
    """
    Measure the noise of data, and once more without the upper third of the band if it is it.

    Rows beside reversals count as far as noise covers their friction; where the unit is a misfit,
    they do not: dry friction is what a model gets wrong most, and otherwise in every motion.

    """
    whole = arm.base_parameters(rng)
    prepared = _measured(arm, used, data, whole)
    growth = [floor.growth for floor in prepared.floors if floor.period is not None]
    free = settings.partner is None and settings.signals.decimation is None
    if free and growth and np.max(np.mean(growth, axis=0)) > _GROWTH:
        narrower = thinnable(replace(used, decimation=round(1.5 * used.decimation + 0.1)))
        fewer = trajectories(recordings, narrower)
        if np.all(_informative_share(fewer) >= _MOVING * _informative_share(data)):
            prepared = _measured(arm, narrower, fewer, whole)
    if misfit:
        return prepared
    fuller, _ = with_friction(arm, settings.library)
    uncertain = settings.thresholds.uncertain
    allowed = uncertain * _noise_over_friction(fuller, prepared, rng.spawn(1)[0])
    allowed = np.maximum(allowed, UNSURE)
    wider = [replace(part, allowed=allowed) for part in prepared.data]
    return _measured(arm, prepared.used, wider, whole)


def _informative_share(data: Sequence[Trajectory]) -> FloatArray:
    """Return in what share of the rows each joint moves, shape (n,)."""
    return np.asarray(np.concatenate([part.informative for part in data]).mean(axis=0))


def _measured(
    arm: ArmModel, used: Conditioning, data: Sequence[Trajectory], whole: BaseParameters
) -> Prepared:
    base, _ = excited(arm, whole, data)
    first = [noise_floor(part, arm) for part in data]
    refit = fit(arm, (), data, [floor.sigma for floor in first], base)
    floors = tuple(noise_floor(part, refit.arm) for part in data)
    as_described = tuple((a if a.period else b).sigma for a, b in zip(first, floors, strict=True))
    return Prepared(used, tuple(data), base, floors, as_described)


def _noise_over_friction(
    arm: ArmModel, prepared: Prepared, rng: np.random.Generator
) -> FloatArray:
    """Return the noise of rows over dry friction as a fit tells it, shape (n,)."""
    data, sigma = prepared.data, prepared.sigma
    base, _ = excited(arm, arm.base_parameters(rng), data)
    arm = fit(arm, (), data, sigma, base).arm
    friction = arm.action().dry_friction
    if friction is None:
        return np.full(arm.robot.n_joints, np.inf)
    dry = np.concatenate([friction.largest(arm.load(part.at_rows)) for part in data])
    noise = np.sqrt(np.mean(np.square(sigma), axis=0))
    size = np.sqrt(np.mean(dry**2, axis=0))
    return np.asarray(noise / np.maximum(size, 1e-300))


def mended(
    recordings: Sequence[Recording],
    validate: Sequence[Recording],
    baseline: Sequence[Recording],
    settings: DiagnosisSettings,
) -> tuple[list[Recording], list[Recording], list[Recording], list[str]]:
    """Return recordings without damaged samples, and what reading and mending did to them."""
    notes: list[str] = []
    whole: list[list[Recording]] = []
    for part in (recordings, validate, baseline):
        sound, repairs = without_damage(part, settings.signals) if part else ([], ())
        whole.append(sound)
        harmed_ones = [one for one in part if not one.report.unharmed]
        notes += [f'{one.source}: {one.report.describe()}' for one in harmed_ones]
        notes += map(str, repairs)
    notes += filter(None, [given_twice([*recordings, *baseline], validate)])
    return whole[0], whole[1], whole[2], notes
