# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How an excitation is run on an arm: parameters of the excitation publisher."""

from __future__ import annotations

from armid_ros.nodes.parameters.table import NodeParameter

SIMULATION = NodeParameter(
    'simulation',
    False,
    'The arm is simulated: by default it begins by itself, and fast. So it is with use_sim_time.',
)
START = NodeParameter(
    'start',
    False,
    'Begin without ~/start, as soon as joint states arrive and a controller subscribes; true by '
    'default in a simulation only.',
)

INTERFACE_PARAMETERS = (
    NodeParameter(
        'interface',
        'auto',
        'How trajectories are sent: as goals of the action, which needs the package control_msgs; '
        'by topic, which no controller answers; auto: by the action where there is one when the '
        'run begins.',
        choices=('auto', 'topic', 'action'),
    ),
    NodeParameter(
        'action',
        '',
        'Name of the action; empty: follow_joint_trajectory beside the topic joint_trajectory, '
        'where that is remapped to.',
    ),
    NodeParameter(
        'goal_tolerance',
        0.0,
        'How far a joint may be from the end for the goal to be reached; 0: what the controller '
        'has. On the way the controller gets tracking_tolerance.',
        'rad or m',
        lower=0.0,
        upper=10.0,
        read_only=False,
    ),
    NodeParameter(
        'goal_time_tolerance',
        0.0,
        'How much later than planned the end may be reached; 0: what the controller has.',
        's',
        lower=0.0,
        upper=60.0,
        read_only=False,
    ),
)

RUN_PARAMETERS = (
    *INTERFACE_PARAMETERS,
    NodeParameter('rate', 100.0, 'Waypoints per second.', 'Hz', lower=1.0, upper=1000.0),
    NodeParameter(
        'approach',
        3.0,
        'Shortest time to get to the first point; more where distance and limits ask for it.',
        's',
        lower=0.1,
        upper=60.0,
        read_only=False,
    ),
    NodeParameter(
        'speed_scaling',
        1.0,
        'Share of its speed at which ~/start runs the excitation.',
        lower=0.1,
        upper=1.0,
        read_only=False,
    ),
    NodeParameter(
        'rehearsal_speed',
        0.2,
        'Share of its speed at which ~/rehearse runs it.',
        lower=0.05,
        upper=1.0,
        read_only=False,
    ),
    NodeParameter(
        'zero_stamp',
        False,
        'Stamp the run with zero, which a controller takes for now: where the clocks of this '
        'computer and of the robot differ. Stops are always stamped with zero.',
    ),
    NodeParameter(
        'stopping',
        0.5,
        'Time in which the arm is brought to rest; longer where its limits require it. Without '
        'zero_stamp the arm is not started where clocks differ by more than a tenth of it.',
        's',
        lower=0.1,
        upper=10.0,
        read_only=False,
    ),
    SIMULATION,
    START,
    NodeParameter(
        'tracking_tolerance',
        0.2,
        'The arm is stopped when a joint is further from where it should be.',
        'rad or m',
        lower=0.001,
        upper=10.0,
        read_only=False,
    ),
    NodeParameter(
        'effort_factor',
        3.0,
        'The arm is stopped when the effort of a joint is, three times in a row, larger by this '
        'factor than what is foreseen for the run and than 10 % of its limit; 0: never, the '
        'default in a simulation.',
        lower=0.0,
        upper=1000.0,
        read_only=False,
    ),
    NodeParameter(
        'state_timeout',
        0.5,
        'The arm is stopped, and not started, without a joint state for so long; 5 s by default '
        'in a simulation.',
        's',
        lower=0.01,
        upper=10.0,
        read_only=False,
    ),
    NodeParameter(
        'subscriber_timeout',
        10.0,
        'How long to wait for a subscriber and joint states; then only ~/start begins.',
        's',
        lower=0.0,
        upper=3600.0,
    ),
)
