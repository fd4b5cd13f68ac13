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
# An arm is identified on Monday. On Friday its torques are no longer as predicted. What has
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
# Over the weekend somebody routed a hose along the elbow. It pulls like a spring of 2 N m/rad;
# nobody writes it down.

# %%
spring = 'joint_spring@elbow:spring_stiffness=2'
as_it_is = ar.ArmModel.of(URDF, effects=[*friction, spring])
friday = [ar.simulate(as_it_is, plan, torque_noise=0.05, rng=seed) for seed in (2, 3)]

# %% [markdown]
# ## Something is wrong, and where
#
# The model of Monday predicts Friday's torques. The residual of the elbow is no noise, and goes
# with the position.

# %%
(fit,) = model.predict(friday[0])
figure, axes = plt.subplots(1, 3, sharey=True, figsize=(9, 3))
for k, (joint, one) in enumerate(zip(fit.motion.joints, axes, strict=True)):
    one.plot(fit.motion.q[:, k], fit.residual[:, k], '.', markersize=2)
    one.set(title=joint, xlabel='position [rad]')
axes[0].set(ylabel='residual [N m]')
figure.tight_layout()

# %% [markdown]
# ## The name
#
# `validate` decides how much of the gap a cause closes; `baseline` shows what the model left
# when it was right.

# %%
found = ar.diagnose(model.arm, friday[0], validate=friday[1], baseline=monday)
found

# %%
found.to_dataframe()

# %% [markdown]
# ## The patch
#
# `found.arm` is the model with the named effects. Its residuals on the second recording of Friday,
# which was not fitted:

# %%
motion = model.predict(friday[1])[0].motion
figure, axes = plt.subplots(figsize=(8, 3))
for label, arm in (('as on Monday', model.arm), ('with the spring', found.arm)):
    axes.plot(motion.t, motion.tau[:, 2] - arm.torque(motion)[:, 2], label=label)
axes.set(xlabel='time [s]', ylabel='residual of the elbow [N m]')
axes.legend()
figure.tight_layout()

# %% [markdown]
# ## What silence is worth
#
# Causes that were not named may be there, and too small to be seen. How small:

# %%
for row in found.document()['detectable']:
    if row['joints'] == ['elbow'] and row['min_detectable'] is not None:
        print(f'{row["name"]:26s} {row["min_detectable"]:9.2g} {row["unit"]}')
