# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Schedule of the diagnoses of a moving arm, and their combination.

An effect is proposed only if several diagnoses in a row name it, because the arm may change in the
middle of a single window.

"""

from __future__ import annotations

from armid_ros.arm import ArmModel, Misfit
from armid_ros.errors import IdentificationError
from armid_ros.nodes.live.request import Answer, DiagnosisRequest, LiveSettings, Named, WAITING
from armid_ros.nodes.live.window import SampleWindow
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Verdicts that name an effect.
NAMING_VERDICTS = ('named', 'ambiguous', 'partial')


class LiveDiagnosis:
    """
    Schedule of repeated diagnoses of a moving arm, with the proposed model.

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
        Present settings, which `use` changes.
    accepted : ArmModel
        Model that the diagnoses use.
    proposed : ArmModel or None
        Accepted model with the named effects; None if nothing is proposed.
    named : tuple of (str, tuple of str)
        Names and joints of the proposed effects.
    learning : bool
        Whether the motion of the healthy arm is being collected.
    window : SampleWindow
        Latest samples.
    latest : Answer or None
        Last diagnosis with another verdict than waiting.
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
        """Restart the diagnoses with the original model."""
        arm, self._baseline, self._misfit = self._given
        self.accepted = arm
        self._rejected: set[Named] = set()
        self._propose(None)
        self.latest: Answer | None = None
        self.asked = 0
        self._outdated = self._under_way
        self.use(self.settings)
        self._healthy: tuple[ArmModel, Recording] | None = None
        known = bool(self._baseline) or self._misfit is not None
        self.learning = not known and self.settings.learning > 0.0

    def use(self, settings: LiveSettings) -> None:
        """Change the settings, and clear the window of samples."""
        self.settings = settings
        joints, period = self.accepted.robot.joints, 1.0 / settings.rate
        self.window = SampleWindow(joints, max(settings.window, settings.learning), period)
        self._asked_at, self._next = 0.0, settings.every
        self._begin, self._changed = -np.inf, False
        self._agreed: list[Named] = []

    @property
    def model(self) -> ArmModel:
        """Proposed model; the accepted model if nothing is proposed."""
        return self.accepted if self.proposed is None else self.proposed

    @property
    def confirmed(self) -> bool:
        """Whether `confirmations` successive diagnoses named the same effect first."""
        return bool(self._agreed) and len(self._agreed) >= self.settings.confirmations

    @property
    def due(self) -> bool:
        """Whether the window has enough new motion for the next diagnosis."""
        if self.learning or not self._contains(self.settings.shortest):
            return False
        return self.window.moved - self._asked_at >= self._next

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> None:
        """Add a sample of the arm to the window; see `SampleWindow.add`."""
        held = len(self.window)
        kept = self.window.add(t, q, dq, tau)
        if kept and held and len(self.window) == 1:
            # after a gap, a new motion begins
            self._asked_at, self.window.moved = 0.0, 0.0
            self._begin, self._changed = -np.inf, False
            self._outdated = self._under_way
        if self.learning and self._contains(self.settings.learning):
            # keep the motion so far, as the misfit of the model is computed from it
            began = self.window.end - self.settings.learning
            motion = self.window.recording(began, 'motion of the healthy arm')
            self._healthy, self.learning = (self.accepted, motion), False
            self._asked_at = self.window.moved

    def _contains(self, seconds: float) -> bool:
        """Return whether the window contains at least `seconds` of motion."""
        return self.window.moved >= seconds <= self.window.end - self.window.begin

    def request(self) -> DiagnosisRequest:
        """Return the input of a diagnosis of the present window."""
        self._asked_at, self._next = self.window.moved, self.settings.every
        self.asked += 1
        self._under_way, self._outdated = True, False
        begin = max(self.window.end - self.settings.window, self._begin)
        return DiagnosisRequest(
            self.accepted,
            self.window.recording(begin, f'window {self.asked}'),
            self._baseline,
            self._misfit,
            self.settings,
            self._seed,
            self.window.end,
            self._healthy,
            self._changed,
        )

    def take(self, answer: Answer) -> bool:
        """
        Process the result of a diagnosis, unless the model or the motion has changed since.

        Returns
        -------
        bool
            Whether the proposed model has changed.

        """
        outdated, self._under_way, self._outdated = self._outdated, False, False
        if outdated:
            return False
        if answer.changed:
            self._begin, self._changed = answer.end - answer.window.duration, True
        if answer.verdict == 'consistent':  # a later change is detected in the residual
            self._changed = False
        if answer.verdict == WAITING:
            self._agreed = []
            self._next = self.settings.shortest - answer.window.duration
            return False
        self.latest = answer
        before = self.model
        if answer.verdict in NAMING_VERDICTS and answer.named:
            # count the diagnoses in a row with the same first effect
            named = answer.named[0]
            if self._agreed and self._agreed[-1] != named:
                self._agreed = []
            self._agreed.append(named)
            if self.confirmed:
                rejected = named in self._rejected
                self._propose(None if rejected else answer.arm, answer.named)
        else:
            self._agreed = []
            if answer.verdict == 'consistent':
                self._propose(None)
        return self.model is not before

    def accept(self) -> None:
        """
        Accept the proposed model; the last diagnosed window becomes the baseline.

        Raises
        ------
        IdentificationError
            If nothing is proposed.

        """
        if self.proposed is None:
            raise IdentificationError('no effect is proposed on ~/model, so none can be accepted')
        self.accepted = self.proposed
        if self._baseline and self.latest is not None:
            self._baseline = (self.latest.window,)
        self._clear_proposal()

    def reject(self) -> None:
        """
        Discard the proposed effects; the first of these effects is never proposed again.

        Raises
        ------
        IdentificationError
            If nothing is proposed.

        """
        if self.proposed is None:
            raise IdentificationError('no effect is proposed on ~/model, so none can be rejected')
        self._rejected.add(self.named[0])
        self._clear_proposal()

    def _clear_proposal(self) -> None:
        self._propose(None)
        self._agreed = []
        self._outdated = self._under_way

    def _propose(self, arm: ArmModel | None, named: tuple[Named, ...] = ()) -> None:
        self.proposed, self.named = arm, named if arm is not None else ()
