# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arm of the demo: true values, sensors, runs over topics, and a hidden change."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armid_ros.api.diagnosis import diagnose, DiagnosisResult
from armid_ros.arm import ArmModel
from armid_ros.cli.terminal import progress, say
from armid_ros.effects import Effect, make_effect, parse_effect
from armid_ros.errors import ModelError
from armid_ros.excitation import ClearanceModel, Excitation, Limits, random_feasible
from armid_ros.files import load_yaml, read_text, settled
from armid_ros.motion import FloatArray
from armid_ros.nodes.lockstep import run_lockstep
from armid_ros.recording import read_recording, Recording
from armid_ros.report.notation import digits, pretty
from armid_ros.report.provenance import ResultOrigin
from armid_ros.robots import collision_model, Robot
from armid_ros.robots.load import shipped_path
from armid_ros.simulation import Sensors, SimulatedArm
import numpy as np

ROBOT = 'humanoid_arm'
SENSORS = Sensors(
    torque_noise=np.array([0.02, 0.02, 0.01, 0.01, 0.004, 0.004]), resolution=2.0 * np.pi / 2**18
)
_RUNS = ('after_1', 'after_2', 'held_out')


def _facts() -> dict[str, Any]:
    found: dict[str, Any] = load_yaml(
        read_text(shipped_path(ROBOT).with_name('demo.yaml'), ModelError)
    )
    return found


def true_arm(robot: Robot) -> ArmModel:
    """Return the arm to identify, with friction and with other masses than described."""
    true = _facts()
    factors = np.array(true['mass_factors'])[:, np.newaxis]
    parameters = robot.rigid_parameters.reshape(-1, 10) * factors
    arm = ArmModel(robot.with_inertias(parameters.ravel()))
    for name, values in true['effects'].items():
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def hidden_change(robot: Robot, rng: np.random.Generator, hide: str = '') -> HiddenChange:
    """
    Return the hidden effect.

    Parameters
    ----------
    robot : Robot
        The shipped arm.
    rng : numpy.random.Generator
        Draws one of the changes that are shipped.
    hide : str
        Beginning of 'effect@joint' of a shipped change; or any effect with its values, as for
        ``armid simulate``.

    Raises
    ------
    ModelError
        If no shipped change begins with the text, and the text has no values of an effect.

    """
    if ':' in hide:
        return HiddenChange(*parse_effect(hide, robot))
    known = [''.join(text.split()) for text in _facts()['hidden']]
    fitting = [text for text in known if text.startswith(hide)]
    if not fitting:
        names = ', '.join(text.partition(':')[0] for text in known)
        raise ModelError(f'--hide {hide}: give an effect as E@joint:k=v, or one of {names}')
    return HiddenChange(*parse_effect(str(rng.choice(fitting)), robot))


@dataclass(frozen=True)
class HiddenChange:
    """
    Effect of the arm that its model lacks.

    Attributes
    ----------
    effect : Effect
        The effect, with its joint.
    values : ndarray, shape (P,)
        Its parameters.

    """

    effect: Effect
    values: FloatArray

    def found_by(self, diagnosed: DiagnosisResult) -> bool:
        """Return whether the first finding is the hidden effect, on the same joints."""
        first = diagnosed.core.findings[:1]
        named = self.effect.name, self.effect.joints
        return any((one.name, one.joints) == named for one in first)

    def outcome(self, diagnosed: DiagnosisResult) -> str:
        """Return a sentence on the hidden change, and whether it was found."""
        parameters = self.effect.parameters(diagnosed.arm.robot)
        shown = [
            f'{name.name.replace("_", " ")} {digits(float(value), 3)} {pretty(name.unit)}'.rstrip()
            for name, value in zip(parameters, self.values, strict=True)
            if value
        ]
        where = ', '.join(self.effect.joints) or 'the whole arm'
        hidden = f'{self.effect.name.replace("_", " ")} in {where} ({", ".join(shown[:4])})'
        rank = 'found it' if self.found_by(diagnosed) else 'did not rank it first'
        return f'Hidden effect: {hidden}. The diagnosis {rank}.'

    def document(self, diagnosed: DiagnosisResult) -> dict[str, Any]:
        """Return the hidden effect, the verdict and whether it was found, for JSON."""
        return {
            'hidden': {
                'name': self.effect.name,
                'joints': list(self.effect.joints),
                'values': self.values.tolist(),
            },
            'verdict': diagnosed.verdict,
            'summary': diagnosed.core.summary,
            'found': self.found_by(diagnosed),
            'gap': diagnosed.document()['gap'],
        }


def diagnose_hidden(
    out: Path,
    hidden: HiddenChange,
    truth: ArmModel,
    known: ArmModel,
    baseline: Recording,
    rng: np.random.Generator,
    rate: float,
) -> DiagnosisResult:
    """
    Record a changed arm over topics, and diagnose it with the model from before.

    Parameters
    ----------
    out : Path
        Folder to fill.
    hidden : HiddenChange
        The hidden effect, which the page shows as well.
    truth : ArmModel
        The arm without it.
    known : ArmModel
        The model that was identified.
    baseline : Recording
        The recording of its identification.
    rng : numpy.random.Generator
        Draws motions and noise.
    rate : float
        Joint states per second.

    """
    limits = Limits.of(known.robot)
    bodies = ClearanceModel.of(collision_model(known.robot))
    changed = truth.with_effect(hidden.effect, hidden.values)

    def recorded(name: str) -> Recording:
        # a period of 8 s with 5 harmonics
        drawn = random_feasible(known, limits, 8.0, 5, rng, clearance=bodies)
        plant = SimulatedArm(changed, rng=rng, sensors=SENSORS)
        with progress(f'recording {name}') as tick:
            run_lockstep(
                plant,
                Excitation(drawn, 2, 1.0),
                out / name,
                rate=rate,
                on_progress=lambda now: tick(now.t / now.duration),
            )
        recording = read_recording(out / name, joints=known.robot.joints)
        return replace(recording, source=str(settled(out / name)))

    recordings = [recorded(name) for name in _RUNS]
    with progress('diagnosing') as tick:
        found = diagnose(
            known,
            recordings[:-1],
            validate=recordings[-1:],
            baseline=[baseline],
            rng=rng,
            progress=tick,
        )
        core = replace(found.core, summary=f'{found.core.summary} {hidden.outcome(found)}')
        replace(found, core=core).fill(out, ResultOrigin(known.robot.name, known.robot.name))
    return found


def show_hidden(hidden: HiddenChange, found: DiagnosisResult) -> None:
    """Print the diagnosis, the held-out error before and after, and the hidden effect."""
    say('Then a change was hidden in the arm, and three runs were recorded. Diagnosis of two:')
    say(pretty(f'{found.verdict.replace("_", " ").upper()}: {found.core.summary}'))
    gap = found.core.gap
    if gap is not None:
        worst = int(np.argmax(gap.chi2_before))
        say(
            f'Held-out run: the error of {found.arm.robot.joints[worst]} is '
            f'{digits(float(gap.before[worst]))} N m, and {digits(float(gap.after[worst]))} N m '
            'with the named effect.'
        )
    say(hidden.outcome(found))
