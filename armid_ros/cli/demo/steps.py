# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo does in order: a true arm, an excitation, a run over topics, figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from armid_ros.arm import ArmModel
from armid_ros.cli.terminal import progress
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError, visible
from armid_ros.estimate import Estimate
from armid_ros.excitation import design, DesignSettings, Excitation
from armid_ros.files import load_yaml, read_text
from armid_ros.identification import Grade, Identification
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.motion import FloatArray
from armid_ros.nodes.lockstep import Progress, run_lockstep
from armid_ros.recording import Recording
from armid_ros.report import identification_report
from armid_ros.report.identification_report import Assessment
from armid_ros.report.sections.convergence import convergence_section
from armid_ros.robots import collision_model, Robot
from armid_ros.robots.shipped import shipped_path
from armid_ros.simulation import Sensors, SimulatedArm
import numpy as np
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

ROBOT = 'humanoid_arm'
SENSORS = Sensors(
    torque_noise=np.array([0.02, 0.02, 0.01, 0.01, 0.004, 0.004]), resolution=2.0 * np.pi / 2**18
)


def true_arm(robot: Robot) -> ArmModel:
    """Return the arm that is to be identified: other masses than described, and friction."""
    path = shipped_path(ROBOT).with_name('demo.yaml')
    true = load_yaml(read_text(path, ModelError))
    factors = np.array(true['mass_factors'])[:, np.newaxis]
    parameters = robot.rigid_parameters.reshape(-1, 10) * factors
    arm = ArmModel(robot.with_inertias(parameters.ravel()))
    for name, values in true['effects'].items():
        arm = arm.with_effect(make_effect(name, robot), values)
    return arm


def excite(arm: ArmModel, rng: np.random.Generator) -> Excitation:
    """Design the excitation."""
    settings = DesignSettings(period=10.0, harmonics=5, starts=2, candidates=20, iterations=40)
    with progress('designing the excitation') as tick:
        result = design(
            arm,
            settings,
            rng,
            collision=collision_model(arm.robot),
            progress=lambda now: tick(now.done),
        )
    return result.excitation


def run_online(
    plant: SimulatedArm,
    excitation: Excitation,
    identifier: OnlineIdentifier,
    target: FloatArray,
    bag: Path,
    rate: float,
) -> tuple[list[Progress], Progress]:
    """Move the arm and identify it online, in a table; return what was said, and the end."""
    history: list[Progress] = []
    with ConvergenceTable(target) as table:

        def watch(now: Progress) -> None:
            history.append(now)
            table.show(now.t, now.duration, now.estimate, now.real_time_factor)

        end = run_lockstep(plant, excitation, identifier, bag, rate=rate, on_progress=watch)
    return history, end


def held_out_error(arm: ArmModel, truth: ArmModel, rng: np.random.Generator) -> float:
    """Return the error of the torque in a motion that was never run, in percent of the torque."""
    settings = DesignSettings(period=10.0, starts=1, candidates=1, iterations=1, processes=1)
    collision = collision_model(arm.robot)
    motion = design(arm, settings, rng, collision=collision).excitation.motion(100.0)
    tau = truth.torque(motion)
    return float(100.0 * np.linalg.norm(arm.torque(motion) - tau) / np.linalg.norm(tau))


def page(
    result: Identification,
    history: Sequence[Progress],
    online_truth: FloatArray,
    truth: ArmModel,
    graded: Grade,
    recording: Recording,
) -> str:
    """Return report.html, with the truth and the convergence of the online estimate."""
    convergence = convergence_section(
        np.array([now.t for now in history]),
        np.array([now.estimate.values for now in history]),
        np.array([now.estimate.std for now in history]),
        online_truth,
        history[-1].estimate.parameters,
    )
    assessment = Assessment(grade=graded, reference='truth', sections=[convergence])
    return identification_report(
        result,
        description=truth,
        robot=truth.robot.name,
        recordings=[recording],
        validation={},
        assessment=assessment,
    )


class ConvergenceTable:
    """
    A live table of the last parameters, which are those of the effects.

    Parameters
    ----------
    truth : ndarray, shape (P,)
        What the estimate should come to.

    """

    ROWS = 12

    def __init__(self, truth: FloatArray) -> None:
        self._truth = truth
        self._live = Live(console=Console(stderr=True), transient=True)

    def __enter__(self) -> Self:
        """Begin to show."""
        self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the terminal as it was."""
        self._live.stop()

    def show(self, t: float, duration: float, estimate: Estimate, factor: float) -> None:
        """Show the state at a time [s]."""
        title = f'{t:.0f} of {duration:.0f} s, {factor:.1f} x real time'
        table = Table(title=title, box=None, header_style='bold')
        for head in ('parameter', 'joint', 'estimate', 'std', 'truth', 'unit'):
            table.add_column(
                head, justify='right' if head in ('estimate', 'std', 'truth') else 'left'
            )
        for k in range(len(self._truth))[-self.ROWS :]:
            name = estimate.parameters[k]
            numbers = (estimate.values[k], estimate.std[k], self._truth[k])
            texts = [f'{number:.4f}' for number in numbers]
            cells = (name.name, name.joint, *texts, name.unit)
            table.add_row(*(Text(visible(cell)) for cell in cells))
        self._live.update(table)
