# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Checks of a robot description: implausible values, and links that a recording contradicts.

A recording determines base parameters: combinations of masses, first moments and inertias of
several links. A single mass is determined only under the hypothesis that few links are wrong.
Forward selection adds wrong links one by one. The ten parameters of each link have a prior around
the description. The parameters of effects are nuisance parameters.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from armid_ros.identification import Identification, Score
from armid_ros.identification.physical.fit_among_bodies import THINNEST
from armid_ros.inspection.inspect import notes_on, Remark, worst_first
from armid_ros.motion import FloatArray
from armid_ros.robots import NO_MASS, Robot
from armid_ros.robots.description import MOVABLE, parse_xml
from armid_ros.robots.geometry import collision_geometry, combined_mesh_note
from armid_ros.robots.robot import PER_LINK
import numpy as np

#: Length above which the unit of a shape is probably wrong [m].
_MAX_LENGTH = 10.0
#: Smallest reduction of the torque error by fitted links that indicates a wrong link [%].
_MIN_IMPROVEMENT = 1.0
#: Smallest share of chi-squared that a further link explains, and chi-squared per row from which
#: a further link is searched for.
_MIN_SHARE, _MAX_CHI_SQUARED = 0.5, 10.0


@dataclass(frozen=True, eq=False)
class LinkCheck:
    """
    Comparison of the inertial parameters of n described links with an identification.

    Attributes
    ----------
    links, joints : tuple of str
        The links, and the joints that move them.
    mass, centre : ndarray, shape (n,) and (n, 3)
        Described mass [kg] and centre of mass in the frame of the joint [m]; the centre of a link
        without mass is NaN.
    measured_mass, mass_std : ndarray, shape (n,)
        Estimated mass and its standard deviation [kg]; NaN if the link agrees or the motion does
        not determine its mass.
    measured_centre, centre_std : ndarray, shape (n, 3)
        Estimated centre of mass and its standard deviation [m]; NaN as for the mass.
    explains : ndarray, shape (n,)
        Share of the chi-squared difference that each link alone explains, 0 to 1.
    wrong : tuple of int
        Indices of the links whose errors together explain the difference, the most important
        first; empty for none.
    explained : float
        Share of the chi-squared difference that the wrong links explain together.
    error_percent, fitted_error_percent : float
        Torque error with the described links and with fitted links; friction is fitted in both.
    grade : str
        Grade of the identification: good, poor or unusable.
    fault : str
        Why the recording cannot check the links; empty if it can.
    rivals : tuple of int
        Indices of other links that explain as much as the single wrong link.

    """

    links: tuple[str, ...]
    joints: tuple[str, ...]
    mass: FloatArray
    centre: FloatArray
    measured_mass: FloatArray
    mass_std: FloatArray
    measured_centre: FloatArray
    centre_std: FloatArray
    explains: FloatArray
    wrong: tuple[int, ...]
    explained: float
    error_percent: float
    fitted_error_percent: float
    grade: str
    fault: str
    rivals: tuple[int, ...]

    @property
    def agrees(self) -> bool:
        """Whether fitted links lower the torque error by less than 1 % of the measured torque."""
        return self.error_percent - self.fitted_error_percent < _MIN_IMPROVEMENT


def description_remarks(robot: Robot) -> tuple[Remark, ...]:
    """
    Return remarks on inertias, densities and limits of a robot description, the worst first.

    Raises
    ------
    RobotError
        If a shape has no geometry, or a mesh cannot be read.

    """
    found = [Remark('bad', text) for text in robot.description.inertia_doubts()]
    found += _thin_inertias(robot)
    found += [*_joint_remarks(robot), *_limit_remarks(robot), *_shape_remarks(robot)]
    known = {remark.text for remark in found}
    others = [note for note in notes_on(robot) if note not in known]
    return worst_first([*found, *(Remark('note', note) for note in others)])


def _thin_inertias(robot: Robot) -> Iterator[Remark]:
    """Yield a remark on each inertia that only an implausibly thin body could have."""
    for link, inertial in robot.description.links.items():
        if inertial is None or inertial.doubt():
            continue
        xx, xy, xz, yy, yz, zz = inertial.inertia
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        least, _, largest = 0.5 * moments.sum() - moments[::-1]  # second moments of the mass
        if least < THINNEST**2 * largest:
            values = ', '.join(f'{moment:.2g}' for moment in moments)
            yield Remark(
                'doubt',
                f"link '{link}': principal moments {values} kg m^2 belong to a body thinner than "
                f'{THINNEST:g} of its length; correct its inertia',
            )


