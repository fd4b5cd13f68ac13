# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What nodes that learn say of joint states that do not follow each other."""

from __future__ import annotations

DISTURBANCES = {
    'out_of_order': 'joint states whose stamp is not after that of the one before are left out',
    'impossible': 'joint states with numbers that no arm has are left out',
    'stamp': 'joint states whose stamp alone is off are left out',
    'erratic': 'joint states that follow neither those before nor each other are left out',
    'no_velocity': 'joint states without velocity are left out: measured_velocity asks for it',
    'jump_back': 'joint states jump back in time: what is made of them begins anew',
    'position_step': 'positions step, as when a clock is set or an encoder is zeroed: the filters '
    'begin anew',
    'missing': 'joint states are missing between those that came: a history of the publisher of '
    'less than a second at their rate, or a computer that has too much to do, loses some',
    'dropout': 'joint states are missing for longer than max_gap: the filters begin anew',
    'frozen': 'positions stay at the same numbers while efforts change: look whether the driver '
    'still reads the encoders',
}
#: What two nodes bring about that publish the same joints.
_OF_TWO = frozenset({'out_of_order', 'stamp', 'erratic', 'jump_back', 'position_step', 'spike'})


def disturbance(reason: str, several: str, text: str = '') -> str:
    """
    Say what was wrong with joint states.

    Parameters
    ----------
    reason : str
        A key of `DISTURBANCES`, or 'spike'.
    several : str
        Says which nodes publish them, where it is more than one.
    text : str
        What to say where it is no key.

    """
    said = text or DISTURBANCES[reason]
    return f'{said}; {several}' if several and reason in _OF_TWO else said
