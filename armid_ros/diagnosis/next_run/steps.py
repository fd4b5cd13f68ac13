# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Advice to the user after a diagnosis: parts to inspect, and motions to record."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from armid_ros.diagnosis.next_run.plan import NextRun
from armid_ros.diagnosis.search.explanation import OWN_MISFIT
from armid_ros.diagnosis.verdict.finding import Diagnosis, Finding, Rival
from armid_ros.effects import CATALOGUE
from armid_ros.estimate import name_in_words
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH

#: Location of the patched model, in words.
MODEL = 'model.yaml in the folder of this diagnosis'


def next_steps(
    diagnosis: Diagnosis,
    run: NextRun | None = None,
    no_run: str = '',
    model: str = MODEL,
    worse: Sequence[str] = (),
    learned: bool = False,
    simulated: bool = False,
) -> list[str]:
    """
    Return sentences on what to inspect, what to record next, and how to use the model.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    run : NextRun or None
        The planned run.
    no_run : str
        Reason why no run was planned; empty if none was requested.
    model : str
        Location of the patched model, in words.
    worse : sequence of str
        Joints in which a simulation with the patched model has a larger error than before.
    learned : bool
        Whether the unexplained torque has been learned.
    simulated : bool
        Whether the model was identified from a simulator, which has no baseline.

    """
    findings, verdict = diagnosis.findings, diagnosis.verdict
    inspections = (text for one in findings for text in _inspections(one, diagnosis))
    steps = list(dict.fromkeys(inspections))
    if verdict == 'bad_data':
        steps.append(
            'Check the recording with armid inspect. Correct it or the description, and '
            'diagnose again.'
        )
    if diagnosis.contradicted:
        steps.append('With --validate, give only recordings since the change, and diagnose again.')
    elif verdict in ('unknown', 'partial'):
        steps += [f'Look for a cause at {w.joint}: {w.signature}.' for w in diagnosis.left]
        option = '' if learned else '--residual gp, which learns that torque as a map'
        if diagnosis.baseline != OWN_MISFIT and not simulated:
            option = '--baseline BAG, a recording from before'
        if option:
            steps[-1:] = [f'{" ".join(steps[-1:])} Run armid diagnose with {option}.'.lstrip()]
    if verdict == 'not_repeatable':
        steps.append('Keep people and loose parts away from the arm, and record again.')
    motions = [run.sentence] if run else []
    separated = () if run is None else [(s.name, s.rival) for s in run.separations if s.distinct]
    motions += [
        one.experiment
        for one in findings
        if one.other_causes and (one.name, one.other_causes[0].name) not in separated
    ]
    motions += [f'{no_run[0].upper()}{no_run[1:]}.'] if no_run else []
    steps = [*motions, *steps] if verdict == 'ambiguous' else [*steps, *motions]
    steps += _use_of_model(diagnosis, model, worse)
    if diagnosis.not_visible:
        hidden = ', '.join(name_in_words(name) for name in diagnosis.not_visible)
        steps.append(
            f'These data cannot show {hidden}. Record other motions, or give their known values.'
        )
    return steps


def _use_of_model(diagnosis: Diagnosis, model: str, worse: Sequence[str]) -> list[str]:
    """Return sentences on how to use the model, or on what has to be done before."""
    if diagnosis.not_checked:
        return [f'Move {", ".join(diagnosis.not_checked)} as well, and record again.']
    if worse:
        return [
            f'Do not simulate with {model} yet: driven by the recorded torques, its error is '
            f'larger than that of the given model in {", ".join(worse)}. Record more motions of '
            f'{", ".join(worse)}, and diagnose all recordings together.'
        ]
    if diagnosis.verdict not in ('named', 'consistent'):
        return []
    if diagnosis.doubt or diagnosis.harmful:
        return ['Identify the arm anew before the model is used in simulation or control.']
    which = 'the patched model' if diagnosis.findings else 'a copy of the given model'
    return [f'Use {model}, {which}, for simulation and control; keep these bags as a baseline.']


def _inspections(finding: Finding, diagnosis: Diagnosis) -> list[str]:
    """Return sentences on robot parts to inspect because of a finding or its rivals."""
    steps = []
    own = Rival(finding.name, finding.joints)
    for one in (own, *finding.other_causes):
        what = (finding.look_at if one is own else '') or _look_at(one.name, diagnosis)
        if not what:
            continue
        where = ', '.join(one.joints) or 'the whole arm'
        name = name_in_words(one.name)
        if one.name == finding.name and one is not own:
            name = f'that of {where}'
        head = f'Look at {where}' if one is own else f'If it is {name}, look at {where}'
        place = _centre(finding) if one is own else ''
        steps.append(f'{head}: {what}{place}.')
    return steps


def _centre(finding: Finding) -> str:
    """Return a sentence with the centre of mass of a load; empty if it is not determined."""
    rows = list(zip(finding.parameters, finding.values, finding.std, strict=True))
    mass = [row for row in rows if row[0].unit == 'kg']
    moments = [row for row in rows if row[0].unit == 'kg m']
    if not (finding.weighs and mass and len(moments) == 3 and excludes_zero(*mass[0][1:])):
        return ''
    _, kilograms, doubt = mass[0]
    arms = [(value / kilograms, std) for _, value, std in moments]
    at = ', '.join(f'{x:z.3f}' for x, _ in arms)
    reach = HALF_WIDTH * max(hypot(std, x * doubt) for x, std in arms) / abs(kilograms)
    return f'. The load is centred at ({at}) ± {reach:.1g} m in the frame of that link'


def _look_at(name: str, diagnosis: Diagnosis) -> str:
    """
    Return the robot part to inspect for an effect, as text.

    It is empty for a usual effect that the given model lacks, such as friction: that is no fault
    of the robot.

    """
    if name not in CATALOGUE:
        return next((own.traits.look_at for own in diagnosis.arm.effects if own.name == name), '')
    kind, explanation = CATALOGUE[name], diagnosis.explanation
    given = () if explanation is None else explanation.given.effects
    if kind.traits.usual and name not in {own.name for own in given}:
        return ''
    return kind.traits.look_at
