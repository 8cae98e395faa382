/// Weights in safetensors files, under the names of the public state dict.
///
/// The variants of the network have tensors of identical names and shapes, so a wrong pairing would load silently and
/// give wrong meshes. The file's metadata therefore names the variant (order, feature, bottleneck, output_scale), and
/// loading checks it against the network. A file without these keys needs an explicit choice. Further keys that
/// programs read: normalisation (sphere, centre or none), domain, unit.
/// Numerics  float and double keep their bits; half precision is converted exactly
/// Errors    npt::Error naming the file and every missing, misshapen or unknown tensor at once, or the first number
///           that is not finite; the model is unchanged then
#pragma once

#include <npt/config.hpp>
#include <npt/io/safetensors_class.hpp>
#include <npt/nn/engine/model_class.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

using Metadata = std::map<std::string, std::string>;

/// The metadata that names a network's variant: what its static variant() says, or nothing.
template <class Net>
Metadata variant_metadata();

/// Fills a buffer that is laid out as Model::buffer(), for callers that know a network only by its variant's metadata
/// and its list of parameters. Returns the file's metadata; `assume` gives values for keys that the file lacks. The
/// buffer is unchanged after an error.
template <class T>
Metadata load_values(const SafetensorsFile& file, const Metadata& variant,
                     const std::vector<NamedParameter>& parameters, std::span<T> buffer, const Metadata& assume = {});

/// Writes the values of a buffer that is laid out as Model::buffer(), with the variant and whatever else `metadata`
/// says.
template <class T>
void save_values(const std::filesystem::path& path, const Metadata& variant,
                 const std::vector<NamedParameter>& parameters, std::span<const T> buffer, Metadata metadata = {});

/// Fills the model from a file and returns the file's metadata. `assume` gives values for keys that the file lacks;
/// where it has them, they must agree.
template <class Net, class T>
Metadata load(Model<Net, T>& model, const SafetensorsFile& file, const Metadata& assume = {}) {
  return load_values(file, variant_metadata<Net>(), model.parameters(), model.buffer(), assume);
}
/// Fills the model from the file at `path`.
template <class Net, class T>
Metadata load(Model<Net, T>& model, const std::filesystem::path& path, const Metadata& assume = {}) {
  return load(model, SafetensorsFile::read(path), assume);
}

/// Writes the model, with its variant and attributes and whatever else `metadata` says. The file appears only when
/// complete.
template <class Net, class T>
void save(const Model<Net, T>& model, const std::filesystem::path& path, Metadata metadata = {}) {
  save_values(path, variant_metadata<Net>(), model.parameters(), model.buffer(), std::move(metadata));
}

#ifdef NPT_COMPILED
extern template Metadata load_values(const SafetensorsFile&, const Metadata&, const std::vector<NamedParameter>&,
                                     std::span<float>, const Metadata&);
#endif

}  // namespace npt::inline NPT_ABI
