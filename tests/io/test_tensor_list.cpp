#include <doctest/doctest.h>

#include <npt/io/safetensors.hpp>
#include <npt/io/tensor_list.hpp>
#include <npt/io/tensor_values.hpp>

#include <cstdint>
#include <limits>
#include <vector>

#include "io/scratch.hpp"

TEST_CASE("tensors and texts come back from the file, whatever became of what was added") {
  const scratch::Folder folder;
  npt::TensorList list;
  {
    std::vector<float> floats{1, 0.1F, std::numeric_limits<float>::denorm_min(), -3, 4, 5};
    std::vector<double> doubles{1.0 / 3};
    const std::vector<std::int64_t> signs{-1, 2};
    const std::vector<std::uint32_t> counts{4000000000U};
    list.add("floats", std::span<const float>(floats), {2, 3});
    list.add("doubles", doubles);
    list.add("signs", signs);
    list.add("counts", counts);
    list.add("none", std::vector<float>());
    list.add_text("format", "test");
    floats.assign(6, 0.0F), doubles.clear();
  }
  list.write(folder / "list.safetensors");
  const auto file = npt::SafetensorsFile::read(folder / "list.safetensors");
  REQUIRE(file.tensors().size() == 5);
  CHECK(file.at("floats").shape == npt::TensorShape{2, 3});
  CHECK(npt::to_values<float>(file.at("floats"), npt::NonFinite::refuse) ==
        std::vector<float>{1, 0.1F, std::numeric_limits<float>::denorm_min(), -3, 4, 5});
  CHECK(npt::to_values<double>(file.at("doubles"), npt::NonFinite::refuse) == std::vector<double>{1.0 / 3});
  CHECK(npt::to_values<std::int64_t>(file.at("signs"), npt::NonFinite::refuse) == std::vector<std::int64_t>{-1, 2});
  CHECK(npt::to_values<std::int64_t>(file.at("counts"), npt::NonFinite::refuse) ==
        std::vector<std::int64_t>{4000000000});
  CHECK(npt::to_values<float>(file.at("none"), npt::NonFinite::refuse).empty());
  REQUIRE(file.find_metadata("format") != nullptr);
  CHECK(*file.find_metadata("format") == "test");
  CHECK_THROWS_AS(list.write(folder / "nowhere/list.safetensors"), npt::Error);
}
