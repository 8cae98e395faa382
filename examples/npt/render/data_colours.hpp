/// Colours that say something: errors on a scale, the numbers of vertices, the directions of normals.
#pragma once

#include <render/colour.hpp>

#include <npt/mesh/mesh.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace render {

/// A colour as the eye orders it: lightness 0 .. 1, and two axes in which equal distances look equally far (Ottosson,
/// "A perceptual color space for image processing", 2020). Of linear RGB, and back; what a screen can't show comes back
/// outside of 0 .. 1.
npt::Vec3d to_oklab(Colour colour);
Colour from_oklab(npt::Vec3d lab);

/// t in [0, 1] to a colour from the light grey of clay over yellow, orange and red to dark red. Equal steps of t look
/// equally far apart, and lightness falls all the way: the order survives grey print and colour blindness, and where t
/// is small the shading stays readable. NaN is the darkest.
Colour heat_colour(float t);

/// t in [0, 1] to a hue of one lightness, from red over yellow, green and blue to violet. For numbers without more or
/// less.
Colour hue_colour(float t);

/// A colour a vertex by its number: neighbours in number have neighbouring colours. On a body in its own order that
/// makes large patches, on a shuffled one noise. [count]
std::vector<Colour> index_colours(std::size_t count);

/// A colour a vertex by the direction of its normal: x, y and z are red, green and blue. Vertices without a normal are
/// grey. [V]
std::vector<Colour> normal_colours(const npt::Mesh& mesh);

/// heat_colour of each value between `low` and `high`; what lies outside has the colour of the nearer end.
std::vector<Colour> heat_colours(std::span<const double> values, double low, double high);

/// Where a scale of errors ends: at `wanted`, or for 0 at a round number that one value in a hundred exceeds at most.
struct ErrorScale {
  double high = 1;
  bool open_end = false;  ///< some values lie beyond
};
/// Errors    npt::Error for no values
ErrorScale error_scale(std::vector<double> values, double wanted);

/// The distance of each vertex to the same vertex of the truth, both meshes moved so that their bounding boxes' centres
/// meet, as the PMD does. [V]
/// Errors    npt::Error for different vertex counts
std::vector<double> centred_distances(std::span<const float> xyz, std::span<const float> truth);

}  // namespace render
