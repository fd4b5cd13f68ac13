# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # The missing effect
#
# An arm is identified on Monday. On Friday its torques differ from the predicted ones. What has
# changed?

# %%
import armid_ros as ar
import matplotlib.pyplot as plt

URDF = '../arm.urdf'
friction = ['viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2']
plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
as_it_was = ar.ArmModel.of(URDF, effects=friction)
monday = ar.simulate(as_it_was, plan, torque_noise=0.05, rng=1)
model = ar.identify(URDF, monday)
model

# %% [markdown]
# During the week somebody routed a hose along the elbow. The hose pulls like a spring of
# 2 N m/rad, which the model of Monday lacks.

# %%
spring = 'joint_spring@elbow:spring_stiffness=2'
as_it_is = ar.ArmModel.of(URDF, effects=[*friction, spring])
friday = [ar.simulate(as_it_is, plan, torque_noise=0.05, rng=seed) for seed in (2, 3)]

# %% [markdown]
# ## Which joint has changed
#
# The model of Monday predicts Friday's torques. The residual of the elbow is not noise: it depends
# on the position.

# %%
(fit,) = model.predict(friday[0])
figure, axes = plt.subplots(1, 3, sharey=True, figsize=(9, 3))
for k, (joint, one) in enumerate(zip(fit.motion.joints, axes, strict=True)):
    one.plot(fit.motion.q[:, k], fit.residual[:, k], '.', markersize=2)
    one.set(title=joint, xlabel='position [rad]')
axes[0].set(ylabel='residual [N m]')
figure.tight_layout()

# %% [markdown]
# ## Name the missing effect
#
# The recording of `validate` tests how much of the residual an effect explains. The recording of
# `baseline` shows the residual of the model before the change.

# %%
found = ar.diagnose(model.arm, friday[0], validate=friday[1], baseline=monday)
found

# %%
found.to_dataframe()

# %% [markdown]
# ## The patch
#
# `found.arm` is the model with the named effects. The plot shows its residual on the second
# recording of Friday, which was not fitted.

# %%
motion = model.predict(friday[1])[0].motion
figure, axes = plt.subplots(figsize=(8, 3))
for label, arm in (('as on Monday', model.arm), ('with the spring', found.arm)):
    axes.plot(motion.t, motion.tau[:, 2] - arm.torque(motion)[:, 2], label=label)
axes.set(xlabel='time [s]', ylabel='residual of the elbow [N m]')
axes.legend()
figure.tight_layout()

# %% [markdown]
# ## Which effects could be missed
#
# Effects that are not named may exist, but too small to be detected. The smallest detectable sizes
# at the elbow are:

# %%
for row in found.document()['detectable']:
    if row['joints'] == ['elbow'] and row['min_detectable'] is not None:
        print(f'{row["name"]:26s} {row["min_detectable"]:9.2g} {row["unit"]}')
