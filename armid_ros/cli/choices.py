# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Values of command options, copied from other packages, so that help imports none of them.

A test compares each copy with its original in the package.

"""

from __future__ import annotations

#: Effects that are fitted if none are named; `armid_ros.effects.USUAL_EFFECTS`.
USUAL_EFFECTS = ('viscous_friction', 'coulomb_friction', 'torque_offset')
#: Examples of effects with values; `armid_ros.effects.catalogue.EXAMPLES`.
EFFECT_EXAMPLES = 'viscous_friction:viscous_coefficient=0.1 or payload@wrist:payload_m=0.3'
#: `armid_ros.identification.fitting.least_squares.ESTIMATORS`.
ESTIMATORS = ('ols', 'wls', 'irls', 'iv')
#: Units of time of a table; `armid_ros.recording.columns.TIME_UNITS`.
TIME_UNITS = ('s', 'ms', 'us', 'ns')
#: `armid_ros.excitation.SPEED_CLASSES`.
SPEED_CLASSES = ('slow', 'medium', 'fast')
#: `armid_ros.diagnosis.settings.HOW_OFTEN`.
HOW_OFTEN = ('often', 'usual', 'seldom', 'never')
#: The longest run [s]; `armid_ros.excitation.schedule.MAX_DURATION`.
MAX_DURATION = 86400.0
#: Criteria of a design, with their meaning; `armid_ros.excitation.CRITERIA`.
CRITERIA = {
    'D': 'volume of the confidence ellipsoid, log det of the information',
    'A': 'mean variance of the parameters, each scaled to its torque',
    'E': 'variance along the worst direction, with parameters scaled to their torque',
    'condition': 'condition number of the weighted regressor',
    'T': 'torque that a rival model cannot explain',
}
#: Parameters in the criterion; `armid_ros.excitation.TARGETS`.
TARGETS = {
    'all': 'all base parameters of the rigid body, and those of the effects',
    'gravity': 'masses and first moments, as identified from slow motion, and the effects',
    'effects': 'parameters of the effects only; the rigid body is known',
}
