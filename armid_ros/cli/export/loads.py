# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Export of the payload of a model as load data of robot controllers."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from itertools import permutations

from armid_ros.arm import ArmModel
from armid_ros.errors import meant, ModelError
from armid_ros.motion import FloatArray
from armid_ros.robots import NO_MASS
from armid_ros.robots.robot import PER_LINK
import numpy as np
import pinocchio as pin


@dataclass(frozen=True)
class CarriedLoad:
    """
    Payload fixed to a link of the robot: mass, centre of mass and inertia.

    Attributes
    ----------
    joint, frame : str
        Joint that moves the load, and link whose frame the values are in.
    body : pinocchio.Inertia
        Mass [kg], centre of mass (lever) [m], and inertia about it [kg m^2] in the frame's axes.

    """

    joint: str
    frame: str
    body: pin.Inertia

    def principal(self) -> tuple[FloatArray, FloatArray]:
        """Return principal moments of inertia (3,) [kg m^2], and the principal axes (3, 3)."""
        moments, axes = np.linalg.eigh(self.body.inertia)
        order = max(
            map(list, permutations(range(3))),
            key=lambda order: float(np.abs(np.diag(axes[:, order])).sum()),
        )
        axes = axes[:, order] * np.where(np.diag(axes[:, order]) < 0.0, -1.0, 1.0)
        if np.linalg.det(axes) < 0.0:  # left-handed: reverse one axis
            axes[:, np.argmin(np.diag(axes))] *= -1.0
        return moments[order], axes


def load_of(arm: ArmModel, joint: str | None = None, frame: str | None = None) -> CarriedLoad:
    """
    Return the payload of a model, expressed in a frame of the robot.

    Parameters
    ----------
    arm : ArmModel
        The model, with the effect payload.
    joint : str, optional
        Joint that moves the payload, if there are payloads on several.
    frame : str, optional
        A link that moves with the payload; by default tool0, flange, or the only such link.

    Raises
    ------
    ModelError
        There is no such payload or frame, several links may be the flange, a joint moves behind
        it, or the mass is not positive.

    """
    payloads: dict[str, FloatArray] = {}
    for effect, values in zip(arm.effects, arm.values, strict=True):
        if effect.traits.weighs and len(effect.quantities) == PER_LINK:
            for owner, ten in zip(effect.joints, values.reshape(-1, 10), strict=True):
                payloads[owner] = payloads.get(owner, np.zeros(PER_LINK)) + ten
    if not payloads:
        raise ModelError(
            f'the model of {arm.robot.name} has no payload to write: find it with armid diagnose '
            '--baseline, and name the model.yaml of that result'
        )
    if joint is None and len(payloads) == 1:
        (joint,) = payloads
    if joint is None or joint not in payloads:
        raise ModelError(f'name the joint of one payload with --joint: {", ".join(payloads)}')
    ten = payloads[joint]
    if not ten[0] > NO_MASS:
        raise ModelError(
            f"the payload of joint '{joint}' has a mass of {ten[0]:.4g} kg, which no controller "
            'accepts: record again with and without the payload'
        )
    model, number = arm.robot.model, arm.robot.tree.index(joint) + 1
    behind = [str(model.names[one]) for one in model.subtrees[number] if one != number]
    if behind:
        raise ModelError(
            f"the payload of joint '{joint}' is not at the flange, as {', '.join(behind)} moves "
            'behind it: load data belong to a body that the last joint moves. Put the payload '
            'onto the last link, or leave out the joints of a gripper with --robot and --joints'
        )
    frames = [f for f in model.frames if (f.parentJoint, f.type) == (number, pin.FrameType.BODY)]
    placements = {str(one.name): one.placement for one in frames}
    frame = frame or _flange(joint, placements)
    if frame not in placements:
        raise ModelError(
            f"'{frame}' is no link that moves with the payload of joint '{joint}': name "
            f'{" or ".join(placements)} with --frame{meant(frame, placements)}'
        )
    placement = placements[frame]
    return CarriedLoad(joint, frame, placement.actInv(pin.Inertia.FromDynamicParameters(ten)))


def _flange(joint: str, links: Collection[str]) -> str:
    """Return the link whose name ends in tool0 or flange; without one, the only given link."""
    # names of ROS-Industrial, after the prefix of an arm; 'flange' comes before 'sensor_flange'
    usual = [x for end in ('tool0', 'flange') for x in sorted(links, key=len) if x.endswith(end)]
    if not usual and len(links) != 1:
        raise ModelError(
            f"the link at the flange of joint '{joint}' is unknown: name it with --frame; "
            f'{", ".join(links)} move with the payload'
        )
    return [*usual, *links][0]


