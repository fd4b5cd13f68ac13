# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags without a robot: simulated ones, and those whose writer was killed."""

from __future__ import annotations

from pathlib import Path

from armid_ros.arm import ArmModel, load_model
from armid_ros.cli import options
from armid_ros.cli.terminal import progress, say
from armid_ros.effects import parse_effect
from armid_ros.excitation import design, DesignSettings, load_excitation
from armid_ros.recording import recover as recover_bag
from armid_ros.recording import write_recording
from armid_ros.robots import collision_model
from armid_ros.simulation import Sensors
from armid_ros.simulation import simulate as run
import click
import numpy as np


@click.command(epilog='Example: armid simulate --robot humanoid_arm --gravity moon --out run')
@options.robot
@options.bag
@click.option(
    '--effect',
    'texts',
    multiple=True,
    metavar='NAME:k=v',
    help='Such as viscous_friction:viscous_coefficient=0.1 or payload@wrist:payload_m=0.3.',
)
@click.option('--model', type=click.Path(path_type=Path), help='A model.yaml of armid identify.')
@click.option(
    '--trajectory', type=click.Path(path_type=Path), help='A YAML or CSV of armid excite.'
)
@click.option('--rate', default=1000.0, show_default=True, help='Recorded samples per second.')
@click.option('--torque-noise', default=0.0, help='Standard deviation [N m].')
@click.option('--position-noise', default=0.0, help='Standard deviation [rad].')
@click.option('--resolution', default=0.0, help='Step of the encoders [rad].')
@options.gravity
@options.joints
@options.seed
def simulate(
    robot_source: str,
    out: Path,
    texts: tuple[str, ...],
    model: Path | None,
    trajectory: Path | None,
    rate: float,
    torque_noise: float,
    position_noise: float,
    resolution: float,
    gravity: str,
    joints: str | None,
    seed: int,
) -> None:
    """Let a simulated arm follow a trajectory and record it."""
    rng = np.random.default_rng(seed)
    robot = options.open_robot(robot_source, gravity, joints)
    arm = load_model(model, robot) if model else ArmModel(robot)
    for text in texts:
        arm = arm.with_effect(*parse_effect(text, robot))
    sensors = Sensors(
        torque_noise=torque_noise, position_noise=position_noise, resolution=resolution
    )
    with progress('designing a trajectory') as tick:
        if trajectory:
            excitation = load_excitation(trajectory)
        else:
            settings = DesignSettings(period=10.0, starts=1, candidates=10, iterations=1)
            excitation = design(
                ArmModel(robot), settings, rng, collision=collision_model(robot)
            ).excitation
        tick(0.0, 'simulating')
        measured = run(
            arm, excitation.motion(1000.0), rng=rng, sensors=sensors, rate=rate, progress=tick
        )
    write_recording(out, measured, robot_description=robot.urdf)
    say(f'{out}: {len(measured.t)} samples of {robot.n_joints} joints, {measured.t[-1]:.1f} s')


@click.command(epilog='Example: armid recover crashed/crashed_0.mcap --out whole')
@click.argument('file', type=click.Path(path_type=Path))
@options.bag
def recover(file: Path, out: Path) -> None:
    """Make a recording whole whose writer was killed; the file itself is left as it is."""
    say(recover_bag(file, out).describe())
