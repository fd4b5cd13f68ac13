# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of answers about hidden effects with the truth, as rates with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.metrics import Metric, number, rate
from benchmarks.two_days import Answer, Named
from tests.hidden.arrays import Parameter
from tests.hidden.cases import Case
from tests.hidden.machines import load_machine

#: Verdicts of a gap that no known effect explains.
UNEXPLAINED = ('unknown', 'partial')


@dataclass(frozen=True)
class Truth:
    """The hidden effects of a case, without its recordings."""

    key: str
    kind: str
    machine: str
    exact: bool
    names: tuple[str, ...]
    joints: tuple[tuple[str, ...], ...]
    parameters: tuple[tuple[Parameter, ...], ...]
    repeats: bool
    size: float
    visible: bool

    @classmethod
    def of(cls, case: Case) -> Truth:
        """Return the truth of a case."""
        return cls(
            key=case.spec.key,
            kind=case.spec.kind,
            machine=case.spec.machine,
            exact=case.spec.exact,
            names=case.spec.effects,
            joints=tuple(effect.joints for effect in case.effects),
            parameters=tuple(effect.parameters for effect in case.effects),
            repeats=all(effect.repeats for effect in case.effects),
            size=case.size,
            visible=case.visible,
        )


@dataclass(frozen=True)
class Judged:
    """
    One case with its truth and the answer of the diagnosis.

    Attributes
    ----------
    truth : Truth
        The hidden effects.
    outcome : Answer
        The answer of the diagnosis.
    closed : float
        Share of the explainable gap that is closed in held-out motions; nan without such a gap.

    """

    truth: Truth
    outcome: Answer
    closed: float = np.nan

    @property
    def findings(self) -> tuple[Named, ...]:
        """Return the findings; a wrong link is left out if the nominal model has wrong links."""
        honest = () if self.truth.exact else ('link_inertia',)
        return tuple(f for f in self.outcome.headline if f.name not in honest)

    @property
    def false_alarm(self) -> bool:
        """Whether the verdict is not `consistent`, link errors of the nominal model aside."""
        only_bodies = bool(self.outcome.headline) and not self.findings
        return self.outcome.verdict != 'consistent' and not only_bodies

    @property
    def top(self) -> bool:
        """Whether the truth was named first."""
        return bool(self.findings) and self.findings[0].name in self.truth.names

    @property
    def found(self) -> Named | None:
        """Return the finding with the (first) hidden effect among its names."""
        return next((f for f in self.findings if self.truth.names[0] in f.names), None)

    @property
    def wrong(self) -> bool:
        """Whether there are findings, and the truth is not among their names."""
        return bool(self.findings) and self.found is None

    @property
    def extra(self) -> bool:
        """Whether the truth is found, and there are more findings than hidden effects."""
        return self.found is not None and len(self.findings) > len(self.truth.names)

    @property
    def localised(self) -> bool:
        """Whether the truth was found in its joints, named first or as a rival."""
        found, (name, *_) = self.found, self.truth.names
        return found is not None and set(found.joints_of(name)) == set(self.truth.joints[0])

    @property
    def exact(self) -> bool:
        """Whether the named effects are exactly the hidden ones."""
        return sorted(f.name for f in self.findings) == sorted(self.truth.names)

    @property
    def exact_set(self) -> bool:
        """Whether each hidden effect is in a separate finding, and there are no others."""
        if len(self.findings) != len(self.truth.names):
            return False
        first, second = self.truth.names
        orders = (self.findings, self.findings[::-1])
        return any(first in a.names and second in b.names for a, b in orders)

    @property
    def admitted(self) -> bool:
        """Whether the verdict admits that no known effect explains the gap."""
        honest = UNEXPLAINED if self.truth.repeats else (*UNEXPLAINED, 'not_repeatable')
        return self.outcome.verdict in honest

    @property
    def whole_arm(self) -> bool:
        """Whether the effect acts on the whole arm."""
        joints = self.truth.joints[0]
        return not joints or len(joints) == load_machine(self.truth.machine).n_joints

    def parameter_errors(self) -> list[tuple[float, bool]]:
        """
        Compare the parameters of a right name with the true ones.

        Returns
        -------
        list of (float, bool)
            Error over the largest true value of its unit in the effect, and whether the 95 %
            interval contains the truth. Parameters below a third of that value are left out.

        """
        found = self.found
        if found is None or found.name != self.truth.names[0]:
            return []
        told = {(name, joint): (value, std) for name, joint, value, std in found.parameters}
        errors = []
        for true in self.truth.parameters[0]:
            largest = max(abs(p.value) for p in self.truth.parameters[0] if p.unit == true.unit)
            value, std = told.get((true.name, true.joint), (np.nan, np.nan))
            if largest > 0.0 and 3.0 * abs(true.value) >= largest and np.isfinite(value):
                error = abs(value - true.value)
                errors.append((error / largest, bool(error <= 1.96 * std)))
        return errors


