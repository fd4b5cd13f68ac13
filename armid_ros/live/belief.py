# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
When to ask what is wrong with a moving arm, and what to believe of the answers.

A name counts when questions in a row agree on it, for a window may hold the moment of the change.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.errors import IdentificationError
from armid_ros.live.request import Answer, DiagnosisRequest, Healthy, WAITING
from armid_ros.live.window import SampleWindow
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

Named = tuple[str, tuple[str, ...]]

#: Verdicts that put a name forward.
NAMING = ('named', 'ambiguous', 'partial')


@dataclass(frozen=True)
class LiveSettings:
    """
    What a user chooses.

    Attributes
    ----------
    window : float
        Motion that is looked at, at most [s].
    shortest : float
        ... and at least [s].
    every : float
        Motion between two questions [s].
    rate : float
        Samples per second that are kept [Hz].
    confirmations : int
        Questions in a row that have to agree on a name.
    learning : float
        Motion in which nothing is wrong yet, from which the model's own misfit is taken where
        neither a baseline nor a misfit is known [s]; 0: all that the model lacks is looked for.
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
        """Refuse what never comes to a request."""
        if not 0.0 < self.shortest <= self.window:
            raise IdentificationError(
                f'a window of {self.window:g} s is never as long as the shortest one that is '
                f'looked at, {self.shortest:g} s'
            )


@dataclass(frozen=True)
class Belief:
    """
    The model of the arm, and what is proposed.

    Attributes
    ----------
    accepted : ArmModel
        What everybody agrees on.
    proposed : ArmModel or None
        The same with what was named last; None where nothing is.
    named : tuple of (str, tuple of str)
        Names and joints of what is proposed.
    rejected : frozenset of (str, tuple of str)
        What is not to be proposed again.

    """

    accepted: ArmModel
    proposed: ArmModel | None = None
    named: tuple[Named, ...] = ()
    rejected: frozenset[Named] = frozenset()

    @property
    def model(self) -> ArmModel:
        """Return the best model there is."""
        return self.accepted if self.proposed is None else self.proposed


class LiveDiagnosis:
    """
    Decides when to ask, and what to make of the answers.

    Parameters
    ----------
    arm : ArmModel
        The present model.
    settings : LiveSettings, optional
        When to ask.
    baseline : tuple of Recording
        From when nothing was wrong.
    misfit : Misfit, optional
        What the model left when it was identified.
    seed : int
        Of the diagnoses.

    Attributes
    ----------
    settings : LiveSettings
        When to ask; may be replaced.
    belief : Belief
        The model of the arm, and what is proposed.
    window : SampleWindow
        What came.
    latest : Answer or None
        The last answer that was a verdict.
    asked : int
        Questions so far.

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
        """Begin anew with the model as it was given."""
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
        """Ask as other settings have it; the window begins anew."""
        self.settings = settings
        joints, period = self.belief.accepted.robot.joints, 1.0 / settings.rate
        self.window = SampleWindow(joints, max(settings.window, settings.learning), period)
        self._asked_at, self._next = 0.0, settings.every
        self._begin, self._changed = -np.inf, False
        self._agreed: list[Named] = []

    @property
    def learning(self) -> bool:
        """Whether the motion is still one in which nothing is wrong."""
        return not self._learned

    @property
    def confirmed(self) -> bool:
        """Whether the last questions agree on a name."""
        return bool(self._agreed) and len(self._agreed) >= self.settings.confirmations

    @property
    def due(self) -> bool:
        """Whether enough motion came since the last request."""
        if self.learning or not self._holds(self.settings.shortest):
            return False
        return self.window.moved - self._asked_at >= self._next

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> bool:
        """Take a sample; arguments and result as of `SampleWindow.add`."""
        held = len(self.window)
        kept = self.window.add(t, q, dq, tau)
        if kept and held and len(self.window) == 1:
            # a gap: the stretch is another one
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
        """Return whether the window has motion of so many seconds."""
        return self.window.moved >= seconds <= self.window.end - self.window.begin

    def request(self) -> DiagnosisRequest:
        """Return what to ask now."""
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
        Take an answer into account, unless the arm or the time is another one by now.

        Returns
        -------
        bool
            Whether the model is another one now.

        """
        outdated, self._under_way, self._outdated = self._outdated, False, False
        if outdated:
            return False
        if answer.changed:
            self._begin, self._changed = answer.end - answer.window.duration, True
        if answer.verdict == 'consistent':  # what changes now shows in the residual again
            self._changed = False
        if answer.verdict == WAITING:
            self._agreed = []
            self._next = self.settings.shortest - answer.window.duration
            return False
        self.latest = answer
        before = self.belief.model
        if answer.verdict in NAMING and answer.named:
            # count the questions in a row that put a name first
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
        Take what is proposed for the model; a baseline is none of the arm as it is now.

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
        Drop what is proposed, and do not propose it again.

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
        """Have the answer that is under way dropped when it comes."""
        self._outdated = self._under_way
