#include "reproduce/figures.hpp"

#include "reproduce/child.hpp"
#include "reproduce/systems.hpp"

#include <npt/base/error.hpp>
#include <npt/io/file.hpp>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <initializer_list>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

namespace reproduce {

namespace fs = std::filesystem;

namespace {

constexpr const char* identity_colour = "blue";
constexpr const char* pose_colour = "sand";
constexpr const char* truth_colour = "green";

/// Over the columns of figures; shorter than in tables.
std::string caption_of(const std::string& system) {
  static const std::vector<std::pair<std::string_view, std::string_view>> captions{
      {"deformation-5", "deformation\ntransfer (5)"},
      {"deformation-13", "deformation\ntransfer (13)"},
      {"skeleton", "skeleton-\ndriven"},
      {"full", "ours"},
      {"without-edge", "w/o edge\nregularisation"},
      {"without-spadain", "w/o\nSPAdaIN"},
      {"concat1", "concat1"},
      {"compact", "max\npooling"},
      {"quadruped", "ours"}};
  const auto found = std::ranges::find(captions, system, &std::pair<std::string_view, std::string_view>::first);
  return found == captions.end() ? system : std::string(found->second);
}

/// A file's name as a caption: "f_heavy_tpose-1a2b3c4d" to "f heavy tpose".
std::string caption_of(const MeshFile& mesh) {
  std::string text = mesh.name.substr(0, mesh.name.rfind('-'));
  std::ranges::replace(text, '_', ' ');
  return text;
}

std::string numbered(std::string what, std::size_t i) { return what.append(" ").append(std::to_string(i)); }

/// Rows of pairs: identity, pose, the systems' results, truth. Errors stand in a last column for one system, or below
/// each row for all.
enum class Errors { last_column, row_below };

Plate comparison(MeshStore& store, PairSet set, std::initializer_list<std::size_t> pairs,
                 std::span<const std::string> systems, Errors errors) {
  Plate plate;
  plate.columns = {"identity", "pose"};
  for (const std::string& system : systems) plate.columns.push_back(caption_of(system));
  plate.columns.push_back("truth");
  if (errors == Errors::last_column) plate.columns.push_back("error of\n" + caption_of(systems.back()));
  for (const std::size_t i : pairs) {
    const MeshFile identity = store.identity(set, i), pose = store.pose(set, i), truth = store.truth(set, i);
    std::vector<GridPanel> below{{}, {}};
    plate.rows.push_back(numbered("pair", i));
    plate.panels.push_back({identity.path, identity_colour});
    plate.panels.push_back({pose.path, pose_colour});
    for (const std::string& system : systems) {
      const MeshFile result = store.result(system, identity, pose);
      plate.panels.push_back({result.path, identity_colour});
      below.push_back({result.path, identity_colour, truth.path});
    }
    plate.panels.push_back({truth.path, truth_colour});
    if (errors == Errors::last_column) {
      plate.panels.push_back(below.back());
      continue;
    }
    below.emplace_back();
    plate.rows.emplace_back("error");
    plate.panels.insert(plate.panels.end(), below.begin(), below.end());
  }
  return plate;
}

/// Pairs in several vertex orders.
Plate orders(MeshStore& store, PairSet set, std::initializer_list<std::size_t> pairs, std::uint64_t count) {
  Plate plate;
  plate.index_colours = true;
  plate.columns = {"pose", "identity", "ours"};
  for (const std::size_t i : pairs)
    for (std::uint64_t order = 0; order < count; ++order) {
      // Two orders that have nothing to do with each other.
      const MeshFile identity = store.in_order(store.identity(set, i), order == 0 ? 0 : 2 * order);
      const MeshFile pose = store.in_order(store.pose(set, i), order == 0 ? 0 : 2 * order + 1);
      std::string caption = numbered("pair", i);
      caption += order == 0 ? ",\nthe body's order" : ",\nshuffled";
      if (order > 0 && count > 2) caption = numbered(caption, order);
      plate.rows.push_back(std::move(caption));
      plate.panels.push_back({pose.path});
      plate.panels.push_back({identity.path});
      plate.panels.push_back({store.result("full", identity, pose).path});
    }
  return plate;
}

/// Every identity in every pose.
Plate matrix(MeshStore& store, std::span<const std::pair<MeshFile, std::string>> identities,
             std::span<const std::pair<MeshFile, std::string>> poses) {
  Plate plate;
  plate.columns = {"identity"};
  plate.rows = {"pose"};
  plate.panels.emplace_back();
  for (const auto& [pose, caption] : poses) {
    plate.columns.push_back(caption);
    plate.panels.push_back({pose.path, pose_colour});
  }
  for (const auto& [identity, caption] : identities) {
    plate.rows.push_back(caption);
    plate.panels.push_back({identity.path, identity_colour});
    for (const auto& [pose, ignored] : poses)
      plate.panels.push_back({store.result("full", identity, pose).path, identity_colour});
  }
  return plate;
}

using Captioned = std::vector<std::pair<MeshFile, std::string>>;

Captioned foreign(std::span<const MeshFile> meshes, std::size_t most) {
  Captioned list;
  for (const MeshFile& mesh : meshes.first(std::min(most, meshes.size()))) list.emplace_back(mesh, caption_of(mesh));
  return list;
}
Captioned protocol_poses(MeshStore& store, std::initializer_list<std::size_t> pairs) {
  Captioned list;
  for (const std::size_t i : pairs)
    list.emplace_back(store.pose(PairSet::unseen, i), numbered("pose", list.size() + 1));
  return list;
}
Captioned protocol_identities(MeshStore& store, std::initializer_list<std::size_t> pairs) {
  Captioned list;
  for (const std::size_t i : pairs)
    list.emplace_back(store.identity(PairSet::unseen, i), numbered("identity", list.size() + 1));
  return list;
}

constexpr double noise_levels[] = {0, 0.005, 0.01, 0.02};

std::string noise_caption(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "noise %g %%", 100 * share);
  return share == 0 ? "no noise" : text;
}

/// Figure 12.
Plate noise_rows(MeshStore& store, PairSet set, std::size_t i) {
  Plate plate;
  plate.columns = {"identity",      "pose", caption_of("deformation-13"), "ours", "error of\ndef. transfer",
                   "error of\nours"};
  const MeshFile identity = store.identity(set, i), truth = store.truth(set, i);
  for (const double share : noise_levels) {
    const MeshFile pose = store.with_noise(store.pose(set, i), share);
    const MeshFile classic = store.result("deformation-13", identity, pose),
                   ours = store.result("full", identity, pose);
    plate.rows.push_back(noise_caption(share));
    plate.panels.push_back({identity.path, identity_colour});
    plate.panels.push_back({pose.path, pose_colour});
    plate.panels.push_back({classic.path, identity_colour});
    plate.panels.push_back({ours.path, identity_colour});
    plate.panels.push_back({classic.path, identity_colour, truth.path});
    plate.panels.push_back({ours.path, identity_colour, truth.path});
  }
  return plate;
}

/// Figure 16: one pose in meshes of several shapes, and with noise.
Plate pose_variants(MeshStore& store, PairSet set, std::size_t i) {
  const MeshFile identity = store.identity(set, i), truth = store.truth(set, i);
  Plate plate;
  plate.columns = {"identity /\ntruth"};
  const auto add_rows = [&](const char* caption, const std::vector<MeshFile>& poses) {
    plate.rows.insert(plate.rows.end(), {caption, "ours"});
    plate.panels.push_back({identity.path, identity_colour});
    for (const MeshFile& pose : poses) plate.panels.push_back({pose.path, pose_colour});
    plate.panels.push_back({truth.path, truth_colour});
    for (const MeshFile& pose : poses)
      plate.panels.push_back({store.result("full", identity, pose).path, identity_colour});
  };
  std::vector<MeshFile> shapes, noisy;
  for (std::size_t k = 0; k < std::size(noise_levels); ++k) {
    shapes.push_back(store.pose_of_shape(set, i, 3 * k));
    noisy.push_back(store.with_noise(store.pose(set, i), noise_levels[k]));
    plate.columns.push_back(numbered("shape", k + 1) + " /\n" + noise_caption(noise_levels[k]));
  }
  add_rows("pose in\nother shapes", shapes);
  add_rows("pose\nwith noise", noisy);
  return plate;
}

/// Figure 14.
Plate animals(MeshStore& store) {
  Plate plate;
  plate.columns = {"identity", "pose", "ours", "by body\nestimation", "truth"};
  for (const MeshStore::FamilyFiles& files : store.family_pairs(4)) {
    std::string name = files.name;
    if (const std::size_t as = name.find(" as "); as != std::string::npos) name.replace(as, 4, "\nas ");
    plate.rows.push_back(std::move(name));
    plate.panels.push_back({files.identity.path, identity_colour});
    plate.panels.push_back({files.pose.path, pose_colour});
    for (const char* system : {"quadruped", "bodies"})
      plate.panels.push_back({store.result(system, files.identity, files.pose).path, identity_colour});
    plate.panels.push_back({files.truth.path, truth_colour});
  }
  return plate;
}

/// A list for an option of `npt render`.
std::string joined(const std::vector<std::string>& texts) {
  std::string list;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (i > 0) list += ',';
    for (const char c : texts[i]) {
      if (c == ',' || c == '\\') list += '\\';
      list += c == '\n' ? "\\n" : std::string(1, c);
    }
  }
  return list;
}