def _joint_remarks(robot: Robot) -> Iterator[Remark]:
    """Yield remarks on limits that may be in degrees, and on axes that are not unit vectors."""
    for k, name in enumerate(robot.joints):
        if robot.prismatic[k]:
            continue
        reach = max(-robot.lower[k], robot.upper[k])
        if 6.0 * np.pi < reach < np.inf:  # three turns
            yield Remark('bad', f"joint '{name}': limit {reach:g} rad; is it in degrees?")
        if 50.0 < robot.velocity_limit[k] < np.inf:
            fast = f"joint '{name}': velocity limit {robot.velocity_limit[k]:g} rad/s"
            yield Remark('doubt', f'{fast}; is it in degrees per second?')
    for joint in parse_xml(robot.urdf).iter('joint'):
        axis = joint.find('axis')
        if axis is None or joint.get('type') not in MOVABLE:
            continue
        length = float(np.linalg.norm([float(x) for x in axis.get('xyz', '').split()]))
        if abs(length - 1.0) > 0.01:
            yield Remark(
                'doubt', f"joint '{joint.get('name')}': its axis has length {length:.3g}, not 1"
            )


def _limit_remarks(robot: Robot) -> Iterator[Remark]:
    """Yield remarks on effort and velocity limits that are implausibly small or large."""
    if robot.mechanism is not None:  # not every pose of the driven joints exists
        return
    # largest torque of each joint that holds the arm in random poses [N m]
    poses = np.random.default_rng(0).uniform(*robot.position_range(), (200, robot.n_joints))
    data, still = robot.model.createData(), np.zeros(robot.n_joints)
    weight = np.max([np.abs(robot.inverse_dynamics(data, q, still, still)) for q in poses], axis=0)
    speeds, efforts = robot.velocity_limit, robot.torque_limit
    turns = [k for k in range(robot.n_joints) if not robot.prismatic[k]]
    apart = 4.0  # ratio to the limits of other joints from which a limit is doubtful
    for k in turns:
        effort, speed = float(efforts[k]), float(speeds[k])
        others = [j for j in turns if j != k]
        most = max((float(efforts[j]) for j in others), default=np.inf)
        usual = float(np.median(speeds[others])) if others else np.inf
        heaviest = weight[k] == max(weight[turns])
        limit = f'effort limit {effort:g} N m'
        doubt = ''
        # in arms, the effort limit is 1.3 to 7 times the torque that holds the arm
        if 0.5 * weight[k] > effort:
            doubt = f'{limit}, but holding the arm takes up to {weight[k]:.3g}'
        elif heaviest and NO_MASS < 10.0 * weight[k] < effort < np.inf:
            doubt = f'{limit}, but holding the arm takes at most {weight[k]:.3g}'
        elif apart * most < effort < np.inf:
            doubt = f'{limit}, but other joints have at most {most:g}'
        elif max(speed, usual) < np.inf and not usual / apart < speed < usual * apart:
            doubt = f'velocity limit {speed:g} rad/s, but the median joint has {usual:g}'
        if doubt:
            yield Remark(
                'doubt', f"joint '{robot.joints[k]}': {doubt}; is it wrong by a factor of ten?"
            )
    parents = list(robot.model.parents)
    if turns and parents == [0, *range(len(parents) - 1)] and np.isfinite(speeds[turns]).all():
        steps = np.array([np.linalg.norm(p.translation) for p in robot.model.jointPlacements])
        tip = max(float(speeds[k] * steps[k + 2 :].sum()) for k in turns)
        if tip > 24.0 or 0.0 < tip < 0.24:  # [m/s]; arms have 1 to 6
            yield Remark(
                'doubt',
                f'velocity limits move the last joint at {tip:.3g} m/s; are they wrong by a '
                'factor of ten?',
            )


