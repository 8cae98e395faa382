#include <doctest/doctest.h>

#include <npt/adapt/xtensor.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <string>
#include <xtensor/xadapt.hpp>
#include <xtensor/xarray.hpp>
#include <xtensor/xview.hpp>

#include "support/bumpy_sphere.hpp"
#include "support/nets.hpp"

namespace {
using Net = npt::PoseTransferNet<16>;

npt::Model<Net> random_model() {
  npt::Model<Net> model;
  npt::randomise(model, 5);
  return model;
}

xt::xtensor<float, 2> tensor_of(const std::vector<float>& points) {
  const std::array<std::size_t, 2> shape{points.size() / 3, 3};
  return xt::adapt(points, shape);
}
}  // namespace

TEST_CASE("xtensor expressions of every kind give what spans give") {
  const npt::Engine engine(random_model(), 1);
  const auto pose = support::random_points<float>(50, 1);
  const auto identity = support::random_points<float>(50, 2);
  std::vector<float> plain(150);
  engine({pose, identity}, plain);
  const auto equals_plain = [&](const xt::xtensor<float, 2>& result) {
    CHECK(result.shape()[0] == 50);
    CHECK(result.shape()[1] == 3);
    return std::equal(plain.begin(), plain.end(), result.begin());
  };
  const xt::xtensor<float, 2> a = tensor_of(pose), b = tensor_of(identity);
  CHECK(equals_plain(engine(a, b)));

  const xt::xarray<float> dynamic = a;
  CHECK(equals_plain(engine(dynamic, b)));

  const xt::xtensor<double, 2> doubles = xt::cast<double>(a);
  CHECK(equals_plain(engine(doubles, b)));

  const xt::xtensor<float, 2, xt::layout_type::column_major> column_major = a;
  CHECK(equals_plain(engine(column_major, b)));

  CHECK(equals_plain(engine(a * 1.0F, b)));  // lazy

  xt::xtensor<float, 2> wide = xt::zeros<float>({std::size_t{60}, std::size_t{5}});
  xt::view(wide, xt::range(4, 54), xt::range(1, 4)) = a;
  CHECK(equals_plain(engine(xt::view(wide, xt::range(4, 54), xt::range(1, 4)), b)));
  xt::xtensor<float, 2> tall = xt::zeros<float>({std::size_t{60}, std::size_t{3}});
  xt::view(tall, xt::range(4, 54), xt::all()) = a;
  CHECK(equals_plain(engine(xt::view(tall, xt::range(4, 54), xt::all()), b)));  // contiguous, with an offset

  const std::array<std::size_t, 2> shape{50, 3};
  CHECK(equals_plain(engine(xt::adapt(pose, shape), xt::adapt(identity, shape))));
}

TEST_CASE("a tensor of another shape is an error that shows the shape") {
  const npt::Engine engine(random_model(), 1);
  const xt::xtensor<float, 2> good = xt::zeros<float>({std::size_t{4}, std::size_t{3}});
  const xt::xtensor<float, 2> bad = xt::zeros<float>({std::size_t{3}, std::size_t{4}});
  CHECK_THROWS_WITH_AS(engine(bad, good), "tensor: found shape [3, 4], expected [V, 3]", npt::Error);
  const xt::xarray<float> flat = xt::zeros<float>({std::size_t{12}});
  CHECK_THROWS_WITH_AS(engine(good, flat), "tensor: found shape [12], expected [V, 3]", npt::Error);
}

TEST_CASE("a transfer takes tensors and returns one, with the bits of meshes") {
  const npt::Mesh identity = support::bumpy_sphere(9, 14, 0.2), pose = support::bumpy_sphere(6, 11, 0.4);
  npt::Model<npt::PoseTransferNet<16>> model;
  npt::randomise(model, 8);
  const npt::PoseTransfer transfer(model, {}, 1);
  const npt::MeshTensors own = npt::to_tensors(identity), other = npt::to_tensors(pose);
  CHECK(own.positions.shape()[0] == identity.vertex_count());
  CHECK(own.triangles.shape()[0] == npt::triangulate(identity).size());

  const npt::Mesh expected = transfer(identity, pose);
  xt::xtensor<float, 2> result = xt::empty_like(own.positions);
  transfer(npt::view_of(own), npt::view_of(other), npt::span_of(result));
  CHECK(std::equal(result.begin(), result.end(), expected.coordinates().begin()));

  // Without faces, and from expressions of another type.
  const xt::xtensor<float, 2> posed = transfer(own.positions, own.positions * 1.0F);
  const npt::Mesh same = transfer(identity, identity);
  CHECK(std::equal(posed.begin(), posed.end(), same.coordinates().begin()));
}

TEST_CASE("tensors that are no meshes are refused by name") {
  npt::MeshTensors mesh = npt::to_tensors(support::bumpy_sphere(3, 5, 0.2));
  mesh.triangles = xt::zeros<std::uint32_t>({4, 4});
  CHECK_THROWS_WITH_AS(npt::view_of(mesh, "cube"), "cube: triangles: found shape [4, 4], expected three columns",
                       npt::Error);
}
