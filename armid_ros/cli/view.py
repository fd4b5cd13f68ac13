# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording to look at, with the arm that moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.cli import columns, options
from armid_ros.cli.groups import gathered, RobotChoice
from armid_ros.cli.terminal import say
from armid_ros.errors import ArmidError, OutputError
from armid_ros.files.cells import listed
from armid_ros.robots import Robot
from armid_ros.view import log_scene, make_scene, open_stream, rerun
from armid_ros.view.scene import Scene


@dataclass(frozen=True)
class OptionalRobot:
    """
    The robot that is meant; without a source, that of the model or of the bag.

    Attributes
    ----------
    robot_source, gravity, joints
        As of a ``RobotChoice``.

    """

    robot_source: str | None
    gravity: str
    joints: str | None

    def load(self, bags: Sequence[Path]) -> Robot:
        """Load it; say what is not driven."""
        source = '-' if self.robot_source is None else self.robot_source
        return RobotChoice(source, self.gravity, self.joints).load(bags)


@gathered(robot=OptionalRobot)
def view(
    bag: Path | None,
    model: Path | None,
    robot: OptionalRobot,
    out: Path | None,
    mark: str | None,
    live: bool,
    namespace: str,
    topic: str | None,
) -> None:
    """Look at a recording in rerun: the moving arm, torques, and what a model does not explain."""
    if live == (bag is not None):
        raise ArmidError('armid view shows a BAG, or with --live what is on the topics: name one')
    if live:
        _live(
            {
                'robot': robot.robot_source if robot.robot_source != '-' else '',
                'joints': list(listed(robot.joints)) if robot.joints else [],
                'mark': list(listed(mark)) if mark else [],
                'out': str(out or ''),
            },
            namespace,
        )
        return
    assert bag is not None
    arm = _arm(bag, model, robot)
    (recording,) = columns.read([bag], arm.robot, topic)
    marked = listed(mark) if mark else _named(model)
    scene = make_scene(arm, recording, marked)
    if out is None:
        stream = open_stream(scene.name)
        log_scene(scene, stream)
        stream.disconnect()
    else:
        _save(scene, out)
    for note in scene.notes:
        say(f'note: {note}')
    said = f', coloured: {", ".join(marked)}' if marked else ''
    if out is not None:
        say(f'{out}: {len(recording)} samples of {arm.robot.n_joints} joints{said}; rerun {out}')


def _save(scene: Scene, out: Path) -> None:
    """Write a file beside its place and move it there, so that it is whole or absent."""
    beside = out.with_name(f'.{out.name}.part')
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        beside.unlink(missing_ok=True)
        beside.touch(exist_ok=False)
        stream = open_stream(scene.name, beside)
        log_scene(scene, stream)
        stream.disconnect()
        beside.replace(out)
    except OSError as error:
        raise OutputError(f'{out}: cannot be written: {error.strerror}') from error


def _live(parameters: dict[str, Any], namespace: str) -> None:
    rerun()  # is it there at all?
    from armid_ros.nodes.viewer import show_topics

    show_topics(parameters, namespace)


def _arm(bag: Path, model: Path | None, robot: OptionalRobot) -> ArmModel:
    """Return the model that is meant; without one, the bodies of the description."""
    loaded = None if robot.robot_source is None else robot.load([bag])
    if model is not None:
        return options.model_of(model / 'model.yaml' if model.is_dir() else model, loaded)
    return ArmModel(robot.load([bag]) if loaded is None else loaded)


def _named(model: Path | None) -> tuple[str, ...]:
    """Return the joints of what a diagnosis beside the model names."""
    if model is None:
        return ()
    path = (model if model.is_dir() else model.parent) / 'diagnosis.json'
    if not path.is_file():
        return ()
    effects = json.loads(path.read_text(encoding='utf-8'))['effects']
    return tuple(dict.fromkeys(joint for effect in effects for joint in effect['joints']))
