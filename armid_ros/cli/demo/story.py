# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The story that the demo ends with: something is hidden in the arm, and found.

What is hidden is drawn, and not told. The arm is recorded over topics, diagnosed with the model
that was identified before, and the patched model predicts a run that was not used. Then it is
revealed.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armid_ros.api.diagnosis import diagnose
from armid_ros.api.table import ResultOrigin
from armid_ros.arm import ArmModel
from armid_ros.cli.terminal import progress, say
from armid_ros.diagnosis import Diagnosis
from armid_ros.effects import CATALOGUE, Effect, make_effect, parse_effect
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.files import settled
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import read_recording, Recording
from armid_ros.report.notation import digits, pretty
from armid_ros.robots import collision_model
from armid_ros.simulation import Sensors, SimulatedArm
import numpy as np

#: Torque of what is hidden over that of its joint, both root mean square: seen by an engineer who
#: looks at the curves, and not by one who looks at the arm.
_SIZE = (0.15, 0.4)
#: Of a body its mass over that of the link, and how far from the joint its centre is [m].
_MASS, _REACH = (0.4, 0.8), 0.06
#: A run: seconds of a period, and harmonics.
_PERIOD, _HARMONICS = 8.0, 5
_RATE = 100.0
#: Draws until one shows.
_DRAWS = 50
_RUNS = ('after_1', 'after_2', 'unused')
#: Values of the hidden effect that are printed.
_SHOWN = 4


@dataclass(frozen=True)
class Hidden:
    """
    What the arm has and its model has not.

    Attributes
    ----------
    effect : Effect
        The effect, with its joint.
    values : ndarray, shape (P,)
        Its parameters.

    """

    effect: Effect
    values: FloatArray

    def sentence(self, arm: ArmModel) -> str:
        """Return effect, joint and the largest values that are not zero."""
        names = self.effect.parameters(arm.robot)
        shown = [
            f'{name.name.replace("_", " ")} {digits(float(value), 3)} {pretty(name.unit)}'.rstrip()
            for name, value in zip(names, self.values, strict=True)
            if value
        ]
        where = ', '.join(self.effect.joints) or 'the whole arm'
        return f'{self.effect.name.replace("_", " ")} in {where} ({", ".join(shown[:_SHOWN])})'


@dataclass(frozen=True)
class ToldStory:
    """
    A story with its end.

    Attributes
    ----------
    hidden : Hidden
        What was hidden.
    diagnosis : Diagnosis
        What was found.

    """

    hidden: Hidden
    diagnosis: Diagnosis

    @property
    def found(self) -> bool:
        """Whether the first name is that of what was hidden, and its joint."""
        effect = self.hidden.effect
        first = self.diagnosis.findings[:1]
        return any(one.name == effect.name and one.joints == effect.joints for one in first)

    def document(self) -> dict[str, Any]:
        """Return the story for programs to read."""
        gap = self.diagnosis.gap
        joints = self.diagnosis.arm.robot.joints
        return {
            'hidden': {
                'name': self.hidden.effect.name,
                'joints': list(self.hidden.effect.joints),
                'values': self.hidden.values.tolist(),
            },
            'verdict': self.diagnosis.verdict,
            'summary': self.diagnosis.summary,
            'found': self.found,
            'gap': None
            if gap is None
            else {
                'before': dict(zip(joints, gap.before.tolist(), strict=True)),
                'after': dict(zip(joints, gap.after.tolist(), strict=True)),
            },
        }


def tell_story(
    out: Path,
    truth: ArmModel,
    known: ArmModel,
    baseline: Recording,
    *,
    sensors: Sensors,
    rng: np.random.Generator,
    hide: str = '',
    rate: float = 200.0,
) -> ToldStory:
    """
    Hide something in an arm, record it over topics, and diagnose it.

    Parameters
    ----------
    out : Path
        Folder to fill.
    truth : ArmModel
        The arm as it was when it was identified.
    known : ArmModel
        The model that was identified.
    baseline : Recording
        What it was identified from.
    sensors : Sensors
        What the arm measures with.
    rng : numpy.random.Generator
        Draws motions and noise, and what is hidden.
    hide : str
        What to hide, with the joint if it is not to be drawn, such as
        'stribeck_friction@elbow_pitch', and with values if these are not, as for simulate.
    rate : float
        Joint states per second.

    """
    runs = _excitations(known, rng)
    hidden = draw_hidden(truth, runs[0].motion(_RATE), rng, hide)
    changed = truth.with_effect(hidden.effect, hidden.values)
    recordings = []
    for name, run in zip(_RUNS, runs, strict=True):
        recordings.append(_recorded(out / name, changed, run, sensors, rng, rate))
    with progress('diagnosing') as tick:
        found = diagnose(
            known,
            recordings[:-1],
            validate=recordings[-1:],
            baseline=[baseline],
            rng=rng,
            progress=tick,
        )
        robot = known.robot.name
        found.fill(out, ResultOrigin(robot, robot))
    return ToldStory(hidden, found.core)