def universal_robots(load: CarriedLoad) -> str:
    """
    Return the URScript call that sets a payload, given in the tool flange's frame.

    Mass [kg], centre of gravity from the tool mount [m], and the inertia matrix [kg m^2] as Ixx,
    Iyy, Izz, Ixy, Ixz, Iyz about the centre of gravity in the axes of the tool flange.
    Source: Universal Robots, Script Manual, set_target_payload(m, cog, inertia).

    """
    body = load.body
    six = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return f'set_target_payload({_list(body.mass)}, [{_list(body.lever)}], [{_list(six)}])'


def franka(load: CarriedLoad) -> str:
    """
    Return the libfranka call that sets a payload, given in the flange's frame.

    Mass [kg], translation from the flange to the centre of mass [m], and the inertia matrix
    [kg m^2] about the centre of mass, column-major.
    Source: libfranka, franka::Robot::setLoad(load_mass, F_x_Cload, load_inertia);
    franka::Model::mass for the reference point of the inertia.

    """
    body = load.body
    inertia = _list(body.inertia.ravel(order='F'))
    return f'robot.setLoad({_list(body.mass)}, {{{{{_list(body.lever)}}}}}, {{{{{inertia}}}}});'


def kuka(load: CarriedLoad) -> str:
    """
    Return the line of $config.dat that sets a payload, given in the flange's frame.

    Mass M [kg], centre X, Y, Z [mm] and orientation A, B, C [deg] of the principal axes, which are
    rotations about z, the new y and the new x; principal moments J [kg m^2].
    Source: KUKA, MA KR IONTEC V4, Technical data, Load center of gravity and mass moment of
    inertia; Beckhoff, TF5120, KRC_WriteLoadData, for the flange.

    """
    moments, axes = load.principal()
    c, b, a = np.degrees(pin.rpy.matrixToRpy(axes))
    values = [load.body.mass, *(1000.0 * load.body.lever), a, b, c, *moments]
    form = 'LOAD_DATA[1]={{M {},CM {{X {},Y {},Z {},A {},B {},C {}}},J {{X {},Y {},Z {}}}}}'
    return form.format(*map(_list, values))


def abb(load: CarriedLoad) -> str:
    """
    Return the RAPID declaration of a payload, given in the tool's frame.

    Mass [kg], centre of gravity [mm], orientation of the axes of moment as a quaternion, scalar
    first, and moments of inertia about these axes [kg m^2]. A tload of tooldata is in the wrist
    coordinate system instead.
    Source: ABB, RAPID Reference Manual, Data types, loaddata and tooldata.

    """
    moments, axes = load.principal()
    x, y, z, w = pin.Quaternion(axes).coeffs()
    turn = np.array([w, x, y, z]) * (1.0 if w >= 0.0 else -1.0)
    center = _list(1000.0 * load.body.lever)
    parts = f'{_list(load.body.mass)}, [{center}], [{_list(turn)}], {_list(moments)}'
    return f'PERS loaddata load1 := [{parts}];'


#: Format of a load and a comment for each manufacturer.
MAKERS: dict[str, tuple[Callable[[CarriedLoad], str], str]] = {
    'ur': (universal_robots, '#'),
    'franka': (franka, '//'),
    'kuka': (kuka, ';'),
    'abb': (abb, '!'),
}


def load_text(load: CarriedLoad, maker: str, source: str) -> tuple[str, tuple[str, ...]]:
    """
    Return the load data file of a manufacturer (a key of `MAKERS`), and its notes.

    A physically impossible inertia is written as zero, as of a point mass. The source of the load
    is named in the comment.

    """
    write, comment = MAKERS[maker]
    place = 'tool (for a tload: the wrist)' if maker == 'abb' else 'flange'
    notes = [f'values are in the frame of --frame {load.frame}; it has to be that of the {place}']
    low, middle, high = np.linalg.eigvalsh(load.body.inertia)
    if min(low, low + middle - high) < -1e-9 * abs(high):  # not a rounding error
        notes.append(
            f'mass and centre are valid, but no body has the principal moments {low:.3g}, '
            f'{middle:.3g}, {high:.3g} kg m^2, so the inertia is written as zero'
        )
        point = pin.Inertia(load.body.mass, load.body.lever, np.zeros((3, 3)))
        load = replace(load, body=point)
    head = f"payload of joint '{load.joint}', written by armid export, from {source}"
    lines = [f'{comment} {" ".join(line.split())}' for line in (head, *notes)]
    return '\n'.join([*lines, write(load)]) + '\n', tuple(notes)


def _list(values: FloatArray | float) -> str:
    """Format numbers without exponents, with nine decimals."""
    texts = [f'{value + 0.0:.9f}'.rstrip('0') for value in np.round(np.ravel(values), 9)]
    return ', '.join(f'{text}0' if text.endswith('.') else text for text in texts)
