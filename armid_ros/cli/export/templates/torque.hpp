$comment
// Call it from update() of a ros2_control controller: q and dq are the state interfaces position
// and velocity, ddq is the acceleration of the trajectory, tau[k] adds to the command interface
// effort of joint k. It allocates nothing, keeps no state and may run in several threads.
//
// Recursive Newton-Euler, from the base to the tip and back: Luh, Walker and Paul 1980. All
// vectors of a link are in the frame of its joint.
#pragma once
#include <cmath>

namespace $name {

inline constexpr int N = $n;  // joints
inline constexpr double DEAD_BAND = $dead_band;  // no Coulomb friction at speeds up to it [rad/s or m/s]
// gravity in the frame of the base [m/s^2]
inline constexpr double GRAVITY[3] = $GRAVITY;
// joint that carries the joint; -1 is the base
inline constexpr int PARENT[N] = $PARENT;
// rotation per unit of the position, in the frame of the joint
inline constexpr double TURN[N][3] = $TURN;
// translation per unit of the position, in the frame of the joint
inline constexpr double SLIDE[N][3] = $SLIDE;
// place of the joint at position zero, in the frame of its parent [m]
inline constexpr double ORIGIN[N][3] = $ORIGIN;
// translation per unit of the position, in the frame of the parent
inline constexpr double SLIDING[N][3] = $SLIDING;
// rotation in the frame of the parent: times 1, sin q, 1 - cos q
inline constexpr double TURNING[N][3][3][3] = $TURNING;
// mass [kg]
inline constexpr double MASS[N] = $MASS;
// first moment of the mass [kg m]
inline constexpr double FIRST[N][3] = $FIRST;
// inertia about the origin of the joint [kg m^2]
inline constexpr double INERTIA[N][3][3] = $INERTIA;
// viscous friction [N m s/rad or N s/m]
inline constexpr double VISCOUS[N] = $VISCOUS;
// Coulomb friction [N m or N]
inline constexpr double COULOMB[N] = $COULOMB;
// constant torque [N m or N]
inline constexpr double OFFSET[N] = $OFFSET;
// inertia of the rotor [kg m^2 or kg]
inline constexpr double ROTOR[N] = $ROTOR;

inline void add_cross(const double a[3], const double b[3], double sum[3]) {
  sum[0] += a[1] * b[2] - a[2] * b[1];
  sum[1] += a[2] * b[0] - a[0] * b[2];
  sum[2] += a[0] * b[1] - a[1] * b[0];
}

// Torque [N m or N] of positions [rad or m], velocities and accelerations.
inline void torque(const double q[N], const double dq[N], const double ddq[N], double tau[N]) {
  const double rest[3] = {0.0, 0.0, 0.0};
  const double lift[3] = {-GRAVITY[0], -GRAVITY[1], -GRAVITY[2]};
  double turned[N][3][3], place[N][3];              // of a link in the frame of its parent
  double w[N][3], dw[N][3], a[N][3];                // velocity, accelerations of a link
  double force[N][3], moment[N][3];                 // on a link, about the origin of its joint
  for (int k = 0; k < N; ++k) {
    const double sine = std::sin(q[k]), versine = 1.0 - std::cos(q[k]);
    const double* up_w = PARENT[k] < 0 ? rest : w[PARENT[k]];
    const double* up_dw = PARENT[k] < 0 ? rest : dw[PARENT[k]];
    const double* up_a = PARENT[k] < 0 ? lift : a[PARENT[k]];
    for (int i = 0; i < 3; ++i) {
      place[k][i] = ORIGIN[k][i] + SLIDING[k][i] * q[k];
      for (int j = 0; j < 3; ++j) {
        const double* part = TURNING[k][i][j];
        turned[k][i][j] = part[0] + part[1] * sine + part[2] * versine;
      }
    }
    double speed[3] = {0.0, 0.0, 0.0}, acceleration[3] = {up_a[0], up_a[1], up_a[2]};
    add_cross(up_w, place[k], speed);
    add_cross(up_dw, place[k], acceleration);
    add_cross(up_w, speed, acceleration);
    double turn[3], slide[3];
    for (int i = 0; i < 3; ++i) {
      turn[i] = TURN[k][i] * dq[k];
      slide[i] = 2.0 * SLIDE[k][i] * dq[k];
      w[k][i] = turn[i];
      dw[k][i] = TURN[k][i] * ddq[k];
      a[k][i] = SLIDE[k][i] * ddq[k];
      for (int j = 0; j < 3; ++j) {
        w[k][i] += turned[k][j][i] * up_w[j];
        dw[k][i] += turned[k][j][i] * up_dw[j];
        a[k][i] += turned[k][j][i] * acceleration[j];
      }
    }
    add_cross(w[k], turn, dw[k]);
    add_cross(w[k], slide, a[k]);
    double around[3] = {0.0, 0.0, 0.0}, spin[3];
    add_cross(w[k], FIRST[k], around);
    for (int i = 0; i < 3; ++i) {
      force[k][i] = MASS[k] * a[k][i];
      moment[k][i] = spin[i] = 0.0;
      for (int j = 0; j < 3; ++j) {
        spin[i] += INERTIA[k][i][j] * w[k][j];
        moment[k][i] += INERTIA[k][i][j] * dw[k][j];
      }
    }
    add_cross(dw[k], FIRST[k], force[k]);
    add_cross(w[k], around, force[k]);
    add_cross(w[k], spin, moment[k]);
    add_cross(FIRST[k], a[k], moment[k]);
  }
  for (int k = N - 1; k >= 0; --k) {
    const double sign = dq[k] > DEAD_BAND ? 1.0 : dq[k] < -DEAD_BAND ? -1.0 : 0.0;
    tau[k] = ROTOR[k] * ddq[k] + VISCOUS[k] * dq[k] + COULOMB[k] * sign + OFFSET[k];
    double carried[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; ++i) {
      tau[k] += TURN[k][i] * moment[k][i] + SLIDE[k][i] * force[k][i];
      for (int j = 0; j < 3; ++j) carried[i] += turned[k][i][j] * force[k][j];
    }
    if (PARENT[k] < 0) continue;
    double* up_moment = moment[PARENT[k]];
    for (int i = 0; i < 3; ++i) {
      force[PARENT[k]][i] += carried[i];
      for (int j = 0; j < 3; ++j) up_moment[i] += turned[k][i][j] * moment[k][j];
    }
    add_cross(place[k], carried, up_moment);
  }
}

}  // namespace $name
