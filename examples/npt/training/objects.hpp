/// Surfaces of things, made of boxes, cones and ellipsoids: furniture, vessels, plants, vehicles, houses. A reader of
/// people is shown them among what is no person.
/// Unit      an object's own: a chair is about one high
/// Shapes    points and normals: [n]
/// Numerics  an object and its points depend on the state of `random` only
#pragma once

#include <npt/base/random.hpp>
#include <npt/base/vec3.hpp>
#include <npt/base/weighted_choice.hpp>
#include <npt/config.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

/// A part of an object.
struct ObjectPart {
  enum class Kind { box, cone, ellipsoid };
  Kind kind = Kind::box;
  Vec3d centre;
  std::array<Vec3d, 3> axes;  ///< half of each side, or the radii, at right angles; a cone stands along the second
  double taper = 1;           ///< of a cone: the upper end's radii, as a share of the lower one's
};

namespace data::internal {

/// Puts objects together, y up.
class ObjectMaker {
 public:
  explicit ObjectMaker(Random& random) : random_(random) {}

  std::vector<ObjectPart> make() {
    using Make = void (ObjectMaker::*)();
    constexpr std::array<Make, 10> kinds{
        &ObjectMaker::table, &ObjectMaker::seat,    &ObjectMaker::vessel, &ObjectMaker::shelf,   &ObjectMaker::bed,
        &ObjectMaker::plant, &ObjectMaker::vehicle, &ObjectMaker::house,  &ObjectMaker::lattice, &ObjectMaker::heap};
    (this->*kinds[random_.below(kinds.size())])();
    return std::move(parts_);
  }

 private:
  double between(double low, double high) { return random_.uniform(low, high); }
  bool chance(double p) { return random_.uniform() < p; }
  int count(int low, int high) {
    return low + static_cast<int>(random_.below(static_cast<std::uint32_t>(high - low + 1)));
  }

  // What is drawn between braces is drawn from left to right, by any compiler; arguments of a function are in no order.
  struct Box {
    Vec3d centre, half;
  };
  struct Ball {
    Vec3d centre, radii;
  };
  struct Pole {
    Vec3d from, to;
    double radius = 0, taper = 1;
  };
  void box(const Box& b) {
    parts_.push_back({ObjectPart::Kind::box, b.centre, {Vec3d{b.half.x, 0, 0}, {0, b.half.y, 0}, {0, 0, b.half.z}}, 1});
  }
  void ball(const Ball& b) {
    parts_.push_back(
        {ObjectPart::Kind::ellipsoid, b.centre, {Vec3d{b.radii.x, 0, 0}, {0, b.radii.y, 0}, {0, 0, b.radii.z}}, 1});
  }
  /// From one end to the other, round.
  void pole(const Pole& p) {
    const Vec3d along = (p.to - p.from) * 0.5;
    const Vec3d side = std::abs(along.y) > 0.9 * length(along) ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const Vec3d first = normalised(cross(along, side)), second = normalised(cross(first, along));
    parts_.push_back(
        {ObjectPart::Kind::cone, (p.from + p.to) * 0.5, {first * p.radius, along, second * p.radius}, p.taper});
  }
  /// A leg, round or square.
  void leg(Vec3d from, Vec3d to, double thick, bool square) {
    if (square)
      box({(from + to) * 0.5, {thick, 0.5 * std::abs(from.y - to.y), thick}});
    else
      pole({from, to, thick, between(0.6, 1.2)});
  }
  /// Four legs under the corners of a plate.
  void legs(double x, double z, double top, double thick) {
    const bool square = chance(0.5);
    const double splay = square ? 0 : between(-0.1, 0.25);
    for (const double sx : {-1.0, 1.0})
      for (const double sz : {-1.0, 1.0})
        leg({sx * (x - thick) * (1 + splay), 0, sz * (z - thick) * (1 + splay)},
            {sx * (x - thick), top, sz * (z - thick)}, thick, square);
  }

