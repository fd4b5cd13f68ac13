# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the causes that were taken one after the other stand beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence, Workspace
from armid_ros.diagnosis.search.acceptance import acceptable, beyond_chance, material
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.round import Round
from armid_ros.diagnosis.search.trial import Step, Taken, Trial
from armid_ros.diagnosis.search.view import Again, View
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np


def doubtful(trial: Trial | None) -> tuple[float, float]:
    """Return an order of causes: likelier to be chance, and taking less; None is not seen."""
    return (np.inf, np.inf) if trial is None else (trial.p, -trial.gain)


@dataclass(frozen=True)
class Retrial:
    """
    Asks for each of several causes again, beside the others, as it was asked for when taken.

    Attributes
    ----------
    question : Question
        What is asked of which arm.
    evidence : Evidence
        The data.
    settings : DiagnosisSettings
        Library and thresholds.

    """

    question: Question
    evidence: Evidence
    settings: DiagnosisSettings

    @cached_property
    def work(self) -> Workspace:
        """What columns of other shapes are computed from."""
        return Workspace(memoized_arm(self.question.arm), self.evidence.data)

    def stands(self, step: Step, again: Again) -> bool:
        """Return whether a cause is there, and matters if it has to."""
        if again.trial is None:
            return False
        here = Round(
            self.evidence,
            self.work,
            self.settings,
            again.problem,
            again.nuisance,
            step.total,
            step.tried,
            power=again.power,
            since=self.question.since,
        )
        if step.misfit_share is None:
            return beyond_chance(again.trial, here)
        gains = again.trial.joint_gains(here.problem, here.own(again.trial.candidate), here.free)
        return acceptable(again.trial, here) and material(gains, here, step.misfit_share)

    def fitted(self, names: Sequence[Taken], change: FloatArray | None) -> Fitted:
        """Fit all names together, from their values and a change of the body on."""
        question, evidence = self.question, self.evidence
        return fit(
            question.arm,
            [one.named for one in names],
            evidence.data,
            evidence.sigma,
            question.base,
            Start([one.values for one in names], change),
            question.prior,
        )

    def needless(self, fitted: Fitted, names: Sequence[Taken]) -> int | None:
        """Return the name that is likeliest to be chance beside the others; None if all stand."""
        if not names:
            return None
        view = View.of(fitted, self.evidence)
        judged = [view.trial_of(k) for k in range(len(names))]
        weak = [
            (doubtful(again.trial), k)
            for k, again in enumerate(judged)
            if not self.stands(names[k].step, again)
        ]
        return max(weak)[1] if weak else None

    def needed_after_all(
        self, fitted: Fitted, dropped: Sequence[Taken]
    ) -> tuple[int, FloatArray] | None:
        """Return which dropped name takes most beside those that stay, and its values."""
        if not dropped:
            return None
        view = View.of(fitted, self.evidence, [one.named for one in dropped])
        found: dict[int, Trial] = {}
        for k, one in enumerate(dropped):
            again = view.trial_of_more(k)
            if again.trial is not None and self.stands(one.step, again):
                found[k] = again.trial
        if not found:
            return None
        most = max(found, key=lambda k: found[k].gain)
        values = np.zeros_like(dropped[most].values)
        values[list(dropped[most].named.kept)] = found[most].values
        return most, values


def pruned(
    retrial: Retrial, taken: Sequence[Taken], change: FloatArray | None = None
) -> tuple[tuple[Step, ...], Fitted]:
    """
    Fit all names together, and drop those that the others make needless.

    What made a name needless may be dropped after it: each is asked once more beside those that
    stay.

    Returns
    -------
    steps : tuple of Step
        Those of the names that stay.
    fitted : Fitted
        The arm with these names.

    """
    alive, dropped = list(taken), list[Taken]()
    back: list[Step] = []
    while True:
        fitted = retrial.fitted(alive, change)
        steps, change = tuple(one.step for one in alive), fitted.change
        rows = zip(fitted.named, steps, fitted.values, strict=True)
        alive = [Taken(*row) for row in rows]
        needless = retrial.needless(fitted, alive)
        if needless is not None:
            gone = alive.pop(needless)
            if not any(gone.step is step for step in back):
                dropped.append(gone)
            continue
        needed = retrial.needed_after_all(fitted, dropped)
        if needed is None:
            return steps, fitted
        again = dropped.pop(needed[0])._replace(values=needed[1])
        back.append(again.step)
        alive.append(again)
