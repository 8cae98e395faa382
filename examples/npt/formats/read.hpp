/// Meshes and scenes of all formats that the program reads: the library's own, and through assimp, where this build has
/// it (assimp.cpp), FBX, Collada and STL; and OFF. Without it (assimp_missing.cpp) those are refused.
/// Errors    npt::Error that names the file
#pragma once

#include <npt/mesh/mesh.hpp>
#include <npt/scene/scene.hpp>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace formats {

/// Extensions, in lower case.
inline constexpr std::array<std::string_view, 9> all{".ply", ".obj", ".glb", ".gltf", ".vrm",
                                                     ".fbx", ".dae", ".stl", ".off"};
/// Those that have clips, in metres and with y up.
inline constexpr std::array<std::string_view, 5> scenes{".glb", ".gltf", ".vrm", ".fbx", ".dae"};
/// Those that are read through assimp.
inline constexpr std::array<std::string_view, 3> foreign{".fbx", ".dae", ".stl"};

/// In any case of letters.
bool is_scene(const std::filesystem::path& path);

/// `notes` gets a sentence for each thing that was repaired; nullptr: the program prints them.
npt::Mesh read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);
/// Of a format in `scenes` or `foreign`.
npt::Scene read_scene(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr);

/// Whether this build has assimp.
bool reads_foreign();
/// A file in one of the formats in `foreign`. `lost` gets what of it isn't in the scene, and so not in a GLB that is
/// written of it either: a noun phrase for each kind of thing. `notes` gets a line for each thing that was mended.
npt::Scene read_foreign(const std::filesystem::path& path, std::vector<std::string>* lost = nullptr,
                        std::vector<std::string>* notes = nullptr);
/// Reads such a file in a process of its own first, where the system can split one: assimp ends the process on some
/// broken files. It takes as long as reading: 20 ms for a character of 0.5 MB.
/// Errors    npt::Error where that process crashes, or takes a minute or 4 GB
void try_foreign(const std::filesystem::path& path);
npt::Mesh read_off(const std::filesystem::path& path);

}  // namespace formats
