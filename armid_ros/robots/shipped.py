# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The robots that come with the package."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

_SHIPPED = {
    'humanoid_arm': (
        'humanoid_arm/humanoid_arm.urdf',
        '6-DOF humanoid arm, 2.8 kg, 0.6 m from shoulder to wrist',
    ),
    'humanoid_arm_loaded': (
        'humanoid_arm/humanoid_arm_loaded.urdf.xacro',
        'the humanoid arm with 0.3 kg in its hand',
    ),
    'human_legs': (
        'human_legs/human_legs.urdf',
        'legs and trunk of a man of 70.5 kg in the sagittal plane, stance foot fixed',
    ),
    'two_link_elastic': (
        'two_link_elastic/two_link_elastic.urdf',
        'two links in the horizontal plane with elastic joints, 1 m, 17 kg',
    ),
    'exoskeleton_legs': (
        'exoskeleton_legs/exoskeleton_legs.urdf',
        'exoskeleton of 12.25 kg that human_legs wears, stance foot fixed',
    ),
}


def shipped_robots() -> dict[str, str]:
    """
    Return the names and one-line descriptions of the robots shipped with the package.

    Returns
    -------
    dict of str to str
        Name and description.

    Examples
    --------
    >>> import armid_ros as ar
    >>> 'humanoid_arm' in ar.shipped_robots()
    True

    """
    return {name: description for name, (_, description) in _SHIPPED.items()}


def shipped_path(name: str) -> Path:
    """Return the file of a shipped robot."""
    return Path(str(resources.files('armid_ros.robots').joinpath(_SHIPPED[name][0])))
