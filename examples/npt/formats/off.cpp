#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/text.hpp>
#include <npt/mesh/validate.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace formats {

namespace {

/// The lines of an OFF file that say something, word by word.
class OffLines {
 public:
  OffLines(std::string_view text, const std::string& name) : name_(name), lines_(text) {}

  void next(const std::string& expected) {
    while (lines_.next(line_)) {
      line_ = line_.substr(0, line_.find('#'));
      std::string_view rest = line_;
      if (!npt::next_word(rest).empty()) return;
    }
    throw npt::Error({name_, "the end", "no more lines", expected});
  }
  bool ended() const {
    std::string_view rest = line_;
    return npt::next_word(rest).empty();
  }
  std::string_view word() { return npt::next_word(line_); }
  [[noreturn]] void fail(std::string_view word, const std::string& expected) const {
    throw npt::Error({name_, "line " + std::to_string(lines_.number()),
                      word.empty() ? "the end of the line" : npt::in_quotes(word), expected});
  }
  std::size_t whole(std::size_t most, const std::string& expected) {
    const std::string_view own = word();
    const auto value = npt::parse_number<std::size_t>(own);
    if (!value || *value > most) fail(own, expected);
    return *value;
  }
  float number() {
    const std::string_view own = word();
    const auto value = npt::parse_number<float>(own);
    if (!value || !std::isfinite(*value)) fail(own, "a finite number");
    return *value;
  }

 private:
  const std::string& name_;
  npt::TextLines lines_;
  std::string_view line_;
};

}  // namespace

npt::Mesh read_off(const std::filesystem::path& path) {
  const std::string text = npt::read_file(path), name = path.string();
  OffLines lines(text, name);
  const std::string header = "OFF, or COFF or NOFF, in a text file";
  lines.next(header);
  // Normals, colours and texture coordinates stand behind the position, whatever letters the word begins with.
  const std::string_view kind = lines.word();
  if (!kind.ends_with("OFF") || kind.find_first_not_of("STCNOF") != std::string_view::npos) lines.fail(kind, header);
  if (lines.ended()) lines.next("the numbers of vertices and faces");
  const std::size_t most = text.size() / 2;  // a line has two bytes at least
  const std::size_t vertices = lines.whole(most, "the number of vertices, at most " + std::to_string(most));
  const std::size_t faces = lines.whole(most, "the number of faces, at most " + std::to_string(most));
  if (vertices == 0) lines.fail("0", "one vertex at least");
  npt::Mesh mesh;
  for (std::size_t v = 0; v < vertices; ++v) {
    lines.next("vertex " + std::to_string(v) + " of " + std::to_string(vertices));
    const float x = lines.number(), y = lines.number();
    mesh.positions.push_back({x, y, lines.number()});
  }
  for (std::size_t f = 0; f < faces; ++f) {
    lines.next("face " + std::to_string(f) + " of " + std::to_string(faces));
    const std::size_t corners = lines.whole(most, "the number of the face's corners");
    if (corners < 3) lines.fail(std::to_string(corners), "three corners at least");
    if (mesh.face_start.empty()) mesh.face_start.push_back(0);
    for (std::size_t c = 0; c < corners; ++c)
      mesh.corners.push_back(
          static_cast<std::uint32_t>(lines.whole(vertices - 1, "a vertex below " + std::to_string(vertices))));
    mesh.face_start.push_back(mesh.corners.size());
  }
  npt::validate(mesh, name);
  return mesh;
}

}  // namespace formats
