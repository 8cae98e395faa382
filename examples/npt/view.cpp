/// npt view: meshes, sequences and GLB files as one page for a browser.
#include "arguments.hpp"
#include "subcommand.hpp"
#include "transfer_jobs.hpp"

#include <render/colour.hpp>
#include <view/page.hpp>

#include <formats/read.hpp>
#include <npt/base/error.hpp>
#include <npt/io/file.hpp>
#include <npt/io/gltf.hpp>
#include <npt/io/mesh_file.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace view_command {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> files;
  fs::path out;
  std::optional<std::string> captions, colours, truth, title;
  std::optional<double> scale_bar;
  std::string up = "y";
  double fps = 30;
  std::size_t every = 1;
};

constexpr std::string_view nothing = "-";

/// The files of a panel: a mesh, or every so many-th of a folder.
std::vector<fs::path> files_of(const fs::path& path, std::size_t every) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> taken;
  const std::vector<fs::path> all = program::meshes_in(path);
  for (std::size_t i = 0; i < all.size(); i += every) taken.push_back(all[i]);
  return taken;
}

std::vector<std::string> one_for_each(const std::string& argument, const std::string& text, std::size_t count) {
  std::vector<std::string> parts = program::split_list(text);
  if (parts.size() != count)
    throw npt::Error(
        {argument, {}, std::to_string(parts.size()) + " entries", std::to_string(count) + ", one for each panel"});
  return parts;
}

/// Extensions that no browser decodes by itself; of these the reader knows Draco's and meshopt's.
constexpr std::array<std::string_view, 4> undecoded{"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                                    "KHR_meshopt_compression", "KHR_texture_basisu"};

/// Whether a page can show the GLB file as it is: whole, without files beside it and without what needs a decoder.
/// Errors    npt::Error for a container that isn't one, and for textures that npt doesn't decode
bool is_plain(const std::string& bytes, const fs::path& file) {
  const auto fail = [&](const std::string& place, const std::string& found, const std::string& expected) {
    return npt::Error({file.string(), place, found, expected});
  };
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
    return value;
  };
  if (bytes.size() < 20 || !bytes.starts_with("glTF"))
    throw fail("byte 0", "no header of a GLB file", "glTF and 20 bytes at least");
  if (word(4) != 2) throw fail("byte 4", "version " + std::to_string(word(4)), "version 2");
  if (word(8) != bytes.size())
    throw fail("byte 8", "a length of " + std::to_string(word(8)), std::to_string(bytes.size()) + ", the file's");
  const std::size_t length = word(12);
  if (word(16) != 0x4E4F534A) throw fail("byte 16", "another chunk", "the JSON chunk");
  if (length > bytes.size() - 20)
    throw fail("byte 12", "a chunk of " + std::to_string(length) + " bytes",
               "at most " + std::to_string(bytes.size() - 20));
  const auto json = nlohmann::json::parse(bytes.begin() + 20, bytes.begin() + 20 + static_cast<std::ptrdiff_t>(length),
                                          nullptr, false);
  if (!json.is_object()) throw fail("JSON chunk", "no JSON object", "one");
  const auto list = [&](const char* name) {
    return json.contains(name) && json[name].is_array() ? json[name] : nlohmann::json::array();
  };
  bool plain = true;
  for (const auto& name : list("extensionsRequired")) {
    if (name == "KHR_texture_basisu")
      throw fail("extensionsRequired", "KHR_texture_basisu", "a file without it: the page has no decoder for it");
    plain = plain && !(name.is_string() && std::ranges::count(undecoded, name.get<std::string>()) != 0);
  }
  for (const char* array : {"buffers", "images"})
    for (const auto& entry : list(array))
      plain = plain && !(entry.is_object() && entry.contains("uri") && entry["uri"].is_string() &&
                         !entry["uri"].get<std::string>().starts_with("data:"));
  return plain;
}

/// A scene's file as the bytes of a GLB that a page can show by itself: as it is, or as npt reads and writes it.
/// Errors    npt::Error that names the file and what stands in the way
std::string glb_of(const fs::path& file) {
  if (program::extension_of(file) == ".glb") {
    std::string bytes = npt::read_file(file);
    if (is_plain(bytes, file)) return bytes;
  }
  const npt::Scene scene = formats::read_scene(file);
  if (scene.shown.empty()) throw npt::Error({file.string(), {}, "a scene that shows no mesh", "one at least"});
  return npt::glb_bytes(scene, file.string());
}

/// A panel of meshes: one, or a sequence.
view::Panel panel_of(const std::vector<fs::path>& files, const std::string& caption) {
  const npt::Mesh first = formats::read_mesh(files.front());
  view::Panel panel = view::mesh_panel(caption, first);
  for (std::size_t i = 1; i < files.size(); ++i)
    view::add_frame(panel, formats::read_mesh(files[i]), files[i].string());
  return panel;
}

