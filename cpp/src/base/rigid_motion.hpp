/// Positions and rigid motions in the linear algebra of Eigen.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>

#include "base/geometry.hpp"

namespace dynmesh {

inline Eigen::Vector3d to_eigen(const Vector3& v) { return {v.x, v.y, v.z}; }

inline Vector3 from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// The matrix of the cross product with a vector, p x.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& p) {
  return (Eigen::Matrix3d() << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0).finished();
}

/// x -> rotation * (x - from) + to, in double precision.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  /// The sum of the squares of how far the points to which it was fitted are from a line, before
  /// times after.
  double squared_across = 0;

  [[nodiscard]] Vector3 apply(const Vector3& point) const {
    const Eigen::Vector3d arm = to_eigen(point) - from;
    return from_eigen(rotation.col(0) * arm.x() + rotation.col(1) * arm.y() +
                      rotation.col(2) * arm.z() + to);
  }
};

/// Sums over arms p, which become q.
struct Arms {
  Eigen::Matrix3d before = Eigen::Matrix3d::Zero();  ///< of p p^T
  Eigen::Matrix3d now = Eigen::Matrix3d::Zero();     ///< of q p^T

  void add(double weight, const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    before += weight * p * p.transpose();
    now += weight * q * p.transpose();
  }
  void add(const Arms& other) {
    before += other.before;
    now += other.now;
  }
};

/// Points before and after a motion: their number, mean positions, and the arms from these.
struct Moments {
  double number = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d now = Eigen::Vector3d::Zero();
  Arms arms;

  /// Adds other points (Chan, Golub and LeVeque 1983).
  void add(const Moments& other) {
    if (other.number == 0) return;
    const double share = other.number / (number + other.number);
    const Eigen::Vector3d p = other.before - before;
    const Eigen::Vector3d q = other.now - now;
    arms.add(other.arms);
    arms.add(number * share, p, q);
    before += share * p;
    now += share * q;
    number += other.number;
  }
};

/// The moments of the points that `for_each(visit)` visits, before and now. It is called twice, and
/// must visit equal points in equal order.
template <class ForEach>
Moments moments_of(const ForEach& for_each) {
  Moments moments;
  for_each([&](const Eigen::Vector3d& before, const Eigen::Vector3d& now) {
    ++moments.number;
    moments.before += before;
    moments.now += now;
  });
  moments.before /= moments.number;
  moments.now /= moments.number;
  for_each([&](const Eigen::Vector3d& before, const Eigen::Vector3d& now) {
    moments.arms.add(1, before - moments.before, now - moments.now);
  });
  return moments;
}

inline Eigen::Isometry3d to_eigen(const RigidMotion& given) {
  Eigen::Isometry3d motion(given.rotation);
  motion.translation() = given.to - motion.linear() * given.from;
  return motion;
}

/// Returns the least-squares rigid motion of points (Kabsch 1976, with a positive determinant). If
/// all lie on a line, the rotation is not determined and the mean translation is returned.
RigidMotion fit_rigid_motion(const Moments& moments);

/// Returns the least-squares rigid motion from `before[v]` to `after[v]` over the given vertices,
/// which must not be none.
RigidMotion fit_rigid_motion(std::span<const Index> vertices, Field before, Field after);

/// Returns the least-squares rigid motion from `before` to `after`, which must not be empty.
RigidMotion fit_rigid_motion(Field before, Field after);

}  // namespace dynmesh
