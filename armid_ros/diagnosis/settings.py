# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings of a diagnosis: prior odds of effects, and all thresholds of its decisions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from armid_ros.effects import CATALOGUE, Effect
from armid_ros.effects.tied import Partner, TiedInteraction, TiedSlack
from armid_ros.errors import meant, ModelError
from armid_ros.identification import SignalSettings
from armid_ros.robots import Robot
import numpy as np

#: Log odds by frequency of an effect, which the user may set, relative to the default odds.
HOW_OFTEN = {'often': 2.0, 'usual': 0.0, 'seldom': -3.0, 'never': -30.0}
#: Log odds of a changed link inertia since the baseline, which is extremely rare.
NEVER = -5.0
#: Log odds of a new load on a link other than the last one, since the baseline.
INNER = -2.0
#: Log odds of other effects on unusual joints: a delay of one joint, a lag of the whole arm.
ELSEWHERE = -1.5
#: Log odds of causes outside of the arm, which can pull in any direction.
OUTSIDE = -4.0
#: Log odds of friction that depends on a measured temperature, as that of every gear does.
FOLLOWS = 5.5
#: Log odds per position in the catalogue, whose order is from common to rare effects.
RARER = -0.05
#: Probability that the true cause is not in the catalogue and resembles the best cause: 6 of 70
#: names of development arms.
UNLISTED = 0.09
#: Log odds per fitted shape parameter.
SHAPE = -3.0
#: Prior standard deviations of the values of a cause over their `unit`, equally likely.
SIZES = np.array([0.01, 0.03, 0.1, 0.3, 1.0])
#: Prior standard deviation of values in the baseline, and the largest one of differences between
#: recordings, both over the `unit` of a cause.
THERE = 0.3


@dataclass(frozen=True)
class Thresholds:
    """
    Thresholds for the decisions of a diagnosis.

    A share is a part of the squared weighted held-out residual.

    Attributes
    ----------
    alarm : float
        Log odds required to accept that an effect is present, or has changed: 50 to 1.
    alone : float
        Log odds required of a cause and of its rivals, once one of them reaches `alarm`: 7 to 1.
    tie : float
        Log odds within which two causes are rivals: 20 to 1.
    inexact : float
        Relative error of torque laws: a lead below this share of the explained part does not
        count, nor does a joint with less than this share of the gap.
    headline : float
        Share of the gap below which a cause is minor, if the model has a known misfit.
    same_fit : float
        Largest ratio of the squared residuals of two equally good explanations. A misfit, an
        estimated noise, and the torque that holds a joint at rest vary by this factor from motion
        to motion.
    uncertain : float
        Largest error of dry friction in a used row, over its noise. Next to reversals, dry
        friction is wrong by 0.5 to 2 times itself in five kinds of arms.
    least_visible : float
        Smallest share of the norm of a visible cause that the nuisance columns cannot reproduce.
    confidence : float
        Confidence, over all joints, up to which a residual counts as noise measured by two
        periods: of a thousand healthy arms one is `unknown`.
    predicted : float
        Factor by which the squared residual may be larger in held-out motions: the parameters are
        not exact there, and the misfit differs.
    open_share : float
        Share of the gap that named causes have to explain, if the recordings do not separate a
        change from the misfit of another motion.
    surely : float
        Standard deviations attributed to noise: a value may exceed its bound by as many, and a
        joint is worse, or held, only beyond them.
    one_period : float
        Ratio of the power of the difference of two periods, at low over high frequency, that shows
        an event in one of them: at most 3.6 in 60 sets of the laboratory without events.
    one_period_on_average : float
        The same ratio as a mean of three recordings or more: at most 2.4 in these sets. Noise
        correlated over 80 ms reaches 3.7, and events in one period start there. A false alarm is
        preferred to an unseen contact.

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


@dataclass(frozen=True)
class DiagnosisSettings:
    """
    Settings of a diagnosis that the user may choose.

    Attributes
    ----------
    library : tuple of str
        Effects of the catalogue that may be named.
    own : tuple of type of Effect
        User-defined effects that may be named.
    partner : Partner or None
        Another machine that was recorded with the arm, to which it may be tied. Springs and
        contacts are then searched for between the two, and not at unknown places.
    signals : SignalSettings
        Filters; chosen from the recordings by default.
    material : float
        Share of a joint's rms torque below which a cause is not material [-].
    everything : bool
        Whether causes that are not material are added to the patched model as well.
    prior : mapping of str to str
        Frequency of effects on this arm, by name: often, usual, seldom or never.
    thresholds : Thresholds
        The thresholds of the decisions.

    Raises
    ------
    ModelError
        If an effect or a frequency of ``prior`` is not known.

    """

    library: tuple[str, ...] = field(
        default_factory=lambda: tuple(name for name, kind in CATALOGUE.items() if not kind.learned)
    )
    own: tuple[type[Effect], ...] = ()
    partner: Partner | None = None
    signals: SignalSettings = field(default_factory=SignalSettings)
    material: float = 0.01
    everything: bool = False
    prior: Mapping[str, str] = field(default_factory=dict)
    thresholds: Thresholds = field(default_factory=Thresholds)

    def __post_init__(self) -> None:
        """Check the effect names and the frequency words in `prior`."""
        names = [kind.name for kind in self.kinds]
        for effect, frequency in self.prior.items():
            for word, known, kind in (
                (effect, names, 'effect'),
                (frequency, HOW_OFTEN, 'frequency'),
            ):
                if word not in known:
                    raise ModelError(
                        f"prior '{effect}={frequency}': unknown {kind} '{word}'"
                        f'{meant(word, known)}; known are: {", ".join(known)}'
                    )

    @property
    def kinds(self) -> tuple[type[Effect], ...]:
        """Classes of all effects that may be named."""
        tied = () if self.partner is None else (TiedInteraction.name, TiedSlack.name)
        return (*(CATALOGUE[name] for name in self.library if name not in tied), *self.own)


def log_prior(effect: Effect, robot: Robot, changed: bool) -> float:
    """Return the prior log odds of an effect: as an error of the model, or as a change."""
    names, name = list(CATALOGUE), effect.name
    odds = RARER * (names.index(name) if name in CATALOGUE else len(names))
    odds += SHAPE * len(effect.shape)
    if changed and effect.traits.corrects:
        odds += NEVER
    elif not effect.in_usual_place(robot):
        odds += INNER if changed and effect.changes_body else ELSEWHERE
    odds += OUTSIDE if effect.traits.external else 0.0
    odds += FOLLOWS if effect.lasting else 0.0
    return odds - float(np.log(max(len(effect.places(robot)), 1)))