fs::path picture_of(int number, const fs::path& folder) {
  char name[32];
  std::snprintf(name, sizeof name, "figure_%02d.png", number);
  return folder / name;
}

}  // namespace

const std::vector<Figure>& figures() {
  static const std::vector<Figure> list{
      {6, "seen poses", {"deformation-5", "deformation-13", "full"}},
      {7, "unseen poses", {"deformation-5", "deformation-13", "full"}},
      {8, "two vertex orders", {"full"}},
      {9, "ablations", {"concat1", "without-spadain", "without-edge", "full"}},
      {10, "identities that the body model did not make", {"full"}},
      {11, "poses of meshes that the body model did not make", {"full"}},
      {12, "noise on the pose mesh", {"deformation-13", "full"}},
      {13, "baselines", {"deformation-5", "deformation-13", "skeleton", "compact", "full"}},
      {14, "animals", {"quadruped"}},
      {15, "four vertex orders", {"full"}},
      {16, "one pose in other shapes and with noise", {"full"}},
      {17, "more identities that the body model did not make", {"full"}},
      {18, "identities and poses that the body model did not make", {"full"}},
      {19, "more seen poses", {"full"}},
      {20, "more unseen poses", {"full"}}};
  return list;
}

const Figure& figure_of(int number) {
  const auto found = std::ranges::find(figures(), number, &Figure::number);
  if (found == figures().end())
    throw npt::Error({.file = "--figure", .found = std::to_string(number), .expected = "6 to 20"});
  return *found;
}

