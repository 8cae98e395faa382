/// Any two meshes give a result with the identity's vertices or an npt::Error: flat, huge, tiny and broken ones, and
/// people whose vertices and triangles were changed. The first byte asks for the method.
#include <npt/body/mannequin/mannequin.hpp>
#include <npt/body/skeleton.hpp>
#include <npt/transfer/detail_refiner.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <fuzz/seeds.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace {

/// The input as numbers; zeros behind its end.
class Numbers {
 public:
  explicit Numbers(std::span<const unsigned char> bytes) : bytes_(bytes) {}

  std::uint32_t byte() { return next_ < bytes_.size() ? bytes_[next_++] : 0; }
  std::uint32_t word() {
    const std::uint32_t high = byte();
    return 256 * high + byte();
  }
  bool ended() const { return next_ >= bytes_.size(); }

  float coordinate() {
    const std::uint32_t kind = byte();
    const auto small = static_cast<float>(byte()) / 64 - 2;
    switch (kind % 16) {
      case 0:
        return 0;
      case 1:
        return small * 1e-30F;
      case 2:
        return small * 1e30F;
      case 3:
        return std::bit_cast<float>(word() << 16U | word());
      default:
        return small;
    }
  }

 private:
  std::span<const unsigned char> bytes_;
  std::size_t next_ = 0;
};

void add_face(npt::Mesh& mesh, std::initializer_list<std::uint32_t> corners) {
  if (mesh.face_start.empty()) mesh.face_start.push_back(0);
  mesh.corners.insert(mesh.corners.end(), corners);
  mesh.face_start.push_back(mesh.corners.size());
}

npt::Mesh loose_triangles(Numbers& in) {
  npt::Mesh mesh;
  const std::uint32_t vertices = 1 + in.byte();
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const float x = in.coordinate(), y = in.coordinate();
    mesh.positions.push_back({x, y, in.coordinate()});
  }
  for (std::uint32_t f = in.byte(); f > 0; --f) {
    const std::uint32_t a = in.byte() % vertices, b = in.byte() % vertices;
    add_face(mesh, {a, b, in.byte() % vertices});
  }
  return mesh;
}

npt::Mesh sheet(Numbers& in) {
  npt::Mesh mesh;
  const std::uint32_t width = 2 + in.byte() % 32, height = 2 + in.byte() % 32;
  const float size = in.coordinate();
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x)
      mesh.positions.push_back({static_cast<float>(x) * size, static_cast<float>(y) * size, in.coordinate()});
  for (std::uint32_t y = 1; y < height; ++y)
    for (std::uint32_t x = 1; x < width; ++x)
      add_face(mesh, {(y - 1) * width + x - 1, (y - 1) * width + x, y * width + x, y * width + x - 1});
  return mesh;
}

npt::Mesh changed_person(Numbers& in) {
  std::vector<float> pose(3 * npt::smpl_joint_count);
  for (float& angle : pose) angle = (static_cast<float>(in.byte()) / 128 - 1) * 0.7F;
  npt::Mesh mesh = npt::to_mesh(npt::mannequin(), {}, pose);
  const float size = std::ldexp(1.0F, static_cast<int>(in.byte() % 32) - 16);
  for (npt::Vec3f& p : mesh.positions) p = p * size;
  for (std::uint32_t changes = in.byte() % 64; changes > 0; --changes) {
    npt::Vec3f& p = mesh.positions[in.word() % mesh.vertex_count()];
    (changes % 3 == 0 ? p.x : changes % 3 == 1 ? p.y : p.z) = in.coordinate();
  }
  for (std::uint32_t changes = in.byte(); changes > 0 && !in.ended(); --changes)
    mesh.corners[in.word() % mesh.corners.size()] = in.word() % static_cast<std::uint32_t>(mesh.vertex_count());
  return mesh;
}

npt::Mesh next_mesh(Numbers& in) {
  const std::uint32_t kind = in.byte() % 4;
  return kind == 0 ? changed_person(in) : kind == 1 ? sheet(in) : loose_triangles(in);
}

const npt::PoseTransfer& transfer_by(npt::Method method) {
  const auto opened = [](npt::Method asked) {
    return npt::PoseTransfer::open(NPT_FUZZ_WEIGHTS,
                                   {.method = asked, .refinement = npt::detail_refinement, .measure = true}, 1);
  };
  static const npt::PoseTransfer by_body = opened(npt::Method::body), by_network = opened(npt::Method::network),
                                 automatic = opened(npt::Method::automatic);
  return method == npt::Method::body ? by_body : method == npt::Method::network ? by_network : automatic;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  std::string people(400, '\x80'), sheets(1200, '\x40');
  people[0] = people[1] = 0;
  sheets[1] = 1;
  fuzz::write_seeds_if_asked(*argc, *argv, {people, sheets, std::string(900, '\x07'), std::string("\2\2\2\2")});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  Numbers in({data, size});
  const std::uint32_t asked = in.byte() % 8;
  const npt::Method method = asked == 0   ? npt::Method::body
                             : asked == 1 ? npt::Method::network
                                          : npt::Method::automatic;
  try {
    const npt::Mesh identity = next_mesh(in), pose = next_mesh(in);
    const npt::PoseTransfer& transfer = transfer_by(method);
    const npt::Result result = transfer.apply(transfer.character(identity), transfer.pose(pose));
    fuzz::expect(result.mesh.vertex_count() == identity.vertex_count(), "a result has the identity's vertices");
  } catch (const npt::Error&) {
  }
  return 0;
}