def _shape_remarks(robot: Robot) -> Iterator[Remark]:
    """Yield remarks on sizes and densities of links, and on links without a collision shape."""
    # shapes of a link may overlap, so volumes are upper bounds
    geometry, missing = collision_geometry(robot, other='visual')
    volume = dict.fromkeys(robot.description.links, 0.0)
    corners: dict[str, list[FloatArray]] = {link: [] for link in volume}
    for one in geometry.geometryObjects:
        one.geometry.computeLocalAABB()
        box, frame = one.geometry.aabb_local, robot.model.frames[one.parentFrame]
        link, place = frame.name, frame.placement.inverse() * one.placement
        corners[link] += [
            place.act(np.array(corner))
            for corner in product(*zip(box.min_, box.max_, strict=True))
        ]
        volume[link] += abs(float(one.geometry.computeVolume()))
        if max(box.width(), box.height(), box.depth()) > _MAX_LENGTH:
            yield Remark(
                'bad', f"link '{link}': shape above {_MAX_LENGTH:g} m; is it in millimetres?"
            )
    for link, inertial in robot.description.links.items():
        if inertial is not None and link not in missing:
            yield from _centre_remarks(link, np.array(inertial.xyz), corners[link])
        fixed = inertial is None and link not in robot.links  # the link that carries it has mass
        if volume[link] <= 0.0 or link in missing or fixed:
            continue
        mass = 0.0 if inertial is None else inertial.mass
        density = f"link '{link}': {mass:g} kg, {mass / volume[link]:.3g} kg/m^3"
        # plausible densities are those of foam to steel
        if mass > 8000.0 * volume[link]:
            yield Remark('bad', f'{density}; steel has 7850')
        elif mass < 30.0 * volume[link] and link != robot.base:
            yield Remark('doubt', f'{density}; foam has 30')
    yield from (Remark('note', text) for text in combined_mesh_note([*missing.values()]))
    shaped = {
        link.get('name')
        for link in parse_xml(robot.urdf).iter('link')
        if link.find('collision') is not None
    }
    masses = {name: own.mass for name, own in robot.description.links.items() if own is not None}
    least = 0.01 * sum(masses.values())  # smaller bodies are frames
    bare = [name for name, mass in masses.items() if mass > least and name not in shaped]
    if bare:
        more = f' and {len(bare) - 6} more' * (len(bare) > 6)
        text = f'no <collision> in {", ".join(bare[:6])}{more}'
        yield Remark('note', f'{text}: armid excite checks only their joint origins')


def _centre_remarks(
    link: str, centre: FloatArray, corners: Sequence[FloatArray]
) -> Iterator[Remark]:
    """Yield a remark if a link's centre of mass is far outside the link's bounding box."""
    if not corners:
        if np.linalg.norm(centre) > _MAX_LENGTH:
            yield Remark(
                'bad',
                f"link '{link}': centre of mass more than {_MAX_LENGTH:g} m from the link's "
                'frame; is it in millimetres?',
            )
        return
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    outside = float(np.linalg.norm(centre - np.clip(centre, low, high)))
    if outside > np.linalg.norm(high - low):  # the diagonal of the box
        yield Remark('doubt', f"link '{link}': centre of mass {outside:.3g} m outside its shape")