  void table() {
    const double top = between(0.35, 1.1), plate = between(0.01, 0.05);
    const double x = between(0.25, 1.2), z = between(0.25, 0.8);
    if (chance(0.3)) {  // round, on one foot or three
      pole({{0, top, 0}, {0, top + 2 * plate, 0}, x});
      if (chance(0.5)) {
        pole({{0, 0, 0}, {0, top, 0}, between(0.03, 0.12), between(0.5, 1.5)});
        pole({{0, 0, 0}, {0, 2 * plate, 0}, x * between(0.4, 0.9)});
      } else {
        const int feet = count(3, 5);
        for (int i = 0; i < feet; ++i) {
          const double a = 2 * std::numbers::pi * i / feet;
          const Vec3d out{std::cos(a) * x, 0, std::sin(a) * x};
          pole({out * 0.9, out * between(0.2, 0.8) + Vec3d{0, top, 0}, between(0.02, 0.05)});
        }
      }
      return;
    }
    box({{0, top + plate, 0}, {x, plate, z}});
    legs(x, z, top, between(0.02, 0.07));
    if (chance(0.4)) box({{0, top - 0.06, 0}, {0.9 * x, 0.05, 0.9 * z}});
    if (chance(0.3)) box({{0, between(0.1, 0.4) * top, 0}, {0.8 * x, 0.5 * plate, 0.8 * z}});
  }

  /// Stools, chairs, armchairs, benches and sofas.
  void seat() {
    const double high = between(0.3, 0.6), x = chance(0.3) ? between(0.5, 1.1) : between(0.2, 0.35),
                 z = between(0.2, 0.45);
    const double thick = between(0.015, 0.12), wood = between(0.015, 0.05);
    box({{0, high, 0}, {x, thick, z}});
    if (chance(0.25))
      box({{0, 0.5 * high, 0}, {x, 0.5 * high, z}});
    else
      legs(x, z, high, wood);
    if (chance(0.15)) return;  // a stool
    const double back = between(0.3, 0.9);
    if (chance(0.5)) {
      box({{0, high + 0.5 * back, -z}, {x, 0.5 * back, between(0.01, 0.1)}});
    } else {
      for (const double s : {-1.0, 1.0}) leg({s * (x - wood), high, -z}, {s * (x - wood), high + back, -z}, wood, true);
      const int slats = count(1, 4);
      for (int i = 0; i < slats; ++i)
        box({{0, high + back * (i + 0.7) / slats, -z}, {x, between(0.02, 0.06), 0.6 * wood}});
    }
    if (chance(0.5)) {
      const double arm = between(0.12, 0.3);
      for (const double s : {-1.0, 1.0}) {
        box({{s * x, high + arm, 0}, {between(0.02, 0.1), between(0.015, 0.05), z}});
        if (chance(0.5)) box({{s * x, high + 0.5 * arm, 0}, {wood, 0.5 * arm, z}});
      }
    }
  }

  /// Pillars, vases, bottles, lamps, cups: rings upon each other.
  void vessel() {
    const int rings = count(1, 7);
    double y = 0, radius = between(0.05, 0.4);
    for (int i = 0; i < rings; ++i) {
      const double high = between(0.03, 1.2 / rings + 0.2), next = std::max(0.02, radius * between(0.4, 1.8));
      pole({{0, y, 0}, {0, y + high, 0}, radius, next / radius});
      y += high;
      radius = chance(0.25) ? next * between(0.4, 1.6) : next;
    }
    if (chance(0.25)) ball({{0, y, 0}, {radius, between(0.3, 1.2) * radius, radius}});
    if (chance(0.25)) pole({{0, 0.6 * y, 0}, {1.3 * radius + 0.1, 0.5 * y, 0}, 0.03});
  }

