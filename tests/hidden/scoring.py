# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How good a diagnosis is: outcomes against the truth, as rates with 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.hidden.arrays import Parameter
from tests.hidden.cases import Case
from tests.hidden.machines import load_machine

#: What says that a gap is there but nothing that is known explains it.
UNEXPLAINED = ('unknown', 'partial')


@dataclass(frozen=True)
class Finding:
    """
    An effect that was named.

    Attributes
    ----------
    name : str
        Name in the catalogue.
    joints : tuple of str
        Where; empty for the whole arm.
    ambiguous_with : tuple of str
        Other names that the data cannot exclude.
    parameters : tuple of (name, joint, value, std)
        What was estimated.
    rivals : tuple of (name, joints)
        Where those other names would be.

    """

    name: str
    joints: tuple[str, ...] = ()
    ambiguous_with: tuple[str, ...] = ()
    parameters: tuple[tuple[str, str, float, float], ...] = ()
    rivals: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def joints_of(self, name: str) -> tuple[str, ...]:
        """Return where it is if it is a name."""
        return self.joints if name == self.name else dict(self.rivals).get(name, self.joints)

    @property
    def names(self) -> set[str]:
        """All names it may be."""
        return {self.name, *self.ambiguous_with}


@dataclass(frozen=True)
class Outcome:
    """
    What a diagnosis said, as in diagnosis.json.

    Attributes
    ----------
    verdict : str
        consistent, named, ambiguous, partial, unknown, not_repeatable or bad_data.
    findings : tuple of Finding
        What was named, most important first.
    closed : float
        Share of the explainable gap that is closed on motions never used; nan if they have none.
    seconds : float
        Processor time it took [s].
    error : str
        Why there is no outcome; empty if there is one.

    """

    verdict: str
    findings: tuple[Finding, ...] = ()
    closed: float = np.nan
    seconds: float = np.nan
    error: str = ''


@dataclass(frozen=True)
class Truth:
    """What is hidden in a case, without its recordings."""

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
        """Take the truth out of a case."""
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
    """One case: what is true, and what was said."""

    truth: Truth
    outcome: Outcome

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return what was named; a body that is off where the nominal one is off is no finding."""
        honest = () if self.truth.exact else ('link_inertia',)
        return tuple(f for f in self.outcome.findings if f.name not in honest)

    @property
    def false_alarm(self) -> bool:
        """Whether anything but silence was said of an arm without hidden effects."""
        only_bodies = bool(self.outcome.findings) and not self.findings
        return self.outcome.verdict != 'consistent' and not only_bodies

    @property
    def top(self) -> bool:
        """Whether the truth was named first."""
        return bool(self.findings) and self.findings[0].name in self.truth.names

    @property
    def found(self) -> Finding | None:
        """Return the finding that has the (first) truth among its names."""
        return next((f for f in self.findings if self.truth.names[0] in f.names), None)

    @property
    def wrong(self) -> bool:
        """Whether there are names, and the truth is not among them."""
        return bool(self.findings) and self.found is None

    @property
    def extra(self) -> bool:
        """Whether there are more names than truths, the truth being one of them."""
        return self.found is not None and len(self.findings) > len(self.truth.names)

    @property
    def localised(self) -> bool:
        """Whether the truth was found in the joints that it is in, named first or as a rival."""
        found, (name, *_) = self.found, self.truth.names
        return found is not None and set(found.joints_of(name)) == set(self.truth.joints[0])

    @property
    def exact(self) -> bool:
        """Whether the names are those of the truth, no more and no fewer."""
        return sorted(f.name for f in self.findings) == sorted(self.truth.names)

    @property
    def exact_set(self) -> bool:
        """Whether each truth is in a finding of its own, and there are no other findings."""
        if len(self.findings) != len(self.truth.names):
            return False
        first, second = self.truth.names
        orders = (self.findings, self.findings[::-1])
        return any(first in a.names and second in b.names for a, b in orders)

    @property
    def admitted(self) -> bool:
        """Whether it was admitted that nothing explains what is there."""
        honest = UNEXPLAINED if self.truth.repeats else (*UNEXPLAINED, 'not_repeatable')
        return self.outcome.verdict in honest

    @property
    def whole_arm(self) -> bool:
        """Whether the effect has no joint of its own."""
        joints = self.truth.joints[0]
        return not joints or len(joints) == load_machine(self.truth.machine).n_joints

    def parameter_errors(self) -> list[tuple[float, bool]]:
        """
        Compare the parameters of a right name with the true ones.

        Returns
        -------
        list of (float, bool)
            Error over the largest true value of that unit in the effect, and whether the 95 %
            interval has the truth; for parameters of a third of that value at least.

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


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Return the 95 % interval of a rate (Wilson 1927)."""
    if total == 0:
        return 0.0, 1.0
    p = hits / total
    centre = (p + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z / (1 + z**2 / total) * np.sqrt(p * (1 - p) / total + z**2 / (4 * total**2))
    return float(max(centre - half, 0.0)), float(min(centre + half, 1.0))


@dataclass(frozen=True)
class Metric:
    """
    One row of the table.

    Attributes
    ----------
    name : str
        What it says.
    value : float
        Rate, share or number; nan if nothing counts.
    low, high : float
        95 % interval; nan where it is not a rate.
    count : int
        Cases that count.
    reach : str
        What is wanted, in words; empty if nothing is.
    good : bool or None
        Whether it is reached.

    """

    name: str
    value: float
    low: float
    high: float
    count: int
    reach: str
    good: bool | None


def score(judged: Sequence[Judged]) -> tuple[Metric, ...]:
    """Compute all metrics."""
    free = [j for j in judged if j.truth.kind == 'free']
    single = [j for j in judged if j.truth.kind == 'single' and j.truth.visible]
    unseen = [j for j in judged if j.truth.kind == 'single' and not j.truth.visible]
    pairs = [j for j in judged if j.truth.kind == 'pair']
    outside = [j for j in judged if j.truth.kind == 'outside' and j.truth.visible]
    removed = [j for j in judged if j.truth.kind == 'removed' and j.truth.visible]
    placed = [j for j in single if j.found and not j.whole_arm]
    sets = [len(j.found.names) for j in single if j.found]
    closed = [0.0 if j.outcome.error else j.outcome.closed for j in (*single, *pairs)]
    closed = [share for share in closed if not np.isnan(share)]  # some never show it again
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


def rate(
    name: str,
    cases: Sequence[Any],
    test: Callable[[Any], bool],
    *,
    least: float | None = None,
    most: float | None = None,
) -> Metric:
    """Return a row with the share of cases that pass a test, and what is wanted of it."""
    hits, total = sum(map(bool, map(test, cases))), len(cases)
    value = hits / total if total else np.nan
    wanted = [f'at least {least:g}'] if least is not None else []
    wanted += [f'at most {most:g}'] if most is not None else []
    good = None
    if wanted and total:
        good = (least is None or value >= least) and (most is None or value <= most)
    return Metric(name, value, *wilson(hits, total), total, ', '.join(wanted), good)


def number(
    name: str,
    statistic: Callable[[Any], Any],
    values: Sequence[float] | np.ndarray,
    reach: str,
    test: Callable[[float], bool] | None,
) -> Metric:
    """Return a row with a statistic of values, and what is wanted of it."""
    value = float(statistic(values)) if len(values) else np.nan
    good = bool(test(value)) if test and len(values) else None
    return Metric(name, value, np.nan, np.nan, len(values), reach, good)
