/// Any bytes to the safetensors reader give tensors that can be converted, or an npt::Error.
#include <npt/io/safetensors.hpp>

#include <fuzz/seeds.hpp>

namespace {

std::string file_of(const std::string& header, const std::string& data) {
  const std::uint64_t size = header.size();
  return std::string(reinterpret_cast<const char*>(&size), 8) + header + data;
}

std::vector<std::string> seeds() {
  std::string all = R"({"__metadata__":{"k":"v"})";
  std::size_t begin = 0;
  for (const auto& info : npt::internal::dtypes) {
    all += std::string(",\"t") + info.name + R"(":{"dtype":")" + info.name + R"(","shape":[2,1],"data_offsets":[)" +
           std::to_string(begin) + "," + std::to_string(begin + 2 * info.size) + "]}";
    begin += 2 * info.size;
  }
  return {file_of("{}", ""), file_of(all + "}", std::string(begin, '\1')),
          file_of(R"({"a":{"dtype":"F32","shape":[],"data_offsets":[0,4]}}  )", "abcd")};
}

template <class Convert>
void try_to(Convert convert, const npt::FileTensor& tensor) {
  try {
    fuzz::expect(convert(tensor).size() == tensor.count(), "a value for each element");
  } catch (const npt::Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fuzz::write_seeds_if_asked(*argc, *argv, seeds());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    const npt::SafetensorsFile file = npt::SafetensorsFile::parse({reinterpret_cast<const char*>(data), size}, "input");
    for (const npt::FileTensor& tensor : file.tensors()) {
      try_to([](const npt::FileTensor& t) { return npt::to_float(t); }, tensor);
      try_to([](const npt::FileTensor& t) { return npt::to_double(t, npt::NonFinite::keep); }, tensor);
      try_to([](const npt::FileTensor& t) { return npt::to_int64(t); }, tensor);
      fuzz::expect(file.find(tensor.name) == &tensor, "each tensor is found by its name");
    }
    fuzz::expect(!npt::internal::safetensors_header("copy", file.tensors(), file.metadata()).empty(),
                 "a header to write");
  } catch (const npt::Error&) {
  }
  return 0;
}