  /// Boxes, cupboards, shelves, screens.
  void shelf() {
    const double x = between(0.15, 0.9), y = between(0.15, 1.1), z = between(0.02, 0.6), wood = 0.02;
    if (chance(0.5)) {
      box({{0, y, 0}, {x, y, z}});
    } else {
      for (const double s : {-1.0, 1.0}) box({{s * x, y, 0}, {wood, y, z}});
      const int boards = count(2, 6);
      for (int i = 0; i < boards; ++i) box({{0, 2 * y * i / (boards - 1), 0}, {x, wood, z}});
      if (chance(0.5)) box({{0, y, -z}, {x, y, 0.5 * wood}});
    }
    if (chance(0.3)) legs(x, z, -between(0.05, 0.4), 0.03);
    if (chance(0.3)) box({{between(-0.5, 0.5) * x, 2 * y + 0.1, 0}, {0.3 * x, 0.1, 0.7 * z}});
  }

  void bed() {
    const double x = between(0.4, 1.0), z = between(0.8, 1.2), high = between(0.2, 0.6);
    box({{0, high, 0}, {x, between(0.05, 0.2), z}});
    legs(x, z, high, between(0.03, 0.08));
    box({{0, high + 0.2, -z}, {x, between(0.2, 0.6), 0.04}});
    if (chance(0.5)) box({{0, high + 0.1, z}, {x, between(0.1, 0.4), 0.04}});
    const int pillows = count(0, 2);
    for (int i = 0; i < pillows; ++i) ball({{x * (i - 0.5), high + 0.2, -0.75 * z}, {0.3, 0.1, 0.2}});
  }

  void plant() {
    const double high = between(0.2, 1.5), wood = between(0.02, 0.15);
    pole({{0, 0, 0}, {between(-0.1, 0.1), high, between(-0.1, 0.1)}, wood, between(0.3, 1)});
    if (chance(0.4)) pole({{0, -0.2, 0}, {0, 0.1, 0}, between(0.1, 0.3), between(1, 1.5)});
    const int branches = count(0, 7), crowns = count(1, 5);
    for (int i = 0; i < branches; ++i) {
      const Vec3d from{0, high * between(0.3, 1), 0};
      pole({from, from + Vec3d{between(-0.6, 0.6), between(-0.1, 0.6), between(-0.6, 0.6)}, 0.5 * wood,
            between(0.2, 1)});
    }
    for (int i = 0; i < crowns; ++i) {
      const double r = between(0.15, 0.6);
      ball({{between(-0.4, 0.4), high + between(-0.2, 0.5), between(-0.4, 0.4)}, {r, r * between(0.6, 1.4), r}});
    }
    if (chance(0.3))
      for (int i = 0; i < 3; ++i)
        pole({{0, high * (0.4 + 0.3 * i), 0}, {0, high * (0.9 + 0.3 * i), 0}, 0.5 - 0.12 * i, 0.05});
  }

  /// Along z, on two to eight wheels.
  void vehicle() {
    const double x = between(0.15, 0.9), y = between(0.1, 0.6), z = between(0.5, 2.2), wheel = between(0.15, 0.45);
    box({{0, wheel + y, 0}, {x, y, z}});
    if (chance(0.7))
      box({{0, wheel + 2.5 * y, between(-0.4, 0.4) * z}, {0.9 * x, between(0.4, 0.9) * y, between(0.3, 0.6) * z}});
    const int axles = count(2, 4);
    for (int i = 0; i < axles; ++i) {
      const double at = z * (1.6 * i / (axles - 1) - 0.8);
      for (const double s : {-1.0, 1.0}) pole({{s * x, wheel, at}, {s * (x + 0.1), wheel, at}, wheel});
    }
    if (chance(0.2)) pole({{0, wheel + 2 * y, 0}, {0, wheel + 2 * y + 0.2, 1.3 * z}, 0.06});
  }

