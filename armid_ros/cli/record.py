# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands `armid simulate`, and `armid recover` for bags whose writer was killed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters
from armid_ros.cli.choices import EFFECT_EXAMPLES
from armid_ros.cli.terminal import progress, say
from armid_ros.errors import ModelError
import click

if TYPE_CHECKING:
    from armid_ros.effects import Effect
    from armid_ros.motion import FloatArray
    from armid_ros.robots import Robot


@click.command(epilog='Example: armid simulate --robot humanoid_arm --gravity moon --out run')
@parameters.robot
@parameters.bag
@click.option(
    '--effect',
    'texts',
    shell_complete=parameters.completed,
    multiple=True,
    metavar='NAME:k=v',
    help=f'Effect such as {EFFECT_EXAMPLES}. Every joint gets the values; for different joints '
    'give the option several times, as NAME@A:k=v and NAME@B:k=w.',
)
@click.option(
    '--model',
    type=parameters.ModelPath(path_type=Path),
    help='A model.yaml of armid identify.',
)
@click.option(
    '--trajectory', type=click.Path(path_type=Path), help='YAML, CSV or bag of armid excite.'
)
@click.option('--rate', default=1000.0, show_default=True, help='Sample rate to record at [Hz].')
@click.option(
    '--loop-gain',
    default=1.0,
    show_default=True,
    help='Factor of the gains of the velocity loops that drive elastic joints.',
)
@click.option('--torque-noise', default=0.0, help='Torque noise (std) [N m or N]; default 0.')
@click.option('--position-noise', default=0.0, help='Position noise (std) [rad or m]; default 0.')
@click.option(
    '--velocity-noise', default=0.0, help='Velocity noise (std) [rad/s or m/s]; default 0.'
)
@click.option(
    '--acceleration-noise',
    default=0.0,
    help='Noise (std) of accelerometers on links with springs [m/s^2].',
)
@click.option(
    '--temperature',
    metavar='T',
    help='Temperature of the joints [degC], written to the bag: 25, or 20:45:600 for 20 to 45 '
    'with a time constant of 600 s; with commas one for each joint.',
)
@click.option('--resolution', default=0.0, help='Encoder resolution [rad or m]; default 0, none.')
@parameters.setting
def simulate(
    robot_source: str,
    gravity: str,
    joints: str | None,
    out: Path,
    texts: tuple[str, ...],
    model: Path | None,
    trajectory: Path | None,
    rate: float,
    loop_gain: float,
    temperature: str | None,
    seed: int,
    **noise: Any,
) -> None:
    """
    Record a simulated arm that follows a trajectory.

    Joints with joint_elasticity and rotor_inertia have motors that move relative to the links;
    such an arm is recorded on both sides of its springs.

    """
    from armid_ros.api.simulation import recording_of, reference_of
    from armid_ros.cli import options
    from armid_ros.recording import write_recording
    from armid_ros.recording.elastic import write_runs
    from armid_ros.simulation import Sensors
    from armid_ros.simulation.elastic import make_simulated_arm, shipped_arm
    from armid_ros.simulation.plant import require_masses
    from armid_ros.simulation.run import record
    from armid_ros.simulation.warm_up import at_temperature, temperature_course
    import numpy as np

    rng = np.random.default_rng(seed)
    robot = options.open_robot(robot_source, gravity, joints)
    if model is None:
        require_masses(robot)
        arm, drives = shipped_arm(robot)
    else:
        arm, drives = options.model_of(model, robot), None
    for text in texts:
        arm = arm.with_effect(*_parse_effect(text, robot))
    with progress('designing a trajectory') as tick:
        reference = reference_of(robot, trajectory, rng, options.read_settings())
        course = None
        if temperature is not None:
            course = temperature_course(temperature, robot.n_joints, reference.duration)
            arm = at_temperature(arm, course)
        tick(0.0, 'simulating')
        plant = make_simulated_arm(
            arm, rng=rng, warn=say, drives=drives, gain=loop_gain, sensors=Sensors(**noise)
        )
        run = record(plant, reference, rate=rate, progress=tick)
        if run.sides is None:
            write_recording(out, recording_of(run, course), robot_description=robot.urdf)
        else:
            write_runs(out, [run.sides], plant.plant.robot)
    sides = '' if run.sides is None else ' on both sides'
    done = f'{len(run.t)} samples of {robot.n_joints} joints{sides}'
    say(f'{out}: {done}, {reference.duration:.1f} s')


def _parse_effect(text: str, robot: Robot) -> tuple[Effect, FloatArray]:
    """Convert the text of --effect; ModelError for size zero, warn of an impossible payload."""
    from armid_ros.effects import parse_effect
    from armid_ros.simulation.plant import possible_loads
    import numpy as np
    import pinocchio as pin

    effect, values = parse_effect(text, robot)
    if not any(values):
        raise ModelError(
            f"--effect '{text}' has zero size and would change nothing; write "
            f'{text.partition(":")[0]}:{effect.quantities[0].name}=0.1. '
            f"'armid effects {effect.name}' lists its values"
        )
    if effect.traits.weighs and not possible_loads(robot, values):
        point = pin.Inertia(values[0], values[1:4] / (values[0] or np.inf), np.zeros((3, 3)))
        inertia = zip(effect.quantities[4:], point.toDynamicParameters()[4:], strict=True)
        parts = [f'{quantity.name}={size:.6g}' for quantity, size in inertia if size]
        say(
            f"warning: --effect '{text}': no body within reach of the arm has these values. "
            'payload_mx etc. are payload_m times distance. payload_Ixx etc. are about the joint, '
            f'at least those of a point mass: {",".join(parts) or 0}',
            'yellow',
        )
    return effect, values


@click.command(epilog='Example: armid recover crashed/crashed_0.mcap --out whole')
@click.argument('file', type=click.Path(path_type=Path))
@parameters.bag
@parameters.reading
def recover(file: Path, out: Path) -> None:
    """Write a repaired copy of a recording whose writer was killed."""
    from armid_ros.cli import options
    from armid_ros.recording import copy_bag

    say(copy_bag(file, out, options.read_settings()).describe())
