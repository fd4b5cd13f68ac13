# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The job for bags of one kind of arm: model, filters, settings and URL of the results."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
import json
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.fleet.bags import digest
from armid_ros.identification import Conditioning, SignalSettings
from armid_ros.identification.description import kinematics_digest
from armid_ros.identification.fitting.nonlinear import curved
from armid_ros.model import BaseParameters, random_motion
from armid_ros.recording import ReadSettings
import numpy as np

#: Sampling rates that differ by less than this share are treated as equal.
_SAME_RATE = 0.02


@dataclass(frozen=True)
class FleetSettings:
    """
    Settings of the identification of a fleet.

    Attributes
    ----------
    effects : str
        Effects of all arms, unless the table of robots has others.
    gravity : str
        'earth', 'moon' or a vector, unless the table of robots has another value.
    joints : str
        Driven joints, separated by commas; empty for all joints except grippers.
    weighted : bool
        Whether joints are weighted by the standard deviations of their residuals.
    signals : SignalSettings
        Filters; a value of None is chosen from a few bags of each kind of arm, for all days.
    topic : str or None
        Name of the JointState topic.
    resume : bool
        Whether results of earlier runs are reused if bag and settings are the same.
    seed : int
        Seed of the random states with which base parameters are computed.
    reading : ReadSettings
        Settings for checksums and memory.

    """

    effects: str
    gravity: str = 'earth'
    joints: str = ''
    weighted: bool = True
    signals: SignalSettings = field(default_factory=SignalSettings)
    topic: str | None = None
    resume: bool = False
    seed: int = 0
    reading: ReadSettings = field(default_factory=ReadSettings)


def filters_at(filters: Conditioning, rate_hz: float, source: str) -> Conditioning:
    """
    Adapt the filters of a kind of arm to the sampling rate of a recording.

    Raises
    ------
    FleetError
        If the rate is too low for the cut-off.

    """
    if filters.cutoff_hz >= 0.5 * rate_hz:
        raise FleetError(
            f'{source}: {rate_hz:.4g} samples/s are too few for the cut-off of '
            f'{filters.cutoff_hz:.4g} Hz of its arm; set a lower one with --cutoff'
        )
    decimation = filters.decimation
    if abs(rate_hz / filters.rate_hz - 1.0) > _SAME_RATE:
        decimation = max(1, round(rate_hz * filters.decimation / filters.rate_hz))
    return Conditioning(rate_hz, filters.cutoff_hz, decimation)


def filter_facts(filters: Conditioning) -> dict[str, Any]:
    """Return filters as an entry of fleet.json: the arguments of a ``Conditioning``."""
    return {name: getattr(filters, name) for name in ('cutoff_hz', 'decimation', 'rate_hz')}


@dataclass(frozen=True)
class Job:
    """
    Model, filters and settings for bags of one kind of arm.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects.
    theory : BaseParameters
        Parameters that are identifiable with a suitable motion.
    filters : Conditioning
        Filters of all bags of this kind, with cut-off, decimation and sampling rate.
    out : str
        URL of the results.
    run : str
        Name of the run; results of the same run are not computed again.
    settings : FleetSettings
        Settings of the fleet.

    """

    arm: ArmModel
    theory: BaseParameters
    filters: Conditioning
    out: str
    run: str
    settings: FleetSettings

    @cached_property
    def facts(self) -> dict[str, Any]:
        """Return the facts on which results depend, except the bag."""
        robot = self.arm.robot
        return {
            'robot': robot.name,
            'joints': list(robot.joints),
            'kinematics': kinematics_digest(robot),
            'gravity': [float(g) for g in robot.gravity],
            'effects': [[effect.name, list(effect.joints)] for effect in self.arm.effects],
            'weighted': self.settings.weighted,
            'topic': self.settings.topic,
            **filter_facts(self.filters),
        }

    @cached_property
    def digest(self) -> str:
        """Return a hash of the facts."""
        return digest(json.dumps(self.facts, sort_keys=True))

    @property
    def samples(self) -> int:
        """Return the number of samples of a bag that are in memory at once."""
        joints = self.arm.robot.n_joints
        rows = 16_000_000 // (joints * self.theory.rank)  # larger columns are read in pieces
        return min(rows * self.filters.decimation, 1_400_000 // joints)


def require_linear(arm: ArmModel, rng: np.random.Generator) -> None:
    """
    Check that the torque is linear in the parameters of all effects.

    Raises
    ------
    FleetError
        If an effect is nonlinear in its parameters.

    """
    motion = random_motion(arm.robot, rng, 200)
    bare = ArmModel(arm.robot)
    for effect in arm.effects:
        one = bare.with_effect(effect)
        linear = effect.instantaneous and len(one.theta) > len(bare.theta)
        if linear:
            values = np.clip(0.1, *effect.bounds())
            theta = np.concatenate([1.1 * bare.theta, values])
            linear = not curved(one, one.with_theta(theta), [motion])
        if not linear:
            raise FleetError(
                f'--effects {effect.name}: the torque is not linear in its parameters, so bags '
                'cannot be merged; name other effects, and use `armid diagnose` for this one'
            )
