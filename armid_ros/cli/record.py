# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags without a robot: simulated ones, and those whose writer was killed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.cli import options
from armid_ros.cli.groups import gathered, RobotChoice
from armid_ros.cli.terminal import progress, say, Tick
from armid_ros.effects import Effect, parse_effect
from armid_ros.errors import ModelError
from armid_ros.excitation import design, DesignSettings, load_excitation
from armid_ros.motion import FloatArray
from armid_ros.recording import read_waypoints, write_recording
from armid_ros.recording import recover as recover_bag
from armid_ros.recording.elastic_topics import write_runs
from armid_ros.robots import collision_model, Robot
from armid_ros.robots.two_link import TwoLinkSet
from armid_ros.simulation import Reference, Sensors, SimulatedArm
from armid_ros.simulation import simulate as run
from armid_ros.simulation.bodies import NoBodyError, require_masses
from armid_ros.simulation.elastic.record import record
from armid_ros.simulation.elastic.setup import (
    elastic_joints,
    make_elastic_arm,
    no_rotor,
    shipped_arm,
)
import numpy as np


@dataclass(frozen=True)
class ArmOptions:
    """
    The arm that is simulated.

    Attributes
    ----------
    texts : tuple of str
        Effects with their sizes.
    model : Path or None
        A model.yaml.

    """

    texts: tuple[str, ...]
    model: Path | None

    def model_and_drives(self, robot: Robot) -> tuple[ArmModel, TwoLinkSet | None]:
        """Return the model, and the motors of a shipped arm."""
        if self.model is None:
            require_masses(robot)
            arm, drives = shipped_arm(robot)
        else:
            arm, drives = options.model_of(self.model, robot), None
        for text in self.texts:
            arm = arm.with_effect(*_of_some_size(text, robot))
        return arm, drives


@dataclass(frozen=True)
class NoiseOptions:
    """
    What the sensors make of the truth.

    Attributes
    ----------
    torque_noise, position_noise, velocity_noise, acceleration_noise : float
        Standard deviations [N m, rad, rad/s, m/s^2].
    resolution : float
        Step of the encoders [rad].

    """

    torque_noise: float
    position_noise: float
    velocity_noise: float
    acceleration_noise: float
    resolution: float

    def sensors(self) -> Sensors:
        """Return the sensors."""
        return Sensors(
            torque_noise=self.torque_noise,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
            acceleration_noise=self.acceleration_noise,
            resolution=self.resolution,
        )


@gathered(robot=RobotChoice, arm=ArmOptions, noise=NoiseOptions)
def simulate(
    robot: RobotChoice,
    out: Path,
    arm: ArmOptions,
    trajectory: Path | None,
    rate: float,
    loop_gain: float,
    noise: NoiseOptions,
    seed: int,
) -> None:
    """Let a simulated arm follow a trajectory and record it."""
    rng = np.random.default_rng(seed)
    loaded = robot.load()
    model, drives = arm.model_and_drives(loaded)
    springs, rotorless = elastic_joints(model)
    if rotorless:
        say(no_rotor(rotorless))
    sensors = noise.sensors()
    with progress('designing a trajectory') as tick, _blaming(arm.texts, loaded):
        reference = _reference(loaded, trajectory, rng)
        tick(0.0, 'simulating')
        if springs and not rotorless:
            elastic = make_elastic_arm(
                model, rng=rng, drives=drives, gain=loop_gain, sensors=sensors
            )
            samples, sides = _both_sides(out, elastic, reference, rate, tick), ' on both sides'
        else:
            measured = run(model, reference, rng=rng, sensors=sensors, rate=rate, progress=tick)
            write_recording(out, measured, robot_description=loaded.urdf)
            samples, sides = len(measured.t), ''
    say(f'{out}: {samples} samples of {loaded.n_joints} joints{sides}, {reference.duration:.1f} s')


@contextmanager
def _blaming(texts: Sequence[str], robot: Robot) -> Iterator[None]:
    """Name the --effect that adds to a body where links turn out to be none."""
    try:
        yield
    except NoBodyError as error:
        for text in texts:
            effect, _ = parse_effect(text, robot)
            moments = [q.name for q in effect.quantities if q.unit == 'kg m^2']
            if effect.changes_body and moments:
                where = ', '.join(effect.joints) or 'the last joint'
                raise ModelError(
                    f"--effect '{text}': with it what {where} moves is no body: a mass whose "
                    'centre is off the joint has moments of inertia about it, mass times distance '
                    f'squared; give {moments[0]} and the others too, or a smaller first moment'
                ) from error
        raise


def _of_some_size(text: str, robot: Robot) -> tuple[Effect, FloatArray]:
    """Read --effect; refuse one of no size, which would change nothing."""
    effect, values = parse_effect(text, robot)
    if not np.any(values):
        sizes = ', '.join(f'{q.name} [{q.unit or "1"}]' for q in effect.quantities)
        shapes = ', '.join(f'{s.name} [{s.unit or "1"}]' for s in effect.shapes)
        first = effect.quantities[0].name
        raise ModelError(
            f"--effect '{text}' has no size and would change nothing: it takes {sizes}"
            + (f', and the shape {shapes}' if shapes else '')
            + f'; write {text.partition(":")[0]}:{first}=0.1'
        )
    return effect, values


def _reference(robot: Robot, path: Path | None, rng: np.random.Generator) -> Reference:
    """Return the trajectory in a file or bag of armid excite, or one that is made in a hurry."""
    if path is not None and (path.is_dir() or path.suffix in ('.mcap', '.db3')):
        read = read_waypoints(path, robot.joints, settings=options.read_settings())
        return Reference(read.joints, read.t, read.q, read.dq, read.ddq, read.tau)
    if path is not None:
        return Reference.of(load_excitation(path).motion(1000.0))
    settings = DesignSettings(period=10.0, starts=1, candidates=10, iterations=1)
    collision = collision_model(robot)
    return Reference.of(
        design(ArmModel(robot), settings, rng, collision=collision).excitation.motion(1000.0)
    )


def _both_sides(
    out: Path, arm: SimulatedArm, reference: Reference, rate: float, tick: Tick
) -> int:
    """Let an arm with elastic joints follow a trajectory, and write what both sides did."""
    measured = record(arm, reference, rate=rate, progress=tick)
    write_runs(out, [measured], arm.plant.robot, arm.accelerometers)
    return len(measured.motor)


def recover(file: Path, out: Path) -> None:
    """Make a recording whole whose writer was killed; the file itself is left as it is."""
    say(recover_bag(file, out, options.read_settings()).describe())
