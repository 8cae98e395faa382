#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/body/kind_words.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/estimate/warning_code.hpp>
#include <npt/transfer/warning.hpp>

#include <string>

using npt::MeshRole;
using npt::Warning;
using npt::WarningCode;

TEST_CASE("every warning names its mesh, and no text names an option of a program") {
  for (int code = 0; code <= static_cast<int>(WarningCode::part_of_mesh); ++code)
    for (const MeshRole role : {MeshRole::identity, MeshRole::pose}) {
      CAPTURE(code);
      const std::string text = npt::text_of({static_cast<WarningCode>(code), role, 0.5}, "a.ply", "b.ply");
      CHECK(text.starts_with(role == MeshRole::identity ? "a.ply" : "b.ply"));
      CHECK(text.size() > 20);
      CHECK(text.find("--") == std::string::npos);
    }
  CHECK(npt::text_of({WarningCode::unit_assumed, MeshRole::identity, 0.01}, "a.ply", "b.ply") ==
        "a.ply is taken to be in centimetres, by its size");
}

TEST_CASE("warnings have the words of the kind that they are of") {
  const auto says = [](WarningCode code, const npt::KindWords* kind) {
    return npt::text_of({.code = code, .mesh = MeshRole::pose, .value = 0.25, .kind = kind}, "a", "b");
  };
  const npt::KindWords &people = npt::people_plan().words(),
                       &ants = npt::kept_words({.one = "ant", .many = "ants", .upper_limb = "feeler"});
  CHECK(says(WarningCode::not_recognised, &people) == "b is not recognised as a person (confidence 25 %)");
  CHECK(says(WarningCode::not_recognised, nullptr) == "b is not recognised as a body (confidence 25 %)");
  CHECK(says(WarningCode::low_confidence, &ants) == "b is recognised as an ant with a low confidence of 25 %");
  CHECK(says(WarningCode::arms_uncertain, &people) == "b: an arm may be in the wrong place");
  CHECK(says(WarningCode::arms_uncertain, &ants) == "b: a feeler may be in the wrong place");
  CHECK(says(WarningCode::legs_uncertain, &people) == "b: a leg may be in the wrong place");
  CHECK(says(WarningCode::legs_uncertain, &ants) == "b: a limb may be in the wrong place");
  CHECK(says(WarningCode::unusual_proportions, &people) == "b has proportions that no person has");
  CHECK(says(WarningCode::part_of_mesh, &ants) == "b is an ant in some of its pieces; the others are left as they are");
}

TEST_CASE("every remedy but none says what to do") {
  CHECK(npt::text_of(npt::Remedy::none).empty());
  for (const npt::Remedy remedy :
       {npt::Remedy::look_at_result, npt::Remedy::choose_method, npt::Remedy::give_unit, npt::Remedy::give_weights}) {
    CHECK(npt::text_of(remedy).size() > 10);
    CHECK(npt::text_of(remedy).find("--") == std::string::npos);
  }
}

TEST_CASE("a list of warnings keeps what is added, up to its capacity") {
  npt::Warnings some, others;
  CHECK(some.empty());
  some.push_back({WarningCode::lying, MeshRole::pose});
  others.push_back({WarningCode::low_confidence, MeshRole::identity, 0.7});
  some.append(others);
  REQUIRE(some.size() == 2);
  CHECK(some[1] == Warning{WarningCode::low_confidence, MeshRole::identity, 0.7});
  CHECK(some.contains(WarningCode::lying));
  CHECK_FALSE(some.contains(WarningCode::no_surface));
  for (std::size_t i = 0; i < 2 * npt::Warnings::capacity; ++i) some.push_back({});
  CHECK(some.size() == npt::Warnings::capacity);
  some.clear();
  CHECK(some.empty());
}

TEST_CASE("fractions as percent") { CHECK(npt::percent_text(0.664) == "66 %"); }
