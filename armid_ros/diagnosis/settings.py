# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a user may choose of a diagnosis, and every number that decides a name."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from armid_ros.effects import CATALOGUE, Kind
from armid_ros.effects.tied import Partner, TiedInteraction, TiedSlack
from armid_ros.identification import SignalSettings


@dataclass(frozen=True)
class Thresholds:
    """
    The numbers that decide a name. Shares are of the held-out squares over the unit of the gap.

    Attributes
    ----------
    price : float
        Share of the gap, or of what is left where a change is asked, that each value or shape of a
        cause has to take before it counts: 50 values of a rigid body, a tenth.
    outside : float
        Values that a cause from outside the arm counts for beside its own: a person or a strap can
        pull in any way.
    error_rate : float
        Probability of a name where nothing is, over all candidates that were tried: an alarm in
        five hundred healthy arms.
    rival_z : float
        Deviations by which a name has to be ahead of another one to exclude it.
    tie : float
        Twice the share of the same by which it has to be ahead as well; share of a simpler cause,
        in squares, that what contains it leaves at most, that a cause may lose at the bound of a
        value, of what names make in a second that they may leave, and of a cause in all recordings
        that one of them has to show to tell when it changed.
    far : float
        Lead over its own share that excludes another one however few blocks show it, and that
        a link, which never changes, or a load of one that is not at the end of the arm has to have
        over what happens between two days.
    misfit_share : float
        Power of a cause over that of the model's own misfit, summed over joints, below which it is
        small print where recordings do not tell a change from another motion's misfit.
    of_state : float
        Share of a misfit, root mean square, that is a function of position, velocity and load:
        without load 0.4 to 0.8 in half of the joints of 14 arms.
    unlikely : float
        Probability of as large a change where nothing has changed, over all candidates that are
        looked at, up to which one has: of 1113 candidates of 38 arms to which nothing happened
        none has that, and none of those that would matter has ten times that.
    usual : float
        Degrees of freedom that what other candidates differ by from recording to recording counts
        for: variances of candidates of one arm scatter as if they had 4, the median of 38 arms.
    headline : float
        Share that a cause takes of a gap beside the misfit that a model had before, below which it
        is small print; recordings hardly show causes that take less than this share of what they
        take of others.
    same_fit : float
        Factor between losses of two explanations that are as good as each other where the unit is
        a misfit of other data, which varies so from motion to motion as a rule, or a noise that
        is assumed because nothing repeats. What holds a joint at rest varies so, too.
    uncertain : float
        Share of the noise of a row that dry friction may be wrong by where the sign of a velocity
        is uncertain: beside reversals it is wrong by 0.5 to 2 times itself in five kinds of arms.
    described : float
        Share of a described friction by which it may be off; one fitted to more has changed.
        Values of the laboratory are off by up to 0.1, friction of an arm by 0.2 in a day.
    least_visible : float
        A group of which what is free leaves less than this share of its columns is not visible.
    confidence : float
        Level, of all joints together, up to which what is left counts as noise that two periods
        measure so well: of a thousand healthy arms one is `unknown`.
    predicted : float
        Factor by which squares may be larger on motions that were not used: values that other data
        gave are not exact there, and a misfit is another one. By as much again in the worst second
        of such a motion: of 38 healthy arms two leave more than 4 times the worst second before.
    open_share : float
        Share of the squares of a joint in which a gap is open that a cause takes if it matters
        there, however little that is of the gap of the arm; and of the whole gap that a cause
        takes which is named though nothing shows that it has changed, or though each of its values
        may be zero.
    surely : float
        Deviations that noise may make: a value may be beyond what is possible by so many, and a
        joint is worse, or held, beyond them.
    same : float
        Share, in squares, by which torques of causes differ that are one in other words.
    one_period : float
        Power of the difference of two periods at low frequency over that at high frequency from
        which something happened in one of them only: 3.6 at the most in 60 sets of the laboratory
        in which nothing did.
    one_period_on_average : float
        The same as the mean of three recordings or more: 2.4 at the most in those. Noise that
        lasts for 80 ms makes up to 3.7, and what happens in one period 3.7 and more: an alarm
        goes before a contact that is not seen.
    few_causes, many_causes : int
        Causes that are looked for in a model as given, and beside a body that is fitted anew.

    """

    price: float = 0.002
    outside: float = 10.0
    error_rate: float = 0.002
    rival_z: float = 2.0
    tie: float = 0.02
    far: float = 0.25
    misfit_share: float = 1.0
    of_state: float = 0.6
    unlikely: float = 0.01
    usual: float = 4.0
    headline: float = 0.1
    same_fit: float = 1.5
    uncertain: float = 0.25
    described: float = 0.25
    least_visible: float = 0.02
    confidence: float = 0.999
    predicted: float = 2.0
    open_share: float = 0.5
    surely: float = 3.0
    same: float = 1e-3
    one_period: float = 8.0
    one_period_on_average: float = 3.5
    few_causes: int = 4
    many_causes: int = 16

    @property
    def other_motion(self) -> float:
        """Factor by which the squares of a misfit may be larger in a motion that was not used."""
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
    thresholds : Thresholds
        The numbers that decide.

    """

    library: tuple[str, ...] = field(
        default_factory=lambda: tuple(name for name, kind in CATALOGUE.items() if not kind.learned)
    )
    own: tuple[Kind, ...] = ()
    partner: Partner | None = None
    signals: SignalSettings = field(default_factory=SignalSettings)
    material: float = 0.01
    everything: bool = False
    thresholds: Thresholds = field(default_factory=Thresholds)

    def without_small_print(self) -> DiagnosisSettings:
        """Return settings by which all that is there beyond chance is named."""
        thresholds = replace(self.thresholds, misfit_share=0.0, headline=0.0)
        return replace(self, material=0.0, everything=False, thresholds=thresholds)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """All effects that may be named."""
        tied = () if self.partner is None else (TiedInteraction.name, TiedSlack.name)
        return (*(CATALOGUE[name] for name in self.library if name not in tied), *self.own)
