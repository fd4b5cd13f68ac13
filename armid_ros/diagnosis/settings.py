# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The thresholds of a diagnosis, each with the reason for its value."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.effects import CATALOGUE, Kind
from armid_ros.effects.tied import Partner, TiedInteraction, TiedSlack
from armid_ros.identification import SignalSettings


@dataclass(frozen=True)
class DiagnosisSettings:
    """
    When a gap is a gap, and when an effect may be named.

    The excess of a joint is e - 1, where e is the mean of (residual / noise)^2.

    Attributes
    ----------
    library : tuple of str
        Names that may be given.
    own : tuple of Kind
        Effects of one's own that may be named besides.
    partner : Partner or None
        Another machine that was recorded beside the arm, to which it may be tied. What holds the
        arm is then looked for between the two, and not at unknown places.
    signals : SignalSettings
        Filters; chosen from the recordings by default.
    consistent_loss : float
        A joint with a loss e below this is at its noise: the floor itself is known to 10 or 20 %
        from two periods of some ten seconds.
    partial_loss : float
        A model that leaves a joint above this is not the whole truth: names are provisional.
    held_out_loss : float
        A name is provisional while the patched model leaves a joint more than this on recordings
        that are only predicted: of 72 right names 69 left 1.8 at the most, substitutes 6 and more.
    least_share : float
        A group has to close this share of the excess that is left, in the arm or in one joint.
    least_of_all : float
        ... and this share of the excess at the beginning: what takes less than a thousandth or two
        of a gap is not what was missing.
    least_of_joint : float
        ... or this share of that of a joint which had this share of the whole,
    most_of_rest : float
        ... or this share of what is left of a joint: leftovers of what was named already are not
        of one kind.
    least_z : float
        Block z that a gain has to reach on a held-out trajectory to count as replicated.
    sure_z : float
        Block z of a gain in every part of the data that counts although no joint has a gap of its
        own: a little of all joints.
    tautology : float
        A group whose columns are made of the measured torque explains noise by noise where it
        leaves a joint less than this share of its noise.
    rival_z : float
        Block z by which a name has to beat another one to exclude it.
    same_cosine : float
        Groups whose torques, as far as the rigid body cannot make them, have a cosine above this
        are the same to these data.
    least_visible : float
        A group of which the rigid body's parameters leave less than this share cannot be seen.
    most_steps : int
        Groups that are looked for, one after the other.
    blocks : int
        Blocks per trajectory for the z: some hundred rows each, longer than any correlation.

    """

    library: tuple[str, ...] = tuple(CATALOGUE)
    own: tuple[Kind, ...] = ()
    partner: Partner | None = None
    signals: SignalSettings = field(default_factory=SignalSettings)
    consistent_loss: float = 1.2
    partial_loss: float = 1.4
    held_out_loss: float = 3.0
    least_share: float = 0.10
    least_of_all: float = 0.0015
    least_of_joint: float = 0.01
    most_of_rest: float = 0.8
    least_z: float = 3.0
    sure_z: float = 4.0
    tautology: float = 0.8
    rival_z: float = 2.0
    same_cosine: float = 0.95
    least_visible: float = 0.02
    most_steps: int = 24
    blocks: int = 12

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """All effects that may be named."""
        tied = () if self.partner is None else (TiedInteraction.name, TiedSlack.name)
        return (*(CATALOGUE[name] for name in self.library if name not in tied), *self.own)
