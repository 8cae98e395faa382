/// Meshes for the tests of deformation transfer: smooth ones to deform, and bad ones.
#pragma once

#include <npt/base/random.hpp>
#include <npt/mesh/mesh.hpp>
#include <npt/mesh/points.hpp>
#include <npt/mesh/triangles.hpp>
#include <npt/mesh/vertex_order.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace shapes {

using npt::Mesh;
using npt::points_of;
using npt::Triangle;
using npt::Vec3d;
using npt::Vec3f;

inline Mesh mesh_of(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles) {
  Mesh mesh;
  for (const Vec3d p : points) mesh.positions.push_back(p.as<float>());
  npt::set_faces(mesh, triangles);
  return mesh;
}

/// Points and triangles in double, to put together.
struct Surface {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

  /// The number of the other's first point.
  std::uint32_t add(const Surface& other) {
    const auto first = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (const Triangle& t : other.triangles) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return first;
  }
};

/// A sphere of radius 1, closed.
inline Surface sphere(std::uint32_t rings, std::uint32_t sectors) {
  std::vector<Vec3d> points{{0, 0, 1}};
  for (std::uint32_t i = 1; i < rings; ++i)
    for (std::uint32_t k = 0; k < sectors; ++k) {
      const double u = 3.14159265358979 * i / rings, w = 2 * 3.14159265358979 * k / sectors;
      points.push_back({std::sin(u) * std::cos(w), std::sin(u) * std::sin(w), std::cos(u)});
    }
  points.push_back({0, 0, -1});
  const auto last = static_cast<std::uint32_t>(points.size() - 1);
  std::vector<Triangle> triangles;
  for (std::uint32_t k = 0; k < sectors; ++k) {
    const std::uint32_t next = (k + 1) % sectors;
    triangles.push_back({0, 1 + k, 1 + next});
    for (std::uint32_t i = 0; i + 2 < rings; ++i) {
      const std::uint32_t a = 1 + i * sectors + k, b = 1 + i * sectors + next;
      triangles.push_back({a, a + sectors, b + sectors});
      triangles.push_back({a, b + sectors, b});
    }
    triangles.push_back({last, last - sectors + next, last - sectors + k});
  }
  return {points, triangles};
}

/// A closed figure with four blunt limbs: a sphere of rings x sectors, pulled out. `stretch` makes another body of it.
inline Mesh starfish(std::uint32_t rings, std::uint32_t sectors, double stretch = 0) {
  Surface surface = sphere(rings, sectors);
  for (Vec3d& p : surface.points) {
    const double limb = p.x * p.x * p.x * p.x + p.y * p.y * p.y * p.y;
    p = {p.x * (0.4 + 1.1 * limb + stretch * p.x * p.x), p.y * (0.4 + (1.1 + stretch) * limb),
         0.3 * p.z * (1 + stretch)};
  }
  return mesh_of(surface.points, surface.triangles);
}

/// A smooth bend: a pose. amount 0: none.
inline std::vector<float> bent(const Mesh& mesh, double amount) {
  std::vector<float> xyz;
  for (const Vec3f f : mesh.positions) {
    const auto p = f.as<double>();
    const double angle = amount * p.x;
    const Vec3d q{p.x * std::cos(angle) - p.z * std::sin(angle), p.y + 0.3 * amount * p.x * p.x,
                  p.z * std::cos(angle) + p.x * std::sin(angle)};
    for (const double x : {q.x, q.y, q.z}) xyz.push_back(static_cast<float>(x));
  }
  return xyz;
}

/// The largest distance between vertices of the same number.
inline double distance(std::span<const float> a, std::span<const float> b) {
  if (a.size() != b.size()) return HUGE_VAL;
  double worst = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3) {
    const Vec3d d = points_of(a.subspan(i, 3))[0] - points_of(b.subspan(i, 3))[0];
    worst = std::isnan(dot(d, d)) ? HUGE_VAL : std::max(worst, length(d));
  }
  return worst;
}

/// The mesh with the vertices in another order: order[new] = old.
inline std::vector<std::uint32_t> some_order(const Mesh& mesh, std::uint64_t seed) {
  npt::Random random(seed);
  return npt::random_permutation(static_cast<std::uint32_t>(mesh.vertex_count()), random);
}

/// Both meshes as one; the second one's vertices and faces come after.
inline Mesh joined(Mesh a, const Mesh& b) {
  const auto vertices = static_cast<std::uint32_t>(a.vertex_count());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const std::uint32_t corner : b.corners) a.corners.push_back(corner + vertices);
  const std::size_t corners = a.face_start.empty() ? 0 : a.face_start.back();
  if (a.face_start.empty()) a.face_start.push_back(0);
  for (std::size_t f = 1; f < b.face_start.size(); ++f) a.face_start.push_back(corners + b.face_start[f]);
  return a;
}

inline Mesh moved(Mesh mesh, Vec3f by, float scale = 1) {
  for (Vec3f& p : mesh.positions) p = p * scale + by;
  return mesh;
}

inline void add_face(Mesh& mesh, Triangle t) {
  mesh.corners.insert(mesh.corners.end(), t.begin(), t.end());
  mesh.face_start.push_back(mesh.corners.size());
}

/// A starfish with all that meshes from elsewhere have: a hole with an open border, an edge of three triangles, faces
/// without an area of each kind, a doubled face, a piece apart, vertices in no face.
inline Mesh bad_mesh(double stretch = 0) {
  Mesh mesh = starfish(16, 24, stretch);
  const auto count = static_cast<std::uint32_t>(mesh.vertex_count());
  for (std::size_t i = 0; i < 3 * 40; ++i) mesh.corners.pop_back();
  mesh.face_start.resize(mesh.face_start.size() - 40);
  mesh.positions.push_back({0, 0, 0.8F});
  add_face(mesh, {30, 31, count});  // the third triangle at an edge
  add_face(mesh, {40, 40, 41});
  add_face(mesh, {50, 50, 50});
  add_face(mesh, {60, 61, 60});
  add_face(mesh, {mesh.corners[0], mesh.corners[1], mesh.corners[2]});
  mesh.positions.push_back({(mesh.positions[70].x + mesh.positions[71].x) / 2,
                            (mesh.positions[70].y + mesh.positions[71].y) / 2,
                            (mesh.positions[70].z + mesh.positions[71].z) / 2});
  add_face(mesh, {70, 71, count + 1});  // on a line
  mesh = joined(mesh, moved(starfish(6, 8), {0.2F, 0.1F, 0.5F}, 0.1F));
  mesh.positions.push_back({0.1F, 0.1F, 0.45F});
  mesh.positions.push_back({-2, 0, 0});
  return mesh;
}

}  // namespace shapes
