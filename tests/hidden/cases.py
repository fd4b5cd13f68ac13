# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From the specification of a case to its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
import json
from pathlib import Path
from typing import Any

from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin

from tests.hidden.arrays import FloatArray, KnownEffect
from tests.hidden.base import HiddenEffect, Setting
from tests.hidden.machines import drive_size, load_machine, with_rigid_errors
from tests.hidden.plant import Plant, run
from tests.hidden.sensors import Sensors
from tests.hidden.specification import CaseSpec, HIDDEN
from tests.hidden.trajectories import draw_orbit, Orbit, reference, SPEEDS

SIZES = Path(__file__).with_name('sizes.json')

TRAINING, VALIDATION = ('slow', 'medium', 'fast'), ('other',)

#: Below this gap of its worst joint an effect cannot be asked to be named.
VISIBLE = 0.25


@dataclass(frozen=True)
class Bag:
    """
    One recording.

    Attributes
    ----------
    recording : Recording
        What the instruments of the arm recorded.
    periods : tuple of (float, float)
        Beginning and end of each identical period, on the recording's time base [s].
    clean : Recording
        What perfect instruments would have recorded: for judging, not for the diagnosis.

    """

    recording: Recording
    periods: tuple[tuple[float, float], ...]
    clean: Recording


@dataclass(frozen=True)
class Case:
    """
    A set of recordings with effects hidden in it, and the truth about them.

    Attributes
    ----------
    spec : CaseSpec
        What it was made of.
    robot : Robot
        Nominal robot to be given to the diagnosis.
    known : tuple of KnownEffect
        Effects of the nominal model to be given to the diagnosis.
    bags, validation : tuple of Bag
        What the diagnosis may use, and what is kept from it.
    effects : tuple of HiddenEffect
        The truth.
    true_robot : Robot
        With the true rigid parameters, without hidden effects.
    true_known : mapping of str to ndarray, shape (n,)
        True values of the known effects, zero in joints where they are not known.
    size : float
        Excess loss of the worst joint by the largest effect alone, as sizes.json has it.

    """

    spec: CaseSpec
    robot: Robot
    known: tuple[KnownEffect, ...]
    bags: tuple[Bag, ...]
    validation: tuple[Bag, ...]
    effects: tuple[HiddenEffect, ...]
    true_robot: Robot
    true_known: Mapping[str, FloatArray]
    size: float

    @property
    def removed(self) -> tuple[str, ...]:
        """Names to be taken out of the library for this case."""
        if self.spec.kind != 'removed':
            return ()
        limits = [name for effect in self.effects for name in effect.limit_of]
        return (*self.spec.effects, *limits)


@dataclass(frozen=True)
class Draft:
    """A case before it moves: all that was drawn."""

    spec: CaseSpec
    robot: Robot
    known: Mapping[str, FloatArray]
    orbits: Mapping[str, Orbit]
    sensors: Sensors
    effects: tuple[HiddenEffect, ...]


def make_case(spec: CaseSpec) -> Case:
    """Simulate a case; it takes a few seconds."""
    size = _sizes().get(spec.sized_as, {'draw': 0, 'effects': []})
    entries = size['effects']
    if len(entries) != len(spec.effects):
        raise LookupError(f'{spec.key} has no size in {SIZES.name}')
    draft = draw(spec, size['draw'])
    effects = tuple(
        effect.scaled(entry['factor'])
        for effect, entry in zip(draft.effects, entries, strict=True)
    )
    draft = replace(draft, effects=effects)
    robot, known = _nominal(draft)
    return Case(
        spec=spec,
        robot=robot,
        known=known,
        bags=simulate(draft, TRAINING),
        validation=simulate(draft, VALIDATION),
        effects=effects,
        true_robot=draft.robot,
        true_known=draft.known,
        size=max((entry['gap'] for entry in entries), default=0.0),
    )


def draw(spec: CaseSpec, attempt: int = 0) -> Draft:
    """
    Draw motions, drives, instruments and effects of ordinary size.

    Parameters
    ----------
    spec : CaseSpec
        What to draw.
    attempt : int
        Instruments and effects differ from attempt to attempt: not every joint can show a gap
        of every size through all noise.

    """
    robot = load_machine(spec.machine)
    motion_rng, drive_rng = _rng(spec, 0), _rng(spec, 1)
    sensor_rng, effect_rng = _rng(spec, 2, attempt), _rng(spec, 3, attempt)
    orbits = {speed: draw_orbit(robot, speed, motion_rng) for speed in (*TRAINING, *VALIDATION)}
    known = _draw_drives(robot, drive_rng, spec.bare)
    setting = _setting(robot, known, [orbits[speed] for speed in TRAINING])
    effects = _draw_effects(spec, setting, effect_rng)
    for effect in effects:
        for name in effect.replaces:
            for joint in effect.joints if name in known else ():
                known[name][robot.index(joint)] = 0.0
    sensors = Sensors.draw(setting.torque, setting.strength, sensor_rng, spec.noise)
    return Draft(spec, robot, known, orbits, sensors, effects)


