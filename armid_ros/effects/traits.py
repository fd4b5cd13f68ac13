# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Words and prior knowledge of the shipped effects, one table.

A law has columns and an action; what is said of it, how often it occurs, and where a description
has a place for it do not change its torque and stand here.

"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Traits:
    """
    What is known of a kind of effect apart from its law.

    Attributes
    ----------
    shown_by : str
        The experiment that shows it best, as an engineer would do it.
    look_at : str
        What to inspect on the robot before anything else is recorded.
    sign : str
        What a positive value means, where the name does not say it.
    weighs : bool
        Whether it is carried, and so described by its mass, the first quantity, and where it is;
        it is put down and picked up all day.
    usual : bool
        Whether it is fitted by default: nearly every joint of every arm has it.
    friction : bool
        Whether it is friction: all friction of a joint may change at once.
    external : bool
        Whether it comes from outside the arm: a person, another machine.
    corrects : bool
        Whether it is an error of the description, and never happens to the arm.
    nuisance : tuple of tuple of float
        Shapes with which it is a nuisance parameter where nobody asked for it; () if it is none.
    separate : tuple of tuple of int
        Quantities that are causes of their own, if not all of them are one together.
    urdf_attribute, mjcf_attribute : str
        Attribute of a joint of URDF and of MJCF that holds its quantity; '' if none does.

    """

    shown_by: str = 'faster motion'
    look_at: str = ''
    sign: str = ''
    weighs: bool = False
    usual: bool = False
    friction: bool = False
    external: bool = False
    corrects: bool = False
    nuisance: tuple[tuple[float, ...], ...] = ()
    separate: tuple[tuple[int, ...], ...] = ()
    urdf_attribute: str = ''
    mjcf_attribute: str = ''


#: Traits of the shipped effects by name; other effects have an attribute ``traits``.
TRAITS = {
    'encoder_offset': Traits(
        shown_by='hard stops, or a payload at two poses',
        look_at='the zero of the encoder, at a mark or a stop of the joint',
        sign='the joint is at its reading plus that',
    ),
    'joint_elasticity': Traits(
        shown_by='a sweep of frequency through the resonance',
        look_at='the belt, the gear, and the screws of its flanges',
    ),
    'backlash': Traits(
        shown_by='slow reversals with the load pulling and pushing',
        look_at='the play of the gear, by moving the link by hand while the motor holds',
    ),
    'actuator_saturation': Traits(
        shown_by='the same motion at rising amplitudes',
        look_at='the limits of current and torque in the settings of the drive',
        separate=((0,), (1,)),
    ),
    'torque_crosstalk': Traits(
        shown_by='one joint loaded while the other one stands still',
        look_at='how the torque sensors are mounted, and their cables',
    ),
    'torque_gain': Traits(
        shown_by='the same motion with and without a known payload',
        look_at='the scale of the torque in the driver, of the sensor or of the motor constant',
        sign='readings are 1 plus that times the torque',
    ),
    'torque_drift': Traits(
        shown_by='the same static hold, repeated for half an hour',
        look_at='the temperature of the torque sensor, and when its zero was set',
    ),
    'time_delay': Traits(
        shown_by='the same motion at two speeds, and a sweep of frequency',
        look_at='how the driver stamps positions and torques',
    ),
    'torque_lag': Traits(
        shown_by='a sweep of frequency up to half of the bandwidth',
        look_at='the filter of the torque in the driver or the sensor',
    ),
    'rotor_inertia': Traits(
        shown_by='fast motion of the joint in two postures of the arm',
        look_at='the motor and the gear, which may be of another type than described',
        mjcf_attribute='armature',
    ),
    'torque_ripple': Traits(
        shown_by='slow constant velocity at three speeds',
        look_at='the gear and the motor, for a worn tooth, a bent shaft or weak magnets',
    ),
    'viscous_friction': Traits(
        shown_by='constant velocities, slow to fast, in both directions',
        look_at='the grease, its temperature, the seals and the bearings',
        usual=True,
        nuisance=((),),
        friction=True,
        urdf_attribute='damping',
        mjcf_attribute='damping',
    ),
    'coulomb_friction': Traits(
        shown_by='slow constant velocity in both directions',
        look_at='the brake, the seals and the bearings, and whether it moves freely by hand',
        usual=True,
        nuisance=((),),
        friction=True,
        urdf_attribute='friction',
        mjcf_attribute='frictionloss',
    ),
    'asymmetric_friction': Traits(
        shown_by='static holds and slow motion in both directions',
        look_at='the brake, the gear, and cables that pull one way',
        friction=True,
    ),
    'quadratic_friction': Traits(
        shown_by='constant velocities up to the limit',
        look_at='what moves through air, oil or grease',
        friction=True,
    ),
    'stribeck_friction': Traits(
        shown_by='constant velocities from 0.01 to 1 rad/s in both directions',
        look_at='the kind, the age and the temperature of the grease',
        nuisance=((0.03, 2.0), (0.1, 2.0), (0.3, 2.0)),
        friction=True,
    ),
    'thermal_friction': Traits(
        shown_by='the same motion cold and after half an hour of work',
        look_at='how warm the gear was, and how long the arm had worked before',
        friction=True,
    ),
    'friction_level': Traits(
        shown_by='constant velocities, slow to fast, in both directions',
        look_at='how warm the arm was and how long it had stood; then the grease and the seals',
        friction=True,
    ),
    'gravity_magnitude': Traits(
        shown_by='fast motion and static holds',
        look_at='the gravity in the settings, and the scale of all torques',
    ),
    'base_tilt': Traits(
        shown_by='static holds with the first joint turned around',
        look_at='how the base stands and is bolted down, with a spirit level',
    ),
    'load_dependent_friction': Traits(
        shown_by='the same motion with and without a known payload',
        look_at='the wear, the grease and the alignment of the gear',
        nuisance=((),),
        friction=True,
    ),
    'presliding_hysteresis': Traits(
        shown_by='triangles of less than 0.02 rad at two rates',
        look_at='the seals, the bearings and their preload',
    ),
    'human_interaction': Traits(
        shown_by='the same motion with the contact released',
        look_at='whether a person, a table or a fixture touches the arm',
        external=True,
    ),
    'interface_slack': Traits(
        shown_by='the same motion at two tensions of the strap',
        look_at='the strap, cable, table or fixture that may hold it, and how tight or near it is',
        external=True,
    ),
    'payload': Traits(
        shown_by='the same motion with and without the tool',
        look_at='the hand, the gripper, the tool, a part or a cable that it carries',
        weighs=True,
    ),
    'link_inertia': Traits(
        shown_by='fast motion and static holds',
        look_at='the link and what is bolted to it, against its description',
        corrects=True,
    ),
    'coupled_joint_friction': Traits(
        shown_by='motion of one joint of the pair at a time',
        look_at='the gear, belt or tendon that the two joints share',
        friction=True,
    ),
    'joint_coupling': Traits(
        shown_by='static holds of one joint of the pair at many positions of the other',
        look_at='cables, hoses and tendons that run along both joints',
    ),
    'torque_offset': Traits(
        shown_by='static holds over the range of positions',
        look_at='the zero of the torque sensor, with the joint unloaded',
        usual=True,
    ),
    'joint_spring': Traits(
        shown_by='static holds over the range, with and without a payload',
        look_at='cables, hoses and springs along the joint',
    ),
    'soft_limit': Traits(
        shown_by='slow motion into and out of the end of the range',
        look_at='the stops, and what the joint reaches there',
        separate=((0,), (1,)),
    ),
}
