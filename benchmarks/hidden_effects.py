# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of the diagnosis for effects hidden in recordings of MuJoCo arms.

The cases are those of tests/hidden, whose data come from code that is independent of the
diagnosis; rates have 95 % intervals (Wilson). For scope and rules see tests/hidden/README.md. The
sizes of hidden effects are multiples of the noise, so every size is material (`material` is zero).

    python -m benchmarks.hidden_effects [SET] [--only TEXT] [--out FILE]

"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import traceback

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import DiagnosisSettings
from armid_ros.effects import CATALOGUE
import numpy as np

from benchmarks.looks import judge_all
from benchmarks.metrics import Metric, number, rate
from benchmarks.two_days import Answer, ask, known_arm, Named, UNEXPLAINED
from tests.hidden.base import HiddenEffect
from tests.hidden.cases import Case, make_case, VISIBLE
from tests.hidden.lived.causes.base import Cause
from tests.hidden.specification import case_list, CaseSpec, SETS


@dataclass(frozen=True)
class Judged:
    """
    One case: the hidden effects, and the answer of the diagnosis.

    Attributes
    ----------
    spec : CaseSpec
        Specification of the case.
    effects : tuple of HiddenEffect
        The hidden effects.
    size : float
        Gap of the largest one alone.
    whole_arm : bool
        Whether one of them acts on all joints.
    answer : Answer
        The answer of the diagnosis.

    """

    spec: CaseSpec
    effects: tuple[HiddenEffect, ...]
    size: float
    whole_arm: bool
    answer: Answer

    @property
    def line(self) -> str:
        """Return the hidden effects and the answer as a line of text."""
        names = ' + '.join(map(str, self.answer.headline))
        return (
            f'{self.spec.key} (gap {self.size:.2g}): {self.answer.verdict} {names} '
            f'[{self.answer.seconds:.1f} s]' + self.answer.error.replace('\n', ' / ')
        )

    @property
    def visible(self) -> bool:
        """Whether the hidden effect is large enough to be found."""
        return bool(self.effects) and self.size >= VISIBLE

    @property
    def findings(self) -> tuple[Named, ...]:
        """Named effects, without link errors if the nominal model has wrong links."""
        honest = () if self.spec.exact else ('link_inertia',)
        return tuple(f for f in self.answer.headline if f.name not in honest)

    @property
    def false_alarm(self) -> bool:
        """Whether the verdict differs from `consistent` for more than wrong links of the URDF."""
        only_bodies = bool(self.answer.headline) and not self.findings
        return self.answer.verdict != 'consistent' and not only_bodies

    @property
    def top(self) -> bool:
        """Whether the hidden effect is named first."""
        return bool(self.findings) and self.findings[0].name in self.spec.effects

    @property
    def found(self) -> Named | None:
        """Named effect that is the first hidden effect or has it as a rival; None if none does."""
        return next((f for f in self.findings if self.spec.effects[0] in f.names), None)

    @property
    def localised(self) -> bool:
        """Whether the hidden effect is found in its true joints, as a named effect or a rival."""
        found, truth = self.found, self.effects[0]
        return found is not None and set(found.joints_of(truth.name)) == set(truth.joints)

    @property
    def exact(self) -> bool:
        """Whether the named effects are exactly the hidden effects."""
        return sorted(f.name for f in self.findings) == sorted(self.spec.effects)

    @property
    def admitted(self) -> bool:
        """Whether the verdict admits that no known effect explains the gap."""
        repeats = all(effect.repeats for effect in self.effects)
        honest = UNEXPLAINED if repeats else (*UNEXPLAINED, 'not_repeatable')
        return self.answer.verdict in honest

    def parameter_errors(self) -> list[tuple[float, bool]]:
        """Return error and coverage of each parameter of a right name; [] for a wrong name."""
        truth = self.effects[0]
        if self.found is None or self.found.name != truth.name:
            return []
        return self.found.parameter_errors(truth.parameters)


def true_arm(case: Case) -> ArmModel:
    """Return the model of the true arm, with its hidden effects as effects of the catalogue."""
    arm = ArmModel(case.true_robot)
    for name, values in case.true_known.items():
        joints = tuple(j for j, value in zip(arm.robot.joints, values, strict=True) if value)
        if joints:
            effect = CATALOGUE[name].on(arm.robot, joints)
            arm = arm.with_effect(effect, values[values != 0.0])
    for hidden in case.effects:
        arm = with_true_effect(arm, hidden)
    return arm