def score(judged: Sequence[Judged]) -> tuple[Metric, ...]:
    """Return all metrics of judged cases."""
    free = [j for j in judged if j.truth.kind == 'free']
    single = [j for j in judged if j.truth.kind == 'single' and j.truth.visible]
    unseen = [j for j in judged if j.truth.kind == 'single' and not j.truth.visible]
    pairs = [j for j in judged if j.truth.kind == 'pair']
    outside = [j for j in judged if j.truth.kind == 'outside' and j.truth.visible]
    removed = [j for j in judged if j.truth.kind == 'removed' and j.truth.visible]
    placed = [j for j in single if j.found and not j.whole_arm]
    sets = [len(j.found.names) for j in single if j.found]
    closed = [0.0 if j.outcome.error else j.closed for j in (*single, *pairs)]
    closed = [share for share in closed if not np.isnan(share)]  # nan: not excited when held out
    errors = [error for j in single for error in j.parameter_errors()]
    sizes = np.array([size for size, _ in errors])
    seconds = np.array([j.outcome.seconds for j in judged])
    return (
        rate('false alarms', free, lambda j: j.false_alarm, most=0.02),
        rate('wrong names', single, lambda j: j.wrong, most=0.02),
        rate(
            '  of them provisional', single, lambda j: j.wrong and j.outcome.verdict == 'partial'
        ),
        rate('top-1 name right', single, lambda j: j.top, least=0.90),
        rate('truth among the names', single, lambda j: j.found is not None, least=0.97),
        number('  mean number of names', np.mean, sets, 'at most 3', lambda x: x <= 3.0),
        rate('  with names too many', single, lambda j: j.extra),
        rate('  nothing found', single, lambda j: not j.findings),
        rate('joint right', placed, lambda j: j.localised, least=0.98),
        number('gap closed, median', np.median, closed, 'at least 0.95', lambda x: x >= 0.95),
        number(
            'gap closed, 10th percentile',
            lambda x: np.quantile(x, 0.1),
            closed,
            'at least 0.85',
            lambda x: x >= 0.85,
        ),
        rate('pairs exact', pairs, lambda j: j.exact, least=0.80),
        rate('pairs within the sets', pairs, lambda j: j.exact_set),
        rate('unknown or partial', [*outside, *removed], lambda j: j.admitted, least=0.90),
        rate('  outside the library', outside, lambda j: j.admitted),
        rate('  name removed', removed, lambda j: j.admitted),
        number('parameter error, median', np.median, sizes, 'at most 0.10', lambda x: x <= 0.10),
        rate('95 % intervals with the truth', errors, lambda e: e[1], least=0.90, most=0.98),
        rate('silent where nothing shows', unseen, lambda j: not j.findings),
        rate('failures', judged, lambda j: bool(j.outcome.error)),
        number('processor time, median [s]', np.median, seconds, '', None),
        number('processor time, longest [s]', np.max, seconds, 'at most 30', lambda x: x <= 30.0),
    )
