# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Schedule the diagnoses of a moving arm, and combine their results.

An effect is proposed if several diagnoses in a row name it, since one window may contain the
moment of a change.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.errors import IdentificationError
from armid_ros.nodes.live.request import Answer, DiagnosisRequest, Healthy, WAITING
from armid_ros.nodes.live.window import SampleWindow
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

Named = tuple[str, tuple[str, ...]]

#: Verdicts that name an effect.
NAMING = ('named', 'ambiguous', 'partial')


@dataclass(frozen=True)
class LiveSettings:
    """
    Settings of the live diagnosis.

    Attributes
    ----------
    window : float
        Longest motion that is diagnosed [s].
    shortest : float
        Shortest motion that is diagnosed [s].
    every : float
        Motion between two requests [s].
    rate : float
        Rate of the kept samples [Hz].
    confirmations : int
        Diagnoses in a row that must agree on an effect.
    learning : float
        Motion at the beginning in which the arm is healthy [s]. The misfit of the model is
        computed from it if neither a baseline nor a misfit is given. 0: no misfit is used.
    material : float
        Share of a joint's torque below which a cause does not matter.

    """

    window: float = 20.0
    shortest: float = 8.0
    every: float = 4.0
    rate: float = 200.0
    confirmations: int = 2
    learning: float = 20.0
    material: float = 0.01

    def __post_init__(self) -> None:
        """Raise an IdentificationError if the window is shorter than the shortest motion."""
        if not 0.0 < self.shortest <= self.window:
            raise IdentificationError(
                f'a window of {self.window:g} s is shorter than the shortest motion that is '
                f'diagnosed, {self.shortest:g} s'
            )


@dataclass(frozen=True)
class Belief:
    """
    Accepted and proposed model of the arm.

    Attributes
    ----------
    accepted : ArmModel
        Model that the diagnoses use.
    proposed : ArmModel or None
        Accepted model with the named effects; None if nothing is proposed.
    named : tuple of (str, tuple of str)
        Names and joints of the proposed effects.
    rejected : frozenset of (str, tuple of str)
        Names and joints of effects that are not proposed again.

    """

    accepted: ArmModel
    proposed: ArmModel | None = None
    named: tuple[Named, ...] = ()
    rejected: frozenset[Named] = frozenset()

    @property
    def model(self) -> ArmModel:
        """Return the proposed model, or the accepted one if nothing is proposed."""
        return self.accepted if self.proposed is None else self.proposed


