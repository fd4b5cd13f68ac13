# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Descriptions of small serial arms."""


def serial_arm(*joints, mass=2.0, centre='0 0 -0.3', moments=(0.1, 0.1, 0.1)):
    """
    Return the URDF of a serial arm with equal links.

    Parameters
    ----------
    joints : str
        Name, type, axis and origin of each joint, such as 'lift prismatic 0,0,1 0,0,0.2'.
    mass : float
        Mass of each link [kg].
    centre : str
        Centre of mass of each link [m].
    moments : sequence of float
        Moments of inertia of each link about its centre of mass [kg m^2].

    """
    text, parent = '<link name="base"/>', 'base'
    xx, yy, zz = moments
    for joint in joints:
        name, kind, axis, origin = joint.split()
        text += (
            f'<link name="{name}_link"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
            f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>'
            f'</link><joint name="{name}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{name}_link"/><axis xyz="{axis.replace(",", " ")}"/>'
            f'<origin xyz="{origin.replace(",", " ")}"/>'
            '<limit lower="-2" upper="2" velocity="100" effort="100"/></joint>'
        )
        parent = f'{name}_link'
    return f'<robot name="serial">{text}</robot>'
