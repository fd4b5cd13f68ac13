# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a user may choose of a diagnosis, and every number that decides a name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from armid_ros.diagnosis.search.priors import HOW_OFTEN
from armid_ros.effects import CATALOGUE, Kind
from armid_ros.effects.tied import Partner, TiedInteraction, TiedSlack
from armid_ros.errors import meant, ModelError
from armid_ros.identification import SignalSettings


@dataclass(frozen=True)
class Thresholds:
    """
    The thresholds of the diagnosis. Shares are of the held-out squares in the unit of the gap.

    Attributes
    ----------
    alarm : float
        Log odds from which something is there, or has changed: 50 to 1.
    alone : float
        Log odds from which a cause may be it, where something surely is there.
    tie : float
        Log odds within which two causes are tied: 20 to 1.
    inexact : float
        Share of what a cause explains by which its law is inexact: a lead of less is none, and a
        joint that has less of it is not where the gap is.
    headline : float
        Share that a cause takes of a gap beside the misfit that a model had before, below which it
        is small print.
    same_fit : float
        Factor between losses of two explanations that are as good as each other where the unit is
        a misfit of other data, which varies so from motion to motion as a rule, or a noise that
        is assumed because nothing repeats. What holds a joint at rest varies so, too.
    uncertain : float
        Share of the noise of a row that dry friction may be wrong by where the sign of a velocity
        is uncertain: beside reversals it is wrong by 0.5 to 2 times itself in five kinds of arms.
    least_visible : float
        A group of which what is free leaves less than this share of its columns is not visible.
    confidence : float
        Level, of all joints together, up to which what is left counts as noise that two periods
        measure so well: of a thousand healthy arms one is `unknown`.
    predicted : float
        Factor by which squares may be larger on motions that were not used: values that other data
        gave are not exact there, and a misfit is another one.
    open_share : float
        Share of the gap that names have to take where recordings do not tell a change from the
        misfit of another motion; less of it is hardly explained.
    surely : float
        Deviations that noise may make: a value may be beyond what is possible by so many, and a
        joint is worse, or held, beyond them.
    one_period : float
        Power of the difference of two periods at low frequency over that at high frequency from
        which something happened in one of them only: 3.6 at the most in 60 sets of the laboratory
        in which nothing did.
    one_period_on_average : float
        The same as the mean of three recordings or more: 2.4 at the most in those. Noise that
        lasts for 80 ms makes up to 3.7, and what happens in one period 3.7 and more: an alarm
        goes before a contact that is not seen.

    """

    alarm: float = 3.9
    alone: float = 2.0
    tie: float = 3.0
    inexact: float = 0.02
    headline: float = 0.1
    same_fit: float = 1.5
    uncertain: float = 0.25
    least_visible: float = 0.02
    confidence: float = 0.999
    predicted: float = 2.0
    open_share: float = 0.5
    surely: float = 3.0
    one_period: float = 8.0
    one_period_on_average: float = 3.5

    @property
    def other_motion(self) -> float:
        """Factor by which the squared misfit may be larger in a motion that was not used."""
        return self.predicted * self.same_fit


@dataclass(frozen=True)
class DiagnosisSettings:
    """
    What a user chooses.

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
    material : float
        Share of a joint's torque, root mean square, below which a cause does not matter [-].
    everything : bool
        Whether causes that do not matter are added to the patched model as well.
    spans : bool
        Whether causes may act for a part of the time, where a gap stays open otherwise.
    prior : mapping of str to str
        How often effects happen to this arm, by name: often, usual, seldom or never.
    thresholds : Thresholds
        The numbers that decide.

    Raises
    ------
    ModelError
        If an effect or a frequency of ``prior`` is not known.

    """

    library: tuple[str, ...] = field(
        default_factory=lambda: tuple(name for name, kind in CATALOGUE.items() if not kind.learned)
    )
    own: tuple[Kind, ...] = ()
    partner: Partner | None = None
    signals: SignalSettings = field(default_factory=SignalSettings)
    material: float = 0.01
    everything: bool = False
    spans: bool = True
    prior: Mapping[str, str] = field(default_factory=dict)
    thresholds: Thresholds = field(default_factory=Thresholds)

    def __post_init__(self) -> None:
        """Check the names and frequencies of priors."""
        names = [kind.name for kind in self.kinds]
        for name, how in self.prior.items():
            for word, known, what in ((name, names, 'effect'), (how, HOW_OFTEN, 'frequency')):
                if word not in known:
                    raise ModelError(
                        f"prior '{name}={how}': there is no {what} '{word}'"
                        f'{meant(word, known)}; known are: {", ".join(known)}'
                    )

    def without_small_print(self) -> DiagnosisSettings:
        """Return settings that name every significant cause, however small."""
        thresholds = replace(self.thresholds, headline=0.0)
        return replace(self, material=0.0, everything=False, thresholds=thresholds)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """All effects that may be named."""
        tied = () if self.partner is None else (TiedInteraction.name, TiedSlack.name)
        return (*(CATALOGUE[name] for name in self.library if name not in tied), *self.own)
