#include <render/painter.hpp>
#include <render/rasteriser.hpp>
#include <render/studio.hpp>

#include <npt/base/default_executor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace render {
namespace {

constexpr std::uint32_t nothing = 0xFFFFFFFFU;

/// For each sample of a panel the triangle, or point of a cloud, that is seen there.
struct Visibility {
  int width, height;                ///< in samples
  std::vector<std::uint32_t> seen;  ///< [height * width]
  std::vector<float> nearness;      ///< [height * width]

  Visibility(int w, int h)
      : width(w),
        height(h),
        seen(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), nothing),
        nearness(seen.size(), 0.0F) {}

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  void show(int x, int y, float near_value, std::uint32_t id) {
    const std::size_t i = index(x, y);
    if (near_value <= nearness[i]) return;
    nearness[i] = near_value;
    seen[i] = id;
  }
};

/// `camera` counts in samples here.
Visibility look(const Figure& figure, const Camera& camera, int width, int height) {
  Visibility view(width, height);
  std::vector<Vec3f> projected;
  projected.reserve(figure.positions.size());
  for (Vec3f p : figure.positions) projected.push_back(camera.project(p));
  for (std::uint32_t t = 0; t < figure.triangles.size(); ++t) {
    const Triangle& corner = figure.triangles[t];
    raster_triangle(projected[corner[0]], projected[corner[1]], projected[corner[2]], width, height,
                    [&](int x, int y, float near_value) { view.show(x, y, near_value, t); });
  }
  if (figure.is_cloud())
    for (std::uint32_t v = 0; v < projected.size(); ++v) {
      const Vec3f p = projected[v];
      raster_disc(p.x, p.y, figure.disc_radius * camera.focal * p.z, width, height,
                  [&](int x, int y, float u, float w) {
                    const float bulge = figure.disc_radius * std::sqrt(std::max(0.0F, 1 - u * u - w * w));
                    view.show(x, y, p.z / (1 - bulge * p.z), v);
                  });
    }
  return view;
}

/// What a pixel shows of one piece of surface.
struct Fragment {
  Vec3f position, normal;
  Colour colour;
  float share = 0;  ///< of the pixel
};

/// Two fragments of a pixel are lit as one where they lie on one smooth surface.
bool alike(const Fragment& a, const Fragment& b, float pixel) {
  const Vec3f d = a.position - b.position;
  return dot(d, d) < 16 * pixel * pixel && dot(a.normal, b.normal) > 0.9F;
}

void merge(Fragment& into, const Fragment& other) {
  const float t = other.share / (into.share + other.share);
  into.position += (other.position - into.position) * t;
  into.normal = normalised(into.normal + (other.normal - into.normal) * t);
  into.colour = mix(into.colour, other.colour, t);
  into.share += other.share;
}

/// Barycentric weights of the point where the ray from the eye meets the triangle's plane, kept within the triangle.
std::array<float, 3> weights_at(Vec3f eye, Vec3f ray, Vec3f a, Vec3f b, Vec3f c) {
  const auto volume = [ray](Vec3f p, Vec3f q) { return dot(ray, cross(p, q)); };
  a = a - eye, b = b - eye, c = c - eye;
  std::array<float, 3> w{volume(b, c), volume(c, a), volume(a, b)};
  const float sign = w[0] + w[1] + w[2] < 0 ? -1.0F : 1.0F;
  float sum = 0;
  for (float& v : w) sum += v = std::max(0.0F, sign * v);
  if (!(sum > 0)) return {1.0F / 3, 1.0F / 3, 1.0F / 3};
  for (float& v : w) v /= sum;
  return w;
}

