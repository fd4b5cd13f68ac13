# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks that the links of an arm are physically possible bodies, as a simulation requires."""

from __future__ import annotations

from armid_ros.errors import ModelError
from armid_ros.model.pseudo_inertia import PER_LINK, pseudo_inertia
from armid_ros.robots import NO_MASS, Robot
import numpy as np

NO_BODY = (
    'the inertia matrix is not positive definite: identify with --physical, or correct the '
    'description'
)


class NoBodyError(ModelError):
    """An arm cannot be simulated because some links are not physically possible bodies."""


def require_masses(robot: Robot) -> None:
    """
    Raise a ModelError if links of a robot have a negative mass.

    Raises
    ------
    ModelError
        If a mass is negative; the message names the links.

    """
    negative = _of_negative_mass(robot)
    if negative:
        raise ModelError(f'{robot.name}: {negative}; correct the description')


def require_any_mass(robot: Robot) -> None:
    """
    Raise a ModelError if no link of a robot has a mass, since it then predicts no torque.

    Raises
    ------
    ModelError
        If no link has a mass; the message names the description and its links.

    """
    if np.all(np.abs(robot.rigid_parameters[::PER_LINK]) < NO_MASS):
        raise ModelError(
            f'{robot.path or robot.name}: no link has a mass ({", ".join(robot.links)}), so there '
            'is no model to compare with. Give them an <inertial>, or identify the arm first '
            '(armid identify) and name its model.yaml with --model'
        )


def no_body(robot: Robot) -> str:
    """Return the message on an inertia matrix that is not positive definite."""
    links = zip(robot.links, robot.rigid_parameters.reshape(-1, PER_LINK), strict=True)
    negative = _of_negative_mass(robot)
    odd = [
        name
        for name, values in links
        if np.any(values) and np.linalg.eigvalsh(pseudo_inertia(values))[0] < 0.0
    ]
    if negative or not odd:
        return f'{negative}; {NO_BODY}' if negative else NO_BODY
    return f'inertias of {", ".join(odd)} are not those of a body; {NO_BODY}'


def _of_negative_mass(robot: Robot) -> str:
    masses = robot.rigid_parameters[::PER_LINK]
    named = [
        f"link '{name}' has a mass of {mass:g} kg"
        for name, mass in zip(robot.links, masses, strict=True)
        if mass < 0.0
    ]
    return ', '.join(named)
