# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Preparation of recordings: repair of damaged samples, choice of filters, and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import excited_parameters, refitted_arm
from armid_ros.diagnosis.data.evidence import noise_floor, NoiseFloor
from armid_ros.diagnosis.data.trajectory import MAX_UNCERTAIN_SHARE, thinnable, Trajectory
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.identification.fitting.held_out import cutoff_of_torques
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.signals import Conditioning, conditioning, MODEL_BANDS
from armid_ros.identification.ties.recorded import band_of_motion
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import given_twice, Recording
import numpy as np

#: Band of the rows, divided by the band of the motion. An identification uses a factor of ten,
#: but the upper part is mostly noise, which would hide a gap.
_ROW_BAND_RATIO = 6.0
#: Pass band, with a partner, divided by the band in which the motion exceeds the noise of
#: angles. Above, noise dominates, and a fit would reduce inertias to fit the noise of
#: accelerations.
_PARTNER_BAND_RATIO = 1.25


@dataclass(frozen=True)
class Prepared:
    """
    Filtered recordings of a diagnosis, with their measured torque noise.

    Attributes
    ----------
    used : Conditioning
        Filters and decimation.
    data : tuple of Trajectory
        The filtered recordings.
    floors : tuple of NoiseFloor
        Torque noise of each trajectory.

    """

    used: Conditioning
    data: tuple[Trajectory, ...]
    floors: tuple[NoiseFloor, ...]

    @property
    def allowed(self) -> FloatArray:
        """Largest share of uncertain velocity signs in a regression row that is used, (n,)."""
        return self.data[0].allowed

    @property
    def sigma(self) -> list[FloatArray]:
        """Standard deviation of the torque noise of each trajectory, shape (n,) [N m]."""
        return [floor.sigma for floor in self.floors]


def choose_filters(
    arm: ArmModel,
    recordings: Sequence[Recording],
    baseline: Sequence[Recording],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> Conditioning:
    """
    Choose cut-off and decimation as an identification does, but with fewer rows.

    The cut-off is chosen from the baseline, if any, as the baseline has no missing effect.

    """
    used = conditioning([*recordings, *baseline], settings.signals)
    if settings.partner is not None:
        return band_of_motion(recordings, used, settings.signals, _PARTNER_BAND_RATIO)
    if settings.signals.cutoff_hz is None:
        fuller, _ = with_friction(arm, settings.library)
        independent = fuller.base_parameters(rng).independent
        used = cutoff_of_torques(fuller, independent, baseline or recordings, used)
    if settings.signals.decimation is not None:
        return used
    band = used.rate_hz / (2.5 * MODEL_BANDS * used.decimation)
    wide = replace(used, decimation=max(1, int(used.rate_hz / (2.5 * _ROW_BAND_RATIO * band))))
    return thinnable(wide)


def prepare(
    arm: ArmModel,
    used: Conditioning,
    data: Sequence[Trajectory],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    misfit: bool = False,
) -> Prepared:
    """
    Measure the torque noise of trajectories, and decide which rows near reversals are used.

    Rows next to reversals are used if their noise exceeds the error of dry friction. They are not
    used if the floor is a misfit: dry friction is then the largest error of a model, and it
    differs between motions.

    """
    theory = arm.base_parameters(rng)
    prepared = _measured(arm, used, data, theory)
    if misfit:
        return prepared
    fuller, _ = with_friction(arm, settings.library)
    base, _ = excited_parameters(fuller, fuller.base_parameters(rng.spawn(1)[0]), data)
    fuller = refitted_arm(fuller, base, data, prepared.sigma)
    friction = fuller.action().dry_friction
    allowed = np.full(arm.robot.n_joints, np.inf)
    if friction is not None:
        dry = np.concatenate([friction.largest(fuller.load(part.at_rows)) for part in data])
        size = np.maximum(np.sqrt(np.mean(dry**2, axis=0)), 1e-300)
        noise = np.sqrt(np.mean(np.square(prepared.sigma), axis=0))
        allowed = np.maximum(settings.thresholds.uncertain * noise / size, MAX_UNCERTAIN_SHARE)
    return _measured(arm, used, [replace(part, allowed=allowed) for part in data], theory)


def with_friction(arm: ArmModel, library: Sequence[str]) -> tuple[ArmModel, tuple[Effect, ...]]:
    """Add missing friction and offsets to an arm; return the arm and the added effects."""
    there = {(effect.name, joint) for effect in arm.effects for joint in effect.joints}
    added: list[Effect] = []
    fuller = arm
    for kind in CATALOGUE.values():
        joints = tuple(j for j in arm.robot.joints if (kind.name, j) not in there)
        if kind.traits.usual and kind.name in library and joints:
            fuller = fuller.with_effect(kind.on(arm.robot, joints))
            added += [kind.on(arm.robot, (joint,)) for joint in joints]
    return fuller, tuple(added)


def _measured(
    arm: ArmModel, used: Conditioning, data: Sequence[Trajectory], theory: BaseParameters
) -> Prepared:
    """Measure the noise in the residual of the given arm, and again after a refit."""
    base, _ = excited_parameters(arm, theory, data)
    refit = refitted_arm(arm, base, data, [noise_floor(part, arm).sigma for part in data])
    return Prepared(used, tuple(data), tuple(noise_floor(part, refit) for part in data))


def repaired(
    recordings: Sequence[Recording],
    validate: Sequence[Recording],
    baseline: Sequence[Recording],
    settings: DiagnosisSettings,
) -> tuple[list[Recording], list[Recording], list[Recording], list[str]]:
    """Remove damaged samples; return the repaired recordings, with notes on each damage."""
    notes: list[str] = []
    whole: list[list[Recording]] = []
    for part in (recordings, validate, baseline):
        used = conditioning(part, settings.signals) if part else None
        sound, repairs = without_damage(part, used) if used else ([], ())
        whole.append(sound)
        notes += [f'{x.source}: {x.report.describe()}' for x in part if not x.report.unharmed]
        notes += repairs
    if again := given_twice([*recordings, *baseline], validate):
        notes += [f'recordings are given twice, or in two roles: {again}']
    return whole[0], whole[1], whole[2], notes