/// A point of a triangle with its smooth normal, which faces the viewer. On coarse meshes the smooth normal and the
/// flat triangle disagree about shadows; the point is therefore lifted to the curved surface that the normals describe
/// (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021).
Fragment triangle_fragment(const Figure& figure, const Triangle& corner, Vec3f eye, Vec3f ray) {
  const std::array<Vec3f, 3> p{figure.positions[corner[0]], figure.positions[corner[1]], figure.positions[corner[2]]};
  const Vec3f flat = cross(p[1] - p[0], p[2] - p[0]);
  const float side = dot(flat, ray) > 0 ? -1.0F : 1.0F;  // seen from behind: a skirt's inner side
  const std::array<float, 3> w = weights_at(eye, ray, p[0], p[1], p[2]);
  Fragment fragment{};
  for (std::size_t i = 0; i < 3; ++i) {
    fragment.position += p[i] * w[i];
    fragment.normal += figure.normals[corner[i]] * (side * w[i]);
    fragment.colour += figure.colour(corner[i]) * w[i];
  }
  fragment.normal = normalised(fragment.normal);
  if (fragment.normal == Vec3f{}) fragment.normal = normalised(flat * side);
  Vec3f lift{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f normal = figure.normals[corner[i]] * side;
    lift += normal * (-w[i] * std::min(0.0F, dot(fragment.position - p[i], normal)));
  }
  fragment.position += lift;
  return fragment;
}

/// A point of a cloud is a small ball.
Fragment point_fragment(const Figure& figure, std::uint32_t vertex, Vec3f eye, Vec3f ray) {
  const Vec3f centre = figure.positions[vertex], direction = normalised(ray);
  const float along = dot(centre - eye, direction);
  const Vec3f across = eye + direction * along - centre;
  const float r = figure.disc_radius, depth2 = std::max(0.0F, r * r - dot(across, across));
  const Vec3f normal = normalised(across - direction * std::sqrt(depth2));
  return {centre + normal * r, normal, figure.colour(vertex), 0};
}

class PanelPainter {
 public:
  PanelPainter(const Figure& figure, const Camera& camera, const FigureOptions& options)
      : figure_(figure), camera_(camera), options_(options) {}

  Image paint() {
    find_fragments();
    light_fragments();
    Image image(options_.panel_width, options_.panel_height);
    npt::DefaultExecutor().for_each(image.height, [&](int y, int) {
      for (int x = 0; x < image.width; ++x) image.at(x, y) = pixel(x, y);
    });
    return image;
  }