  void house() {
    const double x = between(0.4, 1.2), y = between(0.3, 1.5), z = between(0.4, 1.2);
    box({{0, y, 0}, {x, y, z}});
    if (chance(0.6)) pole({{0, 2 * y, 0}, {0, 2 * y + between(0.3, 1.2), 0}, 1.3 * std::max(x, z), between(0.02, 0.4)});
    if (chance(0.4)) box({{between(-0.6, 0.6) * x, 2 * y + 0.3, 0}, {0.1, 0.4, 0.1}});
    if (chance(0.4)) box({{1.4 * x, 0.6 * y, 0}, {0.6 * x, 0.6 * y, 0.7 * z}});
  }

  /// Ladders, fences, racks, grids.
  void lattice() {
    const double x = between(0.15, 1), y = between(0.3, 1.2), thick = between(0.01, 0.05);
    const int rails = count(2, 5), rungs = count(2, 8);
    for (int i = 0; i < rails; ++i) {
      const double at = x * (2.0 * i / (rails - 1) - 1);
      leg({at, 0, 0}, {at, 2 * y, 0}, thick, chance(0.5));
    }
    for (int i = 0; i < rungs; ++i) {
      const double at = 2 * y * (i + 0.5) / rungs;
      pole({{-x, at, 0}, {x, at, 0}, 0.8 * thick});
    }
    if (chance(0.3))
      for (const double s : {-1.0, 1.0}) box({{s * x, 0, 0}, {thick, thick, between(0.1, 0.5)}});
  }

  /// Up to four parts of any kind and direction, each of which touches the one before it.
  void heap() {
    const int size = count(1, 4);
    Vec3d at;
    for (int i = 0; i < size; ++i) {
      const Vec3d half{between(0.05, 0.6), between(0.05, 0.6), between(0.05, 0.6)};
      switch (random_.below(3)) {
        case 0:
          box({at, half});
          break;
        case 1:
          ball({at, half});
          break;
        default:
          pole({at - Vec3d{between(-1, 1), between(-1, 1), between(-1, 1)} * half.y,
                at + Vec3d{between(-1, 1), between(0.1, 1), between(-1, 1)} * half.y, half.x,
                chance(0.2) ? 0 : between(0.2, 1.2)});
      }
      at += Vec3d{half.x * between(-1, 1), half.y * between(-1, 1), half.z * between(-1, 1)} * 1.2;
    }
  }

  Random& random_;
  std::vector<ObjectPart> parts_;
};

/// Faces of a box, or the lower end, the side and the upper end of a cone; an ellipsoid has one.
struct ObjectFace {
  std::size_t part = 0;
  int face = 0;
  double area = 0;
};

inline std::vector<ObjectFace> faces_of(const std::vector<ObjectPart>& parts) {
  std::vector<ObjectFace> faces;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const ObjectPart& part = parts[p];
    const double a = length(part.axes[0]), b = length(part.axes[1]), c = length(part.axes[2]);
    switch (part.kind) {
      case ObjectPart::Kind::box:
        for (int f = 0; f < 6; ++f) faces.push_back({p, f, 4 * (f < 2 ? b * c : f < 4 ? a * c : a * b)});
        break;
      case ObjectPart::Kind::cone: {
        const double slant = std::hypot(2 * b, a * (1 - part.taper));
        faces.push_back({p, 0, std::numbers::pi * a * a});
        faces.push_back({p, 1, std::numbers::pi * a * (1 + part.taper) * slant});
        faces.push_back({p, 2, std::numbers::pi * a * a * part.taper * part.taper});
        break;
      }
      case ObjectPart::Kind::ellipsoid: {  // Thomsen's approximation, good to 1 %
        constexpr double e = 1.6075;
        const double sum = std::pow(a * b, e) + std::pow(a * c, e) + std::pow(b * c, e);
        faces.push_back({p, 0, 4 * std::numbers::pi * std::pow(sum / 3, 1 / e)});
        break;
      }
    }
  }
  return faces;
}