def check_links(found: Identification, robot: Robot, grade: str, fault: str) -> LinkCheck:
    """
    Find the links whose described inertial parameters disagree with an identification.

    Parameters
    ----------
    found : Identification
        The identification, without constraints of physical consistency: its covariance is that of
        the data.
    robot : Robot
        The robot as described.
    grade, fault : str
        Grade of the identification, and the fault of the recording if there is one.

    """
    size, rigid = PER_LINK, len(robot.rigid_parameters)
    theta = np.concatenate([robot.rigid_parameters, np.zeros(len(found.arm.theta) - rigid)])
    difference = found.estimate.values - found.base.values(theta)
    factor = np.linalg.cholesky(found.estimate.covariance)
    rows = np.linalg.solve(factor, np.column_stack([found.base.grouping, difference]))
    # parameters of the effects that explain most of the difference without errors of links
    effect_values = np.linalg.lstsq(rows[:, rigid:-1], rows[:, -1])[0]
    nuisance, _ = np.linalg.qr(rows[:, rigid:-1])
    rows = np.delete(rows, np.s_[rigid:-1], axis=1)
    rows -= nuisance @ (nuisance.T @ rows)
    spread = robot.described_spread.ravel()
    total = float(rows[:, -1] @ rows[:, -1])
    # effects such as rotors are grouped with links
    effects_suffice = total <= _MAX_CHI_SQUARED * len(rows)
    theta[rigid:] = effect_values if effects_suffice else found.arm.theta[rigid:]
    error, fitted_error = _errors(found, theta)
    wrong = [] if error - fitted_error < _MIN_IMPROVEMENT else _selected(rows, spread, total)
    changes, covariance, rest = _fit(rows, spread, wrong)
    freedom = max(1, len(rows) - nuisance.shape[1] - size * len(wrong))
    # the Birge ratio accounts for the unexplained residual
    covariance = covariance * max(1.0, rest / freedom)
    alone = [_fit(rows, spread, [k])[2] for k in range(len(robot.links))]
    # if two links have the same motion, each of them explains the difference alone
    most = max(rest / _MIN_SHARE, _MAX_CHI_SQUARED * len(rows)) if len(wrong) == 1 else 0.0
    body = robot.rigid_parameters.reshape(-1, size)[:, :4]
    measured, std = np.full((2, len(robot.links), 4), np.nan)
    for position, k in enumerate(wrong):
        own = slice(size * position, size * position + 4)
        # a determined mass has a standard deviation below a tenth of the prior's
        if covariance[own, own][0, 0] > (0.1 * spread[size * k]) ** 2:
            continue
        mass, *moments = body[k] + changes[own]
        measured[k] = mass, *(np.array(moments) / mass)
        slope = np.eye(4) / mass
        slope[0, 0], slope[1:, 0] = 1.0, -measured[k, 1:] / mass
        std[k] = np.sqrt(np.diag(slope @ covariance[own, own] @ slope.T))
    return LinkCheck(
        links=robot.links,
        joints=robot.moving,
        mass=body[:, 0],
        centre=body[:, 1:] / np.where(body[:, :1] > NO_MASS, body[:, :1], np.nan),
        measured_mass=measured[:, 0],
        mass_std=std[:, 0],
        measured_centre=measured[:, 1:],
        centre_std=std[:, 1:],
        explains=1.0 - np.array(alone) / total,
        wrong=tuple(wrong),
        explained=1.0 - rest / total,
        error_percent=error,
        fitted_error_percent=fitted_error,
        grade=grade,
        fault=fault,
        rivals=tuple(
            k for k, remaining in enumerate(alone) if remaining < most and wrong not in ([k], [])
        ),
    )


def _errors(found: Identification, theta: FloatArray) -> tuple[float, float]:
    """Return the relative torque errors [%] of parameters theta and of the fitted parameters."""
    before = found.arm.with_theta(theta)
    fits = [
        replace(
            fit,
            predicted=fit.predicted + before.torque(fit.motion) - found.arm.torque(fit.motion),
        )
        for fit in found.training
    ]
    scores = Score.of(fits), Score.of(found.training)
    return scores[0].relative_error_percent, scores[1].relative_error_percent


def _selected(rows: FloatArray, spread: FloatArray, total: float) -> list[int]:
    """Return the indices of links with wrong inertial parameters, found by forward selection."""
    every = range(len(spread) // PER_LINK)
    wrong: list[int] = []
    rest = total
    # with more wrong links, the cause may be the model itself
    while len(wrong) < min(3, len(every)) and rest > _MAX_CHI_SQUARED * len(rows):
        remaining = {k: _fit(rows, spread, [*wrong, k])[2] for k in every if k not in wrong}
        best = min(remaining, key=remaining.__getitem__)
        if remaining[best] > (1.0 - _MIN_SHARE) * rest:
            break
        wrong, rest = [*wrong, best], remaining[best]
    for k in wrong[:-1]:
        fewer = [one for one in wrong if one != k]
        if _fit(rows, spread, fewer)[2] < max(rest / _MIN_SHARE, _MAX_CHI_SQUARED * len(rows)):
            return fewer
    return wrong


def _fit(
    rows: FloatArray, spread: FloatArray, links: Sequence[int]
) -> tuple[FloatArray, FloatArray, float]:
    """Fit inertial parameters of links; return changes, their covariance and chi-squared."""
    size = PER_LINK
    own = [size * k + i for k in links for i in range(size)]
    columns, target = rows[:, own] * spread[own], rows[:, -1]
    inverse = np.linalg.inv(columns.T @ columns + np.eye(len(own)))
    scaled = inverse @ columns.T @ target
    rest = target - columns @ scaled
    return spread[own] * scaled, spread[own, None] * inverse * spread[own], float(rest @ rest)
