/// What a command that transfers poses has to do: a list of identity, pose and output, from the arguments, a folder or
/// a file of pairs.
#pragma once

#include "arguments.hpp"

#include <formats/read.hpp>

#include <npt/base/error.hpp>
#include <npt/io/list_file.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace program {

inline constexpr auto& mesh_extensions = formats::all;
/// Those that are written.
inline constexpr std::array<std::string_view, 3> output_extensions{".ply", ".obj", ".glb"};

struct TransferJob {
  std::filesystem::path identity, pose, out;
  std::string place;       ///< "pairs.txt: line 3", or empty: stands before messages about the job
  std::size_t series = 0;  ///< of poses in a folder: jobs of one number are the frames of one sequence
};

/// Lines of `identity pose output`; names are relative to the list.
/// Errors    npt::Error that names the file and the line
inline std::vector<TransferJob> read_pairs(const std::filesystem::path& file) {
  std::vector<TransferJob> jobs;
  for (const npt::ListedFiles& line : npt::read_list_file(file, "identity pose output"))
    jobs.push_back({line.files[0], line.files[1], line.files[2], file.string() + ": " + line.place, jobs.size()});
  return jobs;
}

/// The meshes in a folder, in the order of their names.
/// Errors    npt::Error for a folder without meshes
inline std::vector<std::filesystem::path> meshes_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string own = extension_of(entry.path());
    if (entry.is_regular_file() && std::ranges::find(mesh_extensions, own) != mesh_extensions.end())
      files.push_back(entry.path());
  }
  if (files.empty()) throw npt::Error({folder.string(), {}, "a folder without meshes", ".ply, .obj or .glb files"});
  std::ranges::sort(files);
  return files;
}

/// One job for each mesh in the folder `poses`, in the order of their names; the result is called as the pose, with
/// `extension`.
inline std::vector<TransferJob> folder_jobs(const std::filesystem::path& identity, const std::filesystem::path& poses,
                                            const std::filesystem::path& out, const std::string& extension) {
  std::vector<TransferJob> jobs;
  for (const std::filesystem::path& pose : meshes_in(poses))
    jobs.push_back({identity, pose, out / pose.filename().replace_extension(extension), {}, 0});
  return jobs;
}

/// Of results in a folder: `format`, or as the identity.
inline std::string result_extension(const std::filesystem::path& identity, const std::optional<std::string>& format) {
  const std::string extension = format ? "." + *format : extension_of(identity);
  if (std::ranges::find(output_extensions, extension) != output_extensions.end()) return extension;
  return formats::is_scene(identity) ? ".glb" : ".ply";
}

/// A job for the pose mesh, or one for each of the folder `pose`, which makes the folder `out`. `format`: of the
/// results in a folder; without: as the identity.
inline std::vector<TransferJob> pose_jobs(const std::filesystem::path& identity, const std::filesystem::path& pose,
                                          const std::filesystem::path& out, const std::optional<std::string>& format,
                                          std::optional<OutputFolder>& folder) {
  if (!std::filesystem::is_directory(pose)) {
    if (format) throw npt::Error({"--format", {}, "one output file", "a folder of poses"});
    return {{identity, pose, out, {}, 0}};
  }
  expect_folder_name(out, "a folder for the results");
  folder.emplace(out);
  return folder_jobs(identity, pose, out, result_extension(identity, format));
}

/// Jobs for every mesh of the folder `identities`: OUT/IDENTITY.ext for one pose, OUT/IDENTITY/POSE.ext for a folder of
/// them, where each identity is a series. `folder` is OUT, `folders` are those in it.
inline std::vector<TransferJob> identity_jobs(const std::filesystem::path& identities,
                                              const std::filesystem::path& pose, const std::filesystem::path& out,
                                              const std::optional<std::string>& format,
                                              std::optional<OutputFolder>& folder,
                                              std::vector<std::unique_ptr<OutputFolder>>& folders) {
  std::vector<TransferJob> jobs;
  expect_folder_name(out, "a folder for the results");
  folder.emplace(out);
  const bool many = std::filesystem::is_directory(pose);
  std::size_t series = 0;
  for (const std::filesystem::path& identity : meshes_in(identities)) {
    const std::string extension = result_extension(identity, format);
    if (many) {
      folders.push_back(std::make_unique<OutputFolder>(out / identity.stem()));
      for (TransferJob& job : folder_jobs(identity, pose, out / identity.stem(), extension)) {
        job.series = series;
        jobs.push_back(std::move(job));
      }
    } else {
      jobs.push_back({identity, pose, out / identity.filename().replace_extension(extension), {}, series});
    }
    ++series;
  }
  return jobs;
}

/// Throws npt::Error unless the job's inputs are there and its output can be written.
inline void check_job(const TransferJob& job) {
  for (const auto& input : {job.identity, job.pose}) {
    expect_extension(input, mesh_extensions);
    std::error_code code;
    if (!std::filesystem::is_regular_file(input, code))
      throw npt::Error({input.string(),
                        {},
                        std::filesystem::exists(input, code) ? "no file but a folder or device" : "no such file",
                        "a mesh"});
  }
  expect_extension(job.out, output_extensions);
  check_output(job.out, std::array{job.identity, job.pose});
}

/// Two jobs that write one file, or a job that writes what another one reads, would make the result depend on the
/// order. Errors    npt::Error that names the second job
inline void check_outputs_apart(const std::vector<TransferJob>& jobs) {
  std::map<std::filesystem::path, const TransferJob*> outputs;
  for (const TransferJob& job : jobs)
    if (!outputs.emplace(resolved(job.out), &job).second)
      throw npt::Error({job.out.string(), job.place, "the output of two pairs", "an output for each"});
  for (const TransferJob& job : jobs)
    for (const auto& input : {job.identity, job.pose})
      if (const auto found = outputs.find(resolved(input)); found != outputs.end())
        throw npt::Error({found->second->out.string(), found->second->place, "an output that is also an input",
                          "another name for the output"});
}

}  // namespace program