def simulate(draft: Draft, speeds: Sequence[str]) -> tuple[Bag, ...]:
    """Run an arm through its motions and record it."""
    dt = min([1e-3, *(effect.dt for effect in draft.effects)])
    plant = Plant(draft.robot, draft.known, draft.effects, dt)
    bags = []
    for speed in speeds:
        wanted = reference(draft.orbits[speed], dt)
        signals = run(plant, wanted, _rng(draft.spec, 4))
        spans = tuple((start, start + wanted.period) for start in wanted.starts)
        joints = draft.robot.joints
        noise_rng = _rng(draft.spec, 5, list(SPEEDS).index(speed))
        recording = draft.sensors.record(signals, joints, noise_rng)
        bags.append(Bag(recording, spans, draft.sensors.perfect(signals, joints)))
    return tuple(bags)


@cache
def _sizes() -> dict[str, dict[str, Any]]:
    return json.loads(SIZES.read_text()) if SIZES.exists() else {}


def _rng(spec: CaseSpec, *purpose: int) -> np.random.Generator:
    return np.random.default_rng([spec.seed, *purpose])


def _draw_drives(robot: Robot, rng: np.random.Generator, bare: bool) -> dict[str, FloatArray]:
    drive, n = drive_size(robot), robot.n_joints
    rotor = 1e-3 * drive * rng.uniform(0.5, 1.5, n)
    if bare:
        return {'rotor_inertia': rotor}
    return {
        'viscous_friction': 0.02 * drive / robot.velocity_limit * rng.uniform(0.5, 1.5, n),
        'coulomb_friction': 0.02 * drive * rng.uniform(0.5, 1.5, n),
        'rotor_inertia': rotor,
    }


def _draw_effects(
    spec: CaseSpec, setting: Setting, rng: np.random.Generator
) -> tuple[HiddenEffect, ...]:
    """Draw the effects, each in joints of its own."""
    effects: list[HiddenEffect] = []
    for name in spec.effects:
        taken = {joint for effect in effects for joint in effect.joints}
        for _ in range(1000):
            effect = HIDDEN[name].draw(setting, rng)
            if not taken & set(effect.joints):
                break
        else:
            raise RuntimeError(f'{spec.key}: no joint is free for {name}')
        effects.append(effect)
    return tuple(effects)


def _setting(robot: Robot, known: Mapping[str, FloatArray], orbits: Sequence[Orbit]) -> Setting:
    states = [orbit.at(np.linspace(0.0, orbit.period, 120)) for orbit in orbits]
    q, dq, ddq = (np.concatenate(parts) for parts in zip(*states, strict=True))
    data = robot.model.createData()
    torque = np.array([pin.rnea(robot.model, data, *row) for row in zip(q, dq, ddq, strict=True)])
    zero = np.zeros(robot.n_joints)
    friction = known.get('viscous_friction', zero) * dq
    friction = friction + known.get('coulomb_friction', zero) * np.sign(dq)
    return Setting(
        robot=robot,
        strength=drive_size(robot),
        low=q.min(axis=0),
        high=q.max(axis=0),
        speed=np.abs(dq).max(axis=0),
        torque=np.sqrt((torque**2).mean(axis=0)),
        peak=np.abs(torque + friction + known['rotor_inertia'] * ddq).max(axis=0),
        postures=q,
    )


def _nominal(draft: Draft) -> tuple[Robot, tuple[KnownEffect, ...]]:
    """Return what the diagnosis is given: the truth, or all of it off by 3 to 10 per cent."""
    rng = _rng(draft.spec, 6)
    exact = draft.spec.exact
    robot = draft.robot if exact else with_rigid_errors(draft.robot, rng)
    known = []
    for name, values in draft.known.items():
        error = rng.choice([-1.0, 1.0], len(values)) * rng.uniform(0.03, 0.1, len(values))
        nominal = values if exact else values * (1.0 + error)
        there = np.flatnonzero(values)
        joints = tuple(robot.joints[j] for j in there)
        known.append(KnownEffect(name, joints, nominal[there]))
    return robot, tuple(known)
