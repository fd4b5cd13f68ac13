# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Steps of the demo: the true arm, a hidden change of it, its recordings and its diagnosis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from armid_ros.api.diagnosis import diagnose, DiagnosisResult
from armid_ros.arm import ArmModel
from armid_ros.cli.terminal import progress
from armid_ros.effects import Effect, make_effect, parse_effect
from armid_ros.errors import ModelError
from armid_ros.excitation import ClearanceModel, Excitation, Limits, random_feasible
from armid_ros.files import final_path, load_yaml, read_text
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


def _facts() -> dict[str, Any]:
    found: dict[str, Any] = load_yaml(
        read_text(shipped_path(ROBOT).with_name('demo.yaml'), ModelError)
    )
    return found


def true_arm(robot: Robot) -> ArmModel:
    """Return the simulated arm, with friction and with masses other than described."""
    true = _facts()
    factors = np.array(true['mass_factors'])[:, np.newaxis]
    parameters = robot.rigid_parameters.reshape(-1, 10) * factors
    arm = ArmModel(robot.with_inertias(parameters.ravel()))
    for name, values in true['effects'].items():
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def hidden_change(arm: ArmModel, rng: np.random.Generator, hide: str = '') -> ArmModel:
    """
    Return an arm with an additional last effect, which a diagnosis has to find.

    Parameters
    ----------
    arm : ArmModel
        The arm without the hidden effect.
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
        return arm.with_effect(*parse_effect(hide, arm.robot))
    known = [''.join(text.split()) for text in _facts()['hidden']]
    fitting = [text for text in known if text.startswith(hide)]
    if not fitting:
        names = ', '.join(text.partition(':')[0] for text in known)
        raise ModelError(
            f'--hide {hide}: no shipped change begins with this text; give one of {names}, or any '
            'effect as NAME@joint:quantity=value'
        )
    return arm.with_effect(*parse_effect(str(rng.choice(fitting)), arm.robot))


def diagnose_hidden(
    out: Path,
    changed: ArmModel,
    known: ArmModel,
    baseline: Recording,
    rng: np.random.Generator,
    rate: float,
    origin: ResultOrigin,
) -> DiagnosisResult:
    """
    Record the changed arm over ROS topics, and diagnose the recordings with the known model.

    Parameters
    ----------
    out : Path
        Folder to fill.
    changed : ArmModel
        The arm with the hidden effect, which the page shows as well.
    known : ArmModel
        The model that was identified.
    baseline : Recording
        The recording of its identification.
    rng : numpy.random.Generator
        Draws motions and noise.
    rate : float
        Joint states per second.
    origin : ResultOrigin
        Robot, versions, command and seed for the page.

    """
    limits = Limits.of(known.robot)
    bodies = ClearanceModel.of(collision_model(known.robot))
    recordings = []
    for name in ('after_1', 'after_2', 'held_out'):
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
        recordings.append(replace(recording, source=str(final_path(out / name))))
    with progress('diagnosing') as tick:
        found = diagnose(
            known,
            recordings[:-1],
            validate=recordings[-1:],
            baseline=[baseline],
            rng=rng,
            progress=tick,
        )
        core = replace(found.core, summary=f'{found.core.summary} {outcome(changed, found)}')
        replace(found, core=core).fill(out, origin)
    return found


def outcome(changed: ArmModel, diagnosed: DiagnosisResult) -> str:
    """Return a sentence on the hidden effect and on whether the diagnosis ranked it first."""
    effect = changed.effects[-1]
    parameters = effect.parameters(changed.robot)
    shown = [
        f'{name.name.replace("_", " ")} {digits(float(value), 3)} {pretty(name.unit)}'.rstrip()
        for name, value in zip(parameters, changed.values[-1], strict=True)
        if value
    ]
    where = ', '.join(effect.joints) or 'the whole arm'
    hidden = f'{effect.name.replace("_", " ")} in {where} ({", ".join(shown[:4])})'
    rank = 'found it' if _found(effect, diagnosed) else 'did not rank it first'
    return f'Hidden effect: {hidden}. The diagnosis {rank}.'


def story(changed: ArmModel, diagnosed: DiagnosisResult) -> dict[str, Any]:
    """Return a JSON document with hidden effect, verdict, and whether the verdict is right."""
    effect = changed.effects[-1]
    return {
        'hidden': {
            'name': effect.name,
            'joints': list(effect.joints),
            'values': changed.values[-1].tolist(),
        },
        'verdict': diagnosed.verdict,
        'summary': diagnosed.core.summary,
        'found': _found(effect, diagnosed),
        'gap': diagnosed.document()['gap'],
    }


def _found(effect: Effect, diagnosed: DiagnosisResult) -> bool:
    """Return whether a diagnosis names `effect` first, on the same joints."""
    first = diagnosed.core.findings[:1]
    return any((one.name, one.joints) == (effect.name, effect.joints) for one in first)