class LiveDiagnosis:
    """
    Schedules diagnoses, and combines their results.

    Parameters
    ----------
    arm : ArmModel
        The present model.
    settings : LiveSettings, optional
        Settings of the diagnosis.
    baseline : tuple of Recording
        Recordings of the healthy arm.
    misfit : Misfit, optional
        Residual of the model when it was identified.
    seed : int
        Random seed of the diagnoses.

    Attributes
    ----------
    settings : LiveSettings
        Present settings; see `use`.
    belief : Belief
        Accepted and proposed model of the arm.
    window : SampleWindow
        Latest samples.
    latest : Answer or None
        Last answer with a verdict other than waiting.
    asked : int
        Number of requests so far.

    """

    def __init__(
        self,
        arm: ArmModel,
        settings: LiveSettings | None = None,
        *,
        baseline: tuple[Recording, ...] = (),
        misfit: Misfit | None = None,
        seed: int = 0,
    ) -> None:
        self.settings = settings or LiveSettings()
        self._given = arm, baseline, misfit
        self._seed = seed
        self._under_way = self._outdated = False
        self.reset()

    def reset(self) -> None:
        """Restart with the original model."""
        arm, self._baseline, self._misfit = self._given
        self.belief = Belief(arm)
        self.latest: Answer | None = None
        self.asked = 0
        self._outdate()
        self.use(self.settings)
        self._healthy: Healthy | None = None
        known = bool(self._baseline) or self._misfit is not None
        self._learned = known or not self.settings.learning

    def use(self, settings: LiveSettings) -> None:
        """Use other settings, and empty the window."""
        self.settings = settings
        joints, period = self.belief.accepted.robot.joints, 1.0 / settings.rate
        self.window = SampleWindow(joints, max(settings.window, settings.learning), period)
        self._asked_at, self._next = 0.0, settings.every
        self._begin, self._changed = -np.inf, False
        self._agreed: list[Named] = []

    @property
    def learning(self) -> bool:
        """Return whether the motion of the healthy arm is still being collected."""
        return not self._learned

    @property
    def confirmed(self) -> bool:
        """Return whether enough diagnoses in a row agree on an effect."""
        return bool(self._agreed) and len(self._agreed) >= self.settings.confirmations

    @property
    def due(self) -> bool:
        """Return whether there was enough motion since the last request."""
        if self.learning or not self._holds(self.settings.shortest):
            return False
        return self.window.moved - self._asked_at >= self._next

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> bool:
        """Add a sample; see `SampleWindow.add` for arguments and result."""
        held = len(self.window)
        kept = self.window.add(t, q, dq, tau)
        if kept and held and len(self.window) == 1:
            # after a gap a new stretch of motion begins
            self._asked_at, self.window.moved = 0.0, 0.0
            self._begin, self._changed = -np.inf, False
            self._outdate()
        if self.learning and self._holds(self.settings.learning):
            # keep the motion so far, from which the misfit of the model is computed
            began = self.window.end - self.settings.learning
            motion = self.window.recording(began, 'the motion in which nothing was wrong')
            self._healthy, self._learned = Healthy(self.belief.accepted, motion), True
            self._asked_at = self.window.moved
        return kept

    def _holds(self, seconds: float) -> bool:
        """Return whether the window contains motion of a given time [s]."""
        return self.window.moved >= seconds <= self.window.end - self.window.begin

    def request(self) -> DiagnosisRequest:
        """Return the next request, and register it."""
        self._asked_at, self._next = self.window.moved, self.settings.every
        self.asked += 1
        self._under_way, self._outdated = True, False
        begin = max(self.window.end - self.settings.window, self._begin)
        return DiagnosisRequest(
            self.belief.accepted,
            self.window.recording(begin, f'window {self.asked}'),
            self._baseline,
            self._misfit,
            self.settings.shortest,
            self.settings.material,
            self._seed,
            self.window.end,
            self._healthy,
            self._changed,
        )

    def take(self, answer: Answer) -> bool:
        """
        Handle an answer; an outdated one is ignored.

        Returns
        -------
        bool
            Whether the model has changed.

        """
        outdated, self._under_way, self._outdated = self._outdated, False, False
        if outdated:
            return False
        if answer.changed:
            self._begin, self._changed = answer.end - answer.window.duration, True
        if answer.verdict == 'consistent':  # a later change shows in the residual again
            self._changed = False
        if answer.verdict == WAITING:
            self._agreed = []
            self._next = self.settings.shortest - answer.window.duration
            return False
        self.latest = answer
        before = self.belief.model
        if answer.verdict in NAMING and answer.named:
            # count the diagnoses in a row with the same first effect
            named = answer.named[0]
            if self._agreed and self._agreed[-1] != named:
                self._agreed = []
            self._agreed.append(named)
            if self.confirmed and named not in self.belief.rejected:
                self.belief = replace(self.belief, proposed=answer.arm, named=answer.named)
            elif self.confirmed:
                self.belief = replace(self.belief, proposed=None, named=())
        else:
            self._agreed = []
            if answer.verdict == 'consistent':
                self.belief = replace(self.belief, proposed=None, named=())
        return self.belief.model is not before

    def accept(self) -> None:
        """
        Accept the proposed model; the last window replaces the baseline.

        Raises
        ------
        IdentificationError
            If nothing is proposed.

        """
        proposed = self._proposed()
        self.belief = Belief(proposed, rejected=self.belief.rejected)
        self._outdate()
        if self._baseline and self.latest is not None:
            self._baseline = (self.latest.window,)
        self._agreed = []

    def reject(self) -> None:
        """
        Reject the proposed effects, and do not propose them again.

        Raises
        ------
        IdentificationError
            If nothing is proposed.

        """
        self._proposed()
        belief = self.belief
        self.belief = Belief(belief.accepted, rejected=belief.rejected | {belief.named[0]})
        self._outdate()
        self._agreed = []

    def _proposed(self) -> ArmModel:
        if self.belief.proposed is None:
            raise IdentificationError('nothing is proposed')
        return self.belief.proposed

    def _outdate(self) -> None:
        """Mark the pending answer as outdated."""
        self._outdated = self._under_way
