# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Prior knowledge of causes: their frequencies and sizes."""

from __future__ import annotations

from armid_ros.effects import CATALOGUE, Effect
from armid_ros.robots import Robot
import numpy as np

#: Log odds by frequency of an effect, which the user may set, relative to the default odds.
HOW_OFTEN = {'often': 2.0, 'usual': 0.0, 'seldom': -3.0, 'never': -30.0}
#: Log odds of a change of a link between two days, which is extremely rare.
NEVER = -5.0
#: Log odds of a load on an inner link, between two days.
INNER = -2.0
#: Log odds of other unusual joints: a delay of one joint, a lag of the whole arm.
ELSEWHERE = -1.5
#: Log odds of causes outside of the arm, which can pull in any direction.
OUTSIDE = -4.0
#: Log odds of friction that follows a measured temperature, as that of every gear does.
FOLLOWS = 5.5
#: Log odds per position in the catalogue, whose order is from common to rare effects.
RARER = -0.05
#: Probability that the true cause is not in the catalogue and resembles the best cause: 6 of 70
#: names of development arms.
UNLISTED = 0.09
#: Log odds per fitted shape parameter.
SHAPE = -3.0
#: Prior standard deviations of the values over the unit of a cause, equally likely.
SIZES = np.array([0.01, 0.03, 0.1, 0.3, 1.0])
#: Prior standard deviation of earlier values, and largest one of differences between recordings,
#: both over the unit of a cause.
THERE = 0.3


def log_prior(effect: Effect, robot: Robot, changed: bool) -> float:
    """Return the prior log odds of an effect on certain joints."""
    names, name = list(CATALOGUE), effect.said_as
    odds = RARER * (names.index(name) if name in CATALOGUE else len(names))
    odds += SHAPE * len(effect.shape)
    if changed and effect.traits.corrects:
        odds += NEVER
    elif not effect.in_usual_place(robot):
        odds += INNER if changed and effect.changes_body else ELSEWHERE
    odds += OUTSIDE if effect.traits.external else 0.0
    odds += FOLLOWS if effect.lasting else 0.0
    return odds - float(np.log(max(len(effect.places(robot)), 1)))