std::vector<int> parse_numbers(const std::vector<std::string>& texts, const std::string& argument) {
  std::vector<int> numbers;
  for (const std::string& text : texts) {
    const auto number_in = [&](std::string_view word) {
      int value = 0;
      const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
      if (result.ec != std::errc() || result.ptr != word.data() + word.size() || value < 0 || value > 1000)
        throw npt::Error(
            {.file = argument, .found = "'" + text + "'", .expected = "numbers and ranges, such as 6..9,12"});
      return value;
    };
    const std::size_t dots = text.find("..");
    const int first = number_in(std::string_view(text).substr(0, dots));
    const int last = dots == std::string::npos ? first : number_in(std::string_view(text).substr(dots + 2));
    if (last < first) (void)number_in("");
    for (int n = first; n <= last; ++n)
      if (std::ranges::find(numbers, n) == numbers.end()) numbers.push_back(n);
  }
  return numbers;
}

Plate plate_of(int number, MeshStore& store) {
  const Figure& figure = figure_of(number);
  const auto compare = [&](PairSet set, std::initializer_list<std::size_t> pairs, Errors errors) {
    return comparison(store, set, pairs, figure.systems, errors);
  };
  switch (number) {
    case 6:
      return compare(PairSet::seen, {0, 18, 36, 54}, Errors::last_column);
    case 7:
      return compare(PairSet::unseen, {0, 18, 36, 54}, Errors::last_column);
    case 8:
      return orders(store, PairSet::unseen, {0, 36}, 2);
    case 9:
      return compare(PairSet::unseen, {9, 27, 45}, Errors::row_below);
    case 10:
      return matrix(store, foreign(store.foreign_identities(), 3), protocol_poses(store, {3, 21, 39}));
    case 11:
      return matrix(store, protocol_identities(store, {3, 21, 39}), foreign(store.foreign_poses(), 4));
    case 12:
      return noise_rows(store, PairSet::unseen, 18);
    case 13:
      return compare(PairSet::unseen, {12, 30, 48}, Errors::row_below);
    case 14:
      return animals(store);
    case 15:
      return orders(store, PairSet::seen, {18}, 4);
    case 16:
      return pose_variants(store, PairSet::unseen, 45);
    case 17:
      return matrix(store, foreign(store.foreign_identities(), 8), protocol_poses(store, {6, 24, 42, 60}));
    case 18:
      return matrix(store, foreign(store.foreign_identities(), 5), foreign(store.foreign_poses(), 4));
    case 19:
      return compare(PairSet::seen, {4, 16, 28, 40, 52, 64}, Errors::last_column);
    default:
      return compare(PairSet::unseen, {4, 16, 28, 40, 52, 64}, Errors::last_column);
  }
}