/// A point of a face, all of whose places are equally likely, and the normal there.
inline void draw_on_face(const ObjectPart& part, int face, Random& random, Vec3d& point, Vec3d& normal) {
  const auto& [x, y, z] = part.axes;
  const auto round = [&random] { return random.uniform(0, 2 * std::numbers::pi); };
  switch (part.kind) {
    case ObjectPart::Kind::box: {
      const auto across = static_cast<std::size_t>(face / 2);
      const double sign = face % 2 == 0 ? 1 : -1, u = random.uniform(-1, 1), v = random.uniform(-1, 1);
      const Vec3d& out = part.axes[across];
      point = out * sign + part.axes[(across + 1) % 3] * u + part.axes[(across + 2) % 3] * v;
      normal = out * sign;
      break;
    }
    case ObjectPart::Kind::cone: {
      const double angle = round();
      const Vec3d out = x * std::cos(angle) + z * std::sin(angle);
      if (face == 1) {
        // The share of the height to which a share u of the area reaches, where radii grow from 1 to `taper`.
        const double u = random.uniform(), t = part.taper;
        const double up = std::abs(1 - t) < 1e-6 ? u : (1 - std::sqrt(1 - u * (1 - t * t))) / (1 - t);
        point = y * (2 * up - 1) + out * (1 + up * (t - 1));
        const double radius = length(x), high = 2 * length(y);
        normal = out * high * high / radius + y * (2 * radius * (1 - t));
      } else {
        const double radius = std::sqrt(random.uniform()) * (face == 0 ? 1 : part.taper), end = face == 0 ? -1 : 1;
        point = out * radius + y * end;
        normal = y * end;
      }
      break;
    }
    case ObjectPart::Kind::ellipsoid: {
      const double a = length(x), b = length(y), c = length(z), most = std::max({a * b, a * c, b * c});
      for (;;) {
        const double height = random.uniform(-1, 1), ring = std::sqrt(1 - height * height), angle = round();
        const Vec3d d{ring * std::cos(angle), height, ring * std::sin(angle)};
        // How much the sphere's surface grows there.
        const double grows = length(Vec3d{d.x * b * c, d.y * a * c, d.z * a * b});
        if (random.uniform() * most > grows) continue;
        point = x * d.x + y * d.y + z * d.z;
        normal = x * (d.x / (a * a)) + y * (d.y / (b * b)) + z * (d.z / (c * c));
        break;
      }
      break;
    }
  }
  point += part.centre;
  normal = normalised(normal);
}

}  // namespace data::internal

/// Points of an object's surface by area, and normals, outward of the parts that they lie on; what a part hides of
/// another is there, too.
inline void draw_object_points(const std::vector<ObjectPart>& parts, Random& random, std::size_t n,
                               std::vector<Vec3f>& points, std::vector<Vec3f>& normals) {
  const std::vector<data::internal::ObjectFace> faces = data::internal::faces_of(parts);
  WeightedChoice choice;
  for (const auto& face : faces) choice.add(face.area);
  points.clear(), normals.clear();
  for (std::size_t i = 0; i < n; ++i) {
    const data::internal::ObjectFace& face = faces[choice(random)];
    Vec3d point, normal;
    data::internal::draw_on_face(parts[face.part], face.face, random, point, normal);
    points.push_back(point.as<float>());
    normals.push_back(normal.as<float>());
  }
}

/// A table, seat, vessel, shelf, bed, plant, vehicle, house, lattice or heap, each as often.
inline std::vector<ObjectPart> random_object(Random& random) { return data::internal::ObjectMaker(random).make(); }

/// Points by area of an object that nobody has seen.
inline void draw_object_surface(Random& random, std::size_t n, std::vector<Vec3f>& points,
                                std::vector<Vec3f>& normals) {
  draw_object_points(random_object(random), random, n, points, normals);
}

}  // namespace npt::inline NPT_ABI
