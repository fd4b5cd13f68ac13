# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags without a robot: simulated ones, and those whose writer was killed."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.choices import (
    EFFECT_EXAMPLES,
)
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid simulate --robot humanoid_arm --gravity moon --out run')
@options.robot
@options.bag
@click.option(
    '--effect',
    'texts',
    multiple=True,
    metavar='NAME:k=v',
    help=f'Such as {EFFECT_EXAMPLES}. Every joint gets the values; for others in single joints '
    'give it several times, as NAME@A:k=v and NAME@B:k=w.',
)
@click.option('--model', type=click.Path(path_type=Path), help='A model.yaml of armid identify.')
@click.option(
    '--trajectory', type=click.Path(path_type=Path), help='A YAML, CSV or bag of armid excite.'
)
@click.option('--rate', default=1000.0, show_default=True, help='Recorded samples per second.')
@click.option(
    '--loop-gain',
    default=1.0,
    show_default=True,
    help='Share of the gains of the velocity loops that drive elastic joints.',
)
@click.option('--torque-noise', default=0.0, help='Standard deviation [N m].')
@click.option('--position-noise', default=0.0, help='Standard deviation [rad].')
@click.option('--velocity-noise', default=0.0, help='Standard deviation [rad/s].')
@click.option(
    '--acceleration-noise', default=0.0, help='Of accelerometers on links with springs [m/s^2].'
)
@click.option('--resolution', default=0.0, help='Step of the encoders [rad].')
@options.gravity
@options.joints
@options.seed
@options.reading
@done_by('record')
def simulate() -> None:
    """
    Let a simulated arm follow a trajectory and record it.

    Joints with joint_elasticity and rotor_inertia have motors with a motion of their own; such an
    arm is recorded on both sides of its springs.

    """


@click.command(epilog='Example: armid recover crashed/crashed_0.mcap --out whole')
@click.argument('file', type=click.Path(path_type=Path))
@options.bag
@options.reading
@done_by('record')
def recover() -> None:
    """Make a recording whole whose writer was killed; the file itself is left as it is."""
