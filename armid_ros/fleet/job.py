# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked of the bags of one kind of arm: the model, the filters, and where results go."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import cached_property
import hashlib
import json
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.identification import Conditioning
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
class Filters:
    """
    Filters that all bags of one kind of arm go through, whenever they were recorded.

    Attributes
    ----------
    cutoff_hz : float
        Cut-off of the position filter [Hz].
    decimation : int
        One row for so many samples ...
    rate_hz : float
        ... of this rate [Hz].

    """

    cutoff_hz: float
    decimation: int
    rate_hz: float

    def at(self, rate_hz: float, source: str) -> Conditioning:
        """
        Return the filters for a recording of some rate, with rows as often.

        Raises
        ------
        FleetError
            The rate is too low for the cut-off.

        """
        if self.cutoff_hz >= 0.5 * rate_hz:
            raise FleetError(
                f'{source}: {rate_hz:.4g} samples/s are too few for the cut-off of '
                f'{self.cutoff_hz:.4g} Hz of its arm; name a lower one with --cutoff'
            )
        decimation = self.decimation
        if abs(rate_hz / self.rate_hz - 1.0) > _SAME_RATE:
            decimation = max(1, round(rate_hz * self.decimation / self.rate_hz))
        return Conditioning(rate_hz, self.cutoff_hz, decimation)


@dataclass(frozen=True)
class Job:
    """
    How bags of one kind of arm are treated.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects.
    theory : BaseParameters
        What any motion of it can tell apart.
    filters : Filters
        Of all its bags.
    out : str
        URL of the results.
    run : str
        Name of the run; what it has written itself it does not make again.
    weighted : bool
        Whether joints are weighted by their residuals.
    topic : str or None
        JointState topic.
    resume : bool
        Whether results of earlier runs count where bag and settings are the same.
    reading : ReadSettings
        Checksums and memory.

    """

    arm: ArmModel
    theory: BaseParameters
    filters: Filters
    out: str
    run: str
    weighted: bool = True
    topic: str | None = None
    resume: bool = False
    reading: ReadSettings = field(default_factory=ReadSettings)

    @cached_property
    def settings(self) -> dict[str, Any]:
        """Return what results depend on, other than the bag."""
        robot = self.arm.robot
        return {
            'robot': robot.name,
            'joints': list(robot.joints),
            'kinematics': kinematics_digest(robot),
            'gravity': [float(g) for g in robot.gravity],
            'effects': [[effect.name, list(effect.joints)] for effect in self.arm.effects],
            'weighted': self.weighted,
            'topic': self.topic,
            **asdict(self.filters),
        }

    @cached_property
    def digest(self) -> str:
        """Return a name for the settings."""
        text = json.dumps(self.settings, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

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
        size = len(one.theta) - len(bare.theta)
        if not effect.instantaneous or size == 0:
            raise FleetError(_refusal(effect.name))
        lower, upper = effect.bounds()
        values = np.clip(0.1, lower, upper)
        theta = np.concatenate([1.1 * bare.theta, values])
        if curved(one, one.with_theta(theta), [motion]):
            raise FleetError(_refusal(effect.name))


def _refusal(name: str) -> str:
    return (
        f'--effects {name}: the torque is not linear in its parameters, so bags cannot be merged '
        'with it; name others, and look for it with `armid diagnose`'
    )
