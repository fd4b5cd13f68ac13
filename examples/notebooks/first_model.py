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
# # First model
#
# From a URDF to a model with uncertainties. `arm.urdf` describes a small arm of three joints.
# Any other URDF does as well.

# %%
import armid_ros as ar
import matplotlib.pyplot as plt

URDF = '../arm.urdf'
print(ar.load_robot(URDF).joints)

# %% [markdown]
# ## A motion that is worth running
#
# It stays inside the limits of the URDF, and makes the parameters as visible as it can. The
# table has how much of each limit it uses.

# %%
plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
plan

# %%
motion = plan.motion(100.0)
figure, axes = plt.subplots(figsize=(8, 3))
axes.plot(motion.t, motion.q, label=motion.joints)
axes.set(xlabel='time [s]', ylabel='position [rad]')
axes.legend(ncols=3)
figure.tight_layout()

# %% [markdown]
# ## Two recordings
#
# On a robot you would run `plan.save('plan')` and record `/joint_states`. Here a simulated arm
# stands for it. It has friction that the URDF does not mention.

# %%
friction = ['viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2']
robot = ar.ArmModel.of(URDF, effects=friction)
monday, tuesday = (ar.simulate(robot, plan, torque_noise=0.05, rng=day) for day in (1, 2))
monday

# %% [markdown]
# ## The model
#
# One recording is fitted, the other one predicted. The grade is about the prediction.

# %%
model = ar.identify(URDF, monday, validate=tuesday)
model

# %% [markdown]
# The friction that was hidden is 0.3 N m s/rad and 0.2 N m in every joint.

# %%
table = model.to_dataframe()
table[table.name.isin(['viscous_coefficient', 'coulomb_torque'])]

# %% [markdown]
# Measured torque, predicted torque, and what is left of the elbow:

# %%
(fit,) = model.predict(tuesday)
elbow = fit.motion.joints.index('elbow')
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(8, 4))
above.plot(fit.motion.t, fit.motion.tau[:, elbow], label='measured')
above.plot(fit.motion.t, fit.predicted[:, elbow], '--', label='predicted')
above.set(ylabel='torque [N m]')
above.legend()
below.plot(fit.motion.t, fit.residual[:, elbow])
below.set(xlabel='time [s]', ylabel='residual [N m]')
figure.tight_layout()

# %% [markdown]
# `model.save('model')` writes `model.yaml`, `identification.json` and a report that opens
# without a network.