std::vector<std::string> render_arguments(const Plate& plate, const fs::path& out, int panel_height) {
  std::vector<std::string> arguments{"render"}, colours, truths;
  bool errors = false;
  for (const GridPanel& panel : plate.panels) {
    arguments.push_back(panel.mesh.empty() ? "-" : panel.mesh.string());
    colours.push_back(panel.mesh.empty() ? "-" : panel.colour);
    truths.push_back(panel.truth.empty() ? "-" : panel.truth.string());
    errors = errors || !panel.truth.empty();
  }
  arguments.insert(arguments.end(), {"--out", out.string(), "--grid", std::to_string(plate.columns.size()), "--height",
                                     std::to_string(panel_height), "--column-captions", joined(plate.columns),
                                     "--row-captions", joined(plate.rows), "--colours", joined(colours)});
  if (plate.index_colours) arguments.insert(arguments.end(), {"--colour", "index"});
  if (errors) arguments.insert(arguments.end(), {"--colour", "error", "--truth", joined(truths)});
  return arguments;
}

std::string left_out_because(int number, const FigureSources& sources) {
  if (number == 14 && sources.family.empty())
    return "it needs a family of animals: --family FOLDER, and --weights quadruped=FILE unless they are to be trained";
  return {};
}

Outcome draw_figure(int number, MeshStore& store, const fs::path& folder, const RunCommand& run) try {
  store.forget_requests();
  if (!left_out_because(number, store.sources()).empty()) return Outcome::left_out;
  const fs::path picture = picture_of(number, fs::absolute(folder)),
                 command = fs::path(picture).replace_extension(".txt");
  const std::vector<std::string> arguments =
      render_arguments(plate_of(number, store), picture, store.sources().panel_height);
  const std::string line = command_line(arguments) + "\n";
  std::error_code code;
  if (fs::exists(picture, code) && fs::exists(command, code) && npt::read_file(command) == line) return Outcome::kept;
  store.make_results();
  fs::create_directories(folder);
  fs::remove(command);
  run(arguments);
  npt::write_file(command, line);
  return Outcome::drawn;
} catch (const npt::Error& error) {
  throw npt::Error({.file = numbered("figure", static_cast<std::size_t>(number)), .place = error.what()});
}

}  // namespace reproduce
