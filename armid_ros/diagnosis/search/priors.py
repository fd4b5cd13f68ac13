# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Prior knowledge of causes: how often they happen, and how large they are."""

from __future__ import annotations

from armid_ros.effects import CATALOGUE, Effect
from armid_ros.robots import Robot
import numpy as np

#: How often an effect happens to an arm, as its user says it: log odds over the usual ones.
HOW_OFTEN = {'often': 2.0, 'usual': 0.0, 'seldom': -3.0, 'never': -30.0}
#: Log odds of what never happens between two days: a link does not change.
NEVER = -5.0
#: Of a load of an inner link, between two days.
INNER = -2.0
#: Of another unusual place: a delay of one joint, a lag of the whole arm.
ELSEWHERE = -1.5
#: Of what acts from outside of the arm: it can pull in any way.
OUTSIDE = -4.0
#: Of each place in the catalogue, which goes from the common to the rare.
RARER = -0.05
#: Probability that a law outside of the catalogue acts and resembles the best cause: 6 of 70
#: names of development arms.
UNLISTED = 0.09
#: Of each shape that the data choose.
SHAPE = -3.0
#: Standard deviations of values over the unit of a cause, all as likely.
SIZES = np.array([0.01, 0.03, 0.1, 0.3, 1.0])
#: That of values that were there before, and the most that values differ by between recordings.
THERE = 0.3


def log_prior(effect: Effect, robot: Robot, changed: bool) -> float:
    """Return the log odds of an effect in one place before any data."""
    names, name = list(CATALOGUE), effect.said_as
    odds = RARER * (names.index(name) if name in CATALOGUE else len(names))
    odds += SHAPE * len(effect.shape)
    if changed and effect.traits.corrects:
        odds += NEVER
    elif not effect.in_usual_place(robot):
        odds += INNER if changed and effect.changes_body else ELSEWHERE
    odds += OUTSIDE if effect.traits.external else 0.0
    return odds - float(np.log(max(len(effect.places(robot)), 1)))
