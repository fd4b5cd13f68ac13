# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Words in column names, with their weights for each quantity."""

from __future__ import annotations

import re
from typing import Literal

QuantityName = Literal['position', 'velocity', 'effort']

#: Words for a current, which a gain converts to a torque.
CURRENTS = ('current', 'currents', 'curr', 'cur', 'i', 'iq', 'amp', 'amps', 'ampere', 'amperes')
WORDS: dict[QuantityName, dict[str, float]] = {
    'position': dict.fromkeys(('position', 'positions', 'pos', 'q', 'qpos', 'jpos'), 3.0)
    | dict.fromkeys(('angle', 'angles', 'ang', 'theta', 'qm'), 2.5)
    | {'state': 1.5, 'joint': 1.0, 'joints': 1.0},
    'velocity': dict.fromkeys(('velocity', 'velocities', 'vel', 'dq', 'qvel', 'qdot', 'jvel'), 3.0)
    | dict.fromkeys(('qd', 'speed', 'speeds', 'spd', 'dtheta', 'thetadot', 'dqm'), 2.5)
    | {'omega': 2.0},
    'effort': dict.fromkeys(('torque', 'torques', 'tau', 'effort', 'efforts'), 3.0)
    | dict.fromkeys(('trq', 'torq', 'eff', 'jtau', 'jeff'), 3.0)
    | dict.fromkeys(('tq', *CURRENTS), 2.5)
    | {'force': 2.0, 'load': 1.5, 'loads': 1.5, 'moment': 1.5, 'mom': 1.5},
}
TIMES = dict.fromkeys(('time', 't', 'timestamp', 'timestamps'), 3.0) | dict.fromkeys(
    ('secs', 'seconds', 'elapsed', 'date', 'datetime'), 2.0
)
#: Words for the time of measurement, preferred to the time of reception.
TIMES |= {'stamp': 3.5}
#: Words for measured quantities.
MEASURED = dict.fromkeys(
    ('meas', 'measured', 'act', 'actual', 'fb', 'feedback', 'observation'), 1.0
)
_COMMANDED = (
    'cmd command commanded des desired target ref reference con goal set setpoint ctrl control '
    'action ff feedforward traj leader'
)
_OF_OTHER_THINGS = (
    'err error ext external fric friction pert model pred predicted residual limit min max std '
    'temp temperature tcp ee cart cartesian acc ddq imu rel init gravity kin dyn'
)
#: Words for quantities that were not measured or are not of joints; with less weight, words for
#: processed quantities.
OTHERWISE = dict.fromkeys((_COMMANDED + ' ' + _OF_OTHER_THINGS).split(), -2.0) | dict.fromkeys(
    ('filt', 'filtered', 'est', 'estimated', 'se', 'disc', 'mot', 'motor'), -0.3
)

_BREAK = re.compile(r'[^A-Za-z0-9]+')


def words_of(name: str) -> list[str]:
    """Return the words of a name in small letters: 'actualQ_{}' is actual, q."""
    apart = re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', name)
    apart = re.sub(r'\d+', ' ', apart)
    return [word.lower() for word in _BREAK.split(apart) if word]


def is_quantity(word: str) -> bool:
    """Return whether a word says position, velocity or effort."""
    return any(word.lower() in words for words in WORDS.values())