def with_true_effect(
    arm: ArmModel, hidden: HiddenEffect | Cause, shape: Sequence[float] | None = None
) -> ArmModel:
    """Return an arm model with the effect of the catalogue that equals a hidden effect."""
    true = {(p.name, p.joint): p.value for p in hidden.parameters}
    effect = CATALOGUE[hidden.name].on(arm.robot, hidden.joints or None)
    if shape is None:
        shape = [
            true.get((name.name, name.joint or ''), value)
            for name, value in zip(effect.shape_parameters(arm.robot), effect.shape, strict=True)
        ]
    effect = effect.with_shape(np.reshape(shape, (len(effect.owners), -1)))
    names = effect.parameters(arm.robot)
    return arm.with_effect(effect, [true.get((n.name, n.joint or ''), 0.0) for n in names])


def judge(spec: CaseSpec) -> Judged:
    """Create a case, diagnose it, and return truth and answer; exceptions count as answers."""
    case = make_case(spec)
    try:
        library = tuple(name for name in CATALOGUE if name not in case.removed)
        answer = ask(
            known_arm(case.robot, case.known),
            [bag.recording for bag in case.bags],
            validate=[bag.recording for bag in case.validation],
            settings=DiagnosisSettings(library=library, material=0.0),
        )
    except Exception:
        answer = Answer(verdict='failed', error=traceback.format_exc(limit=-3))
    whole = any(len(one.joints) in (0, case.robot.n_joints) for one in case.effects)
    return Judged(spec, case.effects, case.size, whole, answer)


def score(judged: Sequence[Judged]) -> tuple[Metric, ...]:
    """Return the rates of right names, false alarms and parameter errors of judged cases."""
    free = [j for j in judged if j.spec.kind == 'free']
    single = [j for j in judged if j.spec.kind == 'single' and j.visible]
    pairs = [j for j in judged if j.spec.kind == 'pair']
    nameless = [j for j in judged if j.spec.kind in ('outside', 'removed') and j.visible]
    placed = [j for j in single if j.found and not j.whole_arm]
    errors = [error for j in single for error in j.parameter_errors()]
    sizes = np.array([size for size, _ in errors])
    seconds = np.array([j.answer.seconds for j in judged])
    return (
        rate('false alarms', free, lambda j: j.false_alarm, most=0.02),
        rate('wrong names', single, lambda j: bool(j.findings) and not j.found, most=0.02),
        rate('top-1 name right', single, lambda j: j.top, least=0.90),
        rate('truth among the names', single, lambda j: j.found is not None, least=0.97),
        rate('joint right', placed, lambda j: j.localised, least=0.98),
        rate('pairs exact', pairs, lambda j: j.exact, least=0.80),
        rate('unknown or partial', nameless, lambda j: j.admitted, least=0.90),
        number('parameter error, median', np.median, sizes, 'at most 0.10', lambda x: x <= 0.10),
        rate('95 % intervals with the truth', errors, lambda e: e[1], least=0.90, most=0.98),
        rate('failures', judged, lambda j: bool(j.answer.error)),
        number('processor time, median [s]', np.median, seconds, '', None),
        number('processor time, longest [s]', np.max, seconds, 'at most 30', lambda x: x <= 30.0),
    )


def main() -> None:
    """Run a set of cases, print the table and write the answers."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.hidden_effects')
    parser.add_argument('set', nargs='?', default='development', choices=SETS)
    parser.add_argument('--only', nargs='+', default=[], metavar='TEXT', help='keys that have it')
    parser.add_argument('--out', type=Path, help='file for all answers, as JSON')
    parser.add_argument('--processes', type=int, default=2)
    options = parser.parse_args()
    specs = [
        spec
        for spec in case_list(options.set)
        if not options.only or any(text in spec.key for text in options.only)
    ]
    what = f'laboratory, {options.set}'
    what += f', only {" ".join(options.only)}' if options.only else ''
    judge_all(judge, specs, what, score, processes=options.processes, out=options.out)


if __name__ == '__main__':
    main()