def show_story(told: ToldStory) -> None:
    """Print the diagnosis, what it did for the held-out run, and what was hidden."""
    found = told.diagnosis
    say('Then a change was hidden in the arm, and three runs were recorded. Diagnosis of two:')
    say(f'{found.verdict.replace("_", " ").upper()}: {found.summary}')
    gap, arm = found.gap, found.arm
    if gap is not None:
        worst = int(np.argmax(gap.chi2_before))
        say(
            f'Held-out run: the error of {arm.robot.joints[worst]} is '
            f'{digits(float(gap.before[worst]))} N m, and {digits(float(gap.after[worst]))} N m '
            'with the named effect.'
        )
    rank = 'The diagnosis found it.' if told.found else 'The diagnosis did not rank it first.'
    say(f'Hidden was: {told.hidden.sentence(arm)}. {rank}')


def draw_hidden(
    arm: ArmModel, motion: Motion, rng: np.random.Generator, asked: str = ''
) -> Hidden:
    """
    Draw what is hidden: effect, joint, and values that make a torque one can see.

    Parameters
    ----------
    arm : ArmModel
        The arm.
    motion : Motion
        What the arm will do, by which the torque is measured.
    rng : numpy.random.Generator
        Draws.
    asked : str
        What is not to be drawn: see `tell_story`.

    """
    if ':' in asked:
        effect, values = parse_effect(asked, arm.robot)
        return Hidden(effect, values)
    for _ in range(_DRAWS):
        hidden = _drawn(arm, motion, rng, asked)
        if _shows(arm, hidden, motion) or '@' in asked:
            break
    return hidden


def _drawn(arm: ArmModel, motion: Motion, rng: np.random.Generator, asked: str) -> Hidden:
    head, at, joints = asked.partition('@')
    name = head or str(rng.choice([n for n, kind in CATALOGUE.items() if kind.traits.familiar]))
    effect = make_effect(f'{name}@{joints}' if at else name, arm.robot)
    if not at and len(effect.joints) > 1:
        effect = make_effect(f'{name}@{rng.choice(effect.joints)}', arm.robot)
    if effect.adds_to(arm.robot):
        return Hidden(effect, _body(arm, effect, rng))
    return Hidden(effect, _sized(arm, effect, motion, rng))


def _shows(arm: ArmModel, hidden: Hidden, motion: Motion) -> bool:
    """Return whether the torque of some joint changes by as much as one can see."""
    whole = arm.torque(motion)
    change = arm.with_effect(hidden.effect, hidden.values).torque(motion) - whole
    share = np.sqrt(np.mean(change**2, axis=0) / np.mean(whole**2, axis=0))
    return bool(share.max() > 0.9 * _SIZE[0])


def _body(arm: ArmModel, effect: Effect, rng: np.random.Generator) -> FloatArray:
    """Return a ball on the axis from a joint to the centre of mass of its link."""
    body = arm.robot.joints.index(effect.joints[0])
    rigid = arm.robot.rigid_parameters.reshape(-1, 10)[body]
    mass = float(rigid[0] * rng.uniform(*_MASS))
    lever = rigid[1:4] / rigid[0]
    centre = lever + _REACH * lever / max(float(np.linalg.norm(lever)), 1e-9)
    inertia = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    rows = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return np.array([mass, *(mass * centre), *rows])


def _sized(arm: ArmModel, effect: Effect, motion: Motion, rng: np.random.Generator) -> FloatArray:
    """Return values whose torque is a share of that of the joints along a motion."""
    columns = arm.columns_of(effect, motion)
    lower, _ = effect.bounds()
    sign = np.where(lower >= 0.0, 1.0, rng.choice([-1.0, 1.0], len(lower)))
    alone = np.sqrt(np.mean(columns**2, axis=(0, 1)))
    direction = sign / np.maximum(alone, 1e-12)
    own = np.sqrt(np.mean((columns @ direction) ** 2, axis=0))
    joints = effect.indices(arm.robot.joints) or list(range(arm.robot.n_joints))
    whole = np.sqrt(np.mean(arm.torque(motion) ** 2, axis=0))
    share = rng.uniform(*_SIZE)
    size = share * min(float(whole[j] / own[j]) for j in joints if own[j] > 0.0)
    most = np.array([q.typical[1] if q.typical else np.inf for q in effect.quantities])
    values = np.clip(size * direction, -most, most)
    return np.asarray(np.clip(values, *effect.bounds()))


def _excitations(arm: ArmModel, rng: np.random.Generator) -> list[Excitation]:
    limits = Limits.of(arm.robot)
    bodies = collision_model(arm.robot)
    with progress('drawing motions') as tick:
        runs = []
        for number in range(len(_RUNS)):
            drawn = random_feasible(arm, limits, _PERIOD, _HARMONICS, rng, collision=bodies)
            runs.append(Excitation(drawn, 2, 1.0))
            tick((number + 1) / len(_RUNS))
    return runs


def _recorded(
    bag: Path,
    arm: ArmModel,
    run: Excitation,
    sensors: Sensors,
    rng: np.random.Generator,
    rate: float,
) -> Recording:
    """Run an arm over topics, and read what was recorded."""
    from armid_ros.nodes.lockstep import record_lockstep

    with progress(f'recording {bag.name}') as tick:
        record_lockstep(
            SimulatedArm(arm, rng=rng, sensors=sensors), run, bag, rate=rate, on_progress=tick
        )
    return replace(read_recording(bag, joints=arm.robot.joints), source=str(settled(bag)))