/// The errors of a panel's frames. `truths`: a file for each, or one for all.
void compare(view::Panel& panel, const std::vector<fs::path>& files, const std::vector<fs::path>& truths,
             const std::string& truth) {
  if (truths.size() != 1 && truths.size() != files.size())
    throw npt::Error({truth,
                      {},
                      std::to_string(truths.size()) + " meshes",
                      std::to_string(files.size()) + ", one for each frame, or one"});
  const auto frames = std::exchange(panel.frames, {});
  npt::Mesh mesh;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (i == 0 || truths.size() > 1) mesh = formats::read_mesh(truths[i]);
    panel.frames.push_back(frames[i]);
    view::add_errors(panel, mesh, files[i].string(), (truths.size() > 1 ? truths[i] : truths[0]).string());
  }
}

void check(const Options& o) {
  static constexpr std::array<std::string_view, 2> page{".html", ".htm"};
  program::expect_extension(o.out, page);
  std::vector<fs::path> inputs;
  for (const std::string& file : o.files) {
    if (!fs::exists(file)) throw npt::Error({file, {}, "no such file", "a mesh, a folder of meshes or a GLB file"});
    if (!fs::is_directory(file)) program::expect_extension(file, formats::all);
    inputs.emplace_back(file);
  }
  program::check_output(o.out, inputs);
}

void run(const Options& o) {
  check(o);
  const std::size_t count = o.files.size();
  std::vector<std::string> captions, colours(count, std::string(nothing)), truths(count, std::string(nothing));
  for (const std::string& file : o.files) {
    const fs::path path = fs::path(file).filename().empty() ? fs::path(file).parent_path() : fs::path(file);
    captions.push_back(path.filename().string());
  }
  const std::string names = program::joined(captions, ", ");
  if (o.captions) captions = one_for_each("--captions", *o.captions, count);
  if (o.colours) colours = one_for_each("--colours", *o.colours, count);
  if (o.truth) {
    truths = program::split_list(*o.truth);
    if (truths.size() == 1) truths.assign(count, std::string(truths[0]));
    if (truths.size() != count)
      throw npt::Error({"--truth",
                        {},
                        std::to_string(truths.size()) + " entries",
                        "one for all, or " + std::to_string(count) + ", one for each panel"});
  }
  view::Page page;
  page.title = o.title.value_or(names);
  page.fps = o.fps / static_cast<double>(o.every);
  page.z_up = o.up == "z";
  page.error_scale = o.scale_bar.value_or(0);
  view::Group& group = page.groups.emplace_back();
  std::size_t frames = 1;
  bool compared = false;
  for (std::size_t i = 0; i < count; ++i) {
    view::Panel panel;
    if (formats::is_scene(o.files[i]) && !fs::is_directory(o.files[i])) {
      panel.caption = captions[i];
      panel.glb = glb_of(o.files[i]);
    } else {
      const std::vector<fs::path> files = files_of(o.files[i], o.every);
      panel = panel_of(files, captions[i]);
      frames = std::max(frames, files.size());
      if (truths[i] != nothing) {
        compare(panel, files, files_of(truths[i], o.every), truths[i]);
        compared = true;
      }
    }
    if (colours[i] != nothing) panel.colour = render::parse_colour(colours[i], "--colours");
    group.panels.push_back(std::move(panel));
  }
  if (o.truth && !compared) throw npt::Error({"--truth", {}, "no mesh with a truth", "one at least"});
  const std::size_t bytes = view::write_page(o.out, page);
  std::printf("%s: %zu panel%s, %zu frame%s, %.2f MB\n", o.out.string().c_str(), count, count == 1 ? "" : "s", frames,
              frames == 1 ? "" : "s", static_cast<double>(bytes) / 1e6);
}

void add(CLI::App& command) {
  auto o = std::make_shared<Options>();
  command
      .add_option("MESH", o->files,
                  "Show these, one panel each: meshes (.ply, .obj, ...), folders of meshes as sequences, .glb and .fbx "
                  "files with their clips")
      ->required();
  command.add_option("-o,--out", o->out, "Write the page to this file (.html)")->required();
  command
      .add_option("--captions", o->captions,
                  "Write these texts below the panels: \"identity,pose,result\" (\\, is a comma)")
      ->type_name("LIST");
  command
      .add_option("--colours", o->colours,
                  "Paint the meshes in these colours: \"blue,sand,#9db7d5\" (- keeps the default)")
      ->type_name("LIST");
  command.add_option("--title", o->title, "Give the page this title (default: the files' names)");
  CLI::Option* truth =
      command
          .add_option("--truth", o->truth,
                      "Colour the error against this ground truth, a mesh in metres or a folder with one for each "
                      "frame: one for all panels, or a list (- for none); bounding boxes are centred, as for the PMD")
          ->type_name("LIST");
  command
      .add_option("--scale-bar", o->scale_bar,
                  "End the scale of errors at this many millimetres (default: a round number that few vertices exceed)")
      ->check(CLI::Range(1e-6, 1e9))
      ->needs(truth);
  command.add_option("--fps", o->fps, "Play sequences at this many frames a second")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command.add_option("--every", o->every, "Show every Nth mesh of a folder only: 2 shows each second one")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command.add_option("--up", o->up, "Take this axis of the meshes as up")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  command.footer("The page needs no server and no network. In it, ? lists the keys.");
  command.callback([o] { run(*o); });
}

const program::Subcommand registered("view", "Write meshes, sequences and GLB files into a page for a browser", add);

}  // namespace view_command
