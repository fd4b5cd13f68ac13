# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The job of the bags of one kind of arm: model, filters, settings, and place of results."""

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

#: Rates that differ by less than this share are one rate.
_SAME_RATE = 0.02
#: Numbers of the columns of one piece of a bag; larger ones are read in several pieces.
_MOST_NUMBERS = 16_000_000
#: Full-rate samples of a piece, times joints.
_MOST_SAMPLES = 1_400_000


@dataclass(frozen=True)
class FleetSettings:
    """
    How a fleet is identified.

    Attributes
    ----------
    effects : str
        Of all arms, unless the table of robots has others.
    gravity : str
        'earth', 'moon' or a vector, unless the table of robots has another.
    joints : str
        Driven joints with commas; empty for all but grippers.
    weighted : bool
        Whether joints are weighted by their residuals.
    signals : SignalSettings
        Filters; what is None is chosen from a few bags of each kind of arm, once for all days.
    topic : str or None
        JointState topic.
    resume : bool
        Whether results of earlier runs count where bag and settings are the same.
    seed : int
        Of the states over which base parameters are found.
    reading : ReadSettings
        Checksums and memory.

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
    Return the filters of a kind of arm for a recording of some rate, with rows as often.

    Raises
    ------
    FleetError
        The rate is too low for the cut-off.

    """
    if filters.cutoff_hz >= 0.5 * rate_hz:
        raise FleetError(
            f'{source}: {rate_hz:.4g} samples/s are too few for the cut-off of '
            f'{filters.cutoff_hz:.4g} Hz of its arm; name a lower one with --cutoff'
        )
    decimation = filters.decimation
    if abs(rate_hz / filters.rate_hz - 1.0) > _SAME_RATE:
        decimation = max(1, round(rate_hz * filters.decimation / filters.rate_hz))
    return Conditioning(rate_hz, filters.cutoff_hz, decimation)


def filter_facts(filters: Conditioning) -> dict[str, Any]:
    """Return filters as fleet.json has them; they are the arguments of a ``Conditioning``."""
    return {name: getattr(filters, name) for name in ('cutoff_hz', 'decimation', 'rate_hz')}


@dataclass(frozen=True)
class Job:
    """
    How bags of one kind of arm are treated.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects.
    theory : BaseParameters
        What is identifiable with any motion.
    filters : Conditioning
        Of all its bags, whenever they were recorded; one row for so many samples of its rate.
    out : str
        URL of the results.
    run : str
        Name of the run; what it has written itself it does not make again.
    settings : FleetSettings
        Of the fleet.

    """

    arm: ArmModel
    theory: BaseParameters
    filters: Conditioning
    out: str
    run: str
    settings: FleetSettings

    @cached_property
    def facts(self) -> dict[str, Any]:
        """Return what results depend on, other than the bag."""
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
        """Return a name for the settings."""
        return digest(json.dumps(self.facts, sort_keys=True))

    @property
    def samples(self) -> int:
        """Return the samples of a bag that are in memory at once."""
        joints = self.arm.robot.n_joints
        rows = _MOST_NUMBERS // (joints * self.theory.rank)
        return min(rows * self.filters.decimation, _MOST_SAMPLES // joints)


def require_linear(arm: ArmModel, rng: np.random.Generator) -> None:
    """
    Refuse effects that make the torque not linear in the parameters.

    Raises
    ------
    FleetError
        Naming them, and what to do.

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
                'cannot be merged with it; name others, and look for it with `armid diagnose`'
            )