 private:
  void find_fragments() {
    const int n = options_.samples, width = options_.panel_width, height = options_.panel_height;
    Camera fine = camera_;
    fine.focal *= static_cast<float>(n);
    fine.centre_x *= static_cast<float>(n);
    fine.centre_y *= static_cast<float>(n);
    const Visibility view = look(figure_, fine, width * n, height * n);
    std::vector<std::vector<Fragment>> rows(static_cast<std::size_t>(height));
    first_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 1, 0);
    npt::DefaultExecutor().for_each(height, [&](int y, int) {
      for (int x = 0; x < width; ++x) {
        std::vector<Fragment>& row = rows[static_cast<std::size_t>(y)];
        const std::size_t before = row.size();
        add_fragments(view, fine, x, y, row);
        first_[pixel_index(x, y) + 1] = row.size() - before;
      }
    });
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    for (const auto& row : rows) fragments_.insert(fragments_.end(), row.begin(), row.end());
  }

  void add_fragments(const Visibility& view, const Camera& fine, int x, int y, std::vector<Fragment>& out) const {
    struct Piece {
      std::uint32_t id;
      int count;
      float x, y;
    };
    const int n = options_.samples;
    std::array<Piece, most_samples * most_samples> pieces;
    std::size_t count = 0;
    for (int row = y * n; row < (y + 1) * n; ++row)
      for (int column = x * n; column < (x + 1) * n; ++column) {
        const std::uint32_t id = view.seen[view.index(column, row)];
        if (id == nothing) continue;
        std::size_t i = 0;
        while (i < count && pieces[i].id != id) ++i;
        if (i == count) pieces[count++] = {id, 0, 0, 0};
        ++pieces[i].count;
        pieces[i].x += static_cast<float>(column) + 0.5F;
        pieces[i].y += static_cast<float>(row) + 0.5F;
      }
    const Vec3f eye = camera_.eye();
    const float pixel = camera_.distance / camera_.focal;
    const std::size_t first = out.size();
    for (std::size_t i = 0; i < count; ++i) {
      const float share = static_cast<float>(pieces[i].count);
      const Vec3f ray = fine.ray(pieces[i].x / share, pieces[i].y / share);
      Fragment fragment = figure_.is_cloud() ? point_fragment(figure_, pieces[i].id, eye, ray)
                                             : triangle_fragment(figure_, figure_.triangles[pieces[i].id], eye, ray);
      fragment.share = share / static_cast<float>(n * n);
      std::size_t same = first;
      while (same < out.size() && !alike(out[same], fragment, pixel)) ++same;
      if (same == out.size()) {
        out.push_back(fragment);
      } else {
        merge(out[same], fragment);
      }
    }
  }

  void light_fragments() {
    const std::vector<Lamp> lamps = studio_lamps(options_.view.yaw);
    std::vector<ShadePoint> points;
    if (options_.floor_shadow) points = floor_.points();
    const std::size_t floor_points = points.size();
    const Vec3f eye = camera_.eye();
    for (const Fragment& f : fragments_) points.push_back({f.position, f.normal, normalised(eye - f.position)});
    // A cell a pixel shows all that a thumbnail can.
    const int cells = std::min(options_.shadow_cells, std::max(64, options_.panel_height));
    const std::vector<Light> light = gather_light(figure_, lamps, points, cells);
    if (options_.floor_shadow) floor_.set_light(std::span(light).first(floor_points), lamps);
    for (std::size_t i = 0; i < fragments_.size(); ++i) {
      const Light& l = light[floor_points + i];
      // Full light from everywhere would be brighter than any surface of the studio.
      const Colour diffuse = mix(l.diffuse, Colour{0.92F, 0.92F, 0.92F}, figure_.even_light);
      fragments_[i].colour = film(multiply(fragments_[i].colour, diffuse) + l.specular * (1 - figure_.even_light));
    }
  }

  /// What would be brighter than paper rolls off smoothly instead of turning into a flat patch.
  static Colour film(Colour c) {
    const auto curve = [](float v) {
      constexpr float knee = 0.75F;
      return v <= knee ? v : knee + (1 - knee) * (1 - std::exp(-(v - knee) / (1 - knee)));
    };
    return {curve(c.x), curve(c.y), curve(c.z)};
  }

  Pixel pixel(int x, int y) const {
    const float shade = floor_shade(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
    Colour colour;
    float cover = 0;
    for (std::size_t i = first_[pixel_index(x, y)]; i < first_[pixel_index(x, y) + 1]; ++i) {
      colour += fragments_[i].colour * fragments_[i].share;
      cover += fragments_[i].share;
    }
    const float open = std::max(0.0F, 1 - cover);
    if (options_.backdrop == Backdrop::colour) return to_pixel(colour + options_.background * (open * shade));
    const float alpha = cover + open * (1 - shade);  // the shadow is black that lets the page shine through
    return alpha > 0 ? to_pixel(colour / alpha, alpha) : Pixel{0, 0, 0, 0};
  }

  /// The floor's brightness where the pixel's ray meets it; 1 where it doesn't. The shadow is fainter than a real one,
  /// and fades before the panel's border cuts it off.
  float floor_shade(float x, float y) const {
    if (!options_.floor_shadow) return 1;
    const Vec3f eye = camera_.eye(), ray = camera_.ray(x, y);
    if (!(ray.y < 0) || !(eye.y > 0)) return 1;
    const Vec3f p = eye - ray * (eye.y / ray.y);
    const auto border = [](float v, int size) {
      const float share = std::min(v, static_cast<float>(size) - v) / static_cast<float>(size);
      const float t = std::clamp(share / 0.12F, 0.0F, 1.0F);
      return t * t * (3 - 2 * t);
    };
    const float strength = 0.62F * border(x, options_.panel_width) * border(y, options_.panel_height);
    return 1 - strength * (1 - floor_.at(p.x, p.z));
  }

  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(options_.panel_width) + static_cast<std::size_t>(x);
  }

  const Figure& figure_;
  const Camera& camera_;
  const FigureOptions& options_;
  FloorShadow floor_{figure_};
  std::vector<Fragment> fragments_;  ///< of all pixels, row by row
  std::vector<std::size_t> first_;   ///< [pixels + 1] pixel i has fragments first_[i] .. first_[i + 1] - 1
};

}  // namespace

Image paint_panel(const Figure& figure, const Camera& camera, const FigureOptions& options) {
  return PanelPainter(figure, camera, options).paint();
}

}  // namespace render
