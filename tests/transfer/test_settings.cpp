#include <doctest/doctest.h>

#include <npt/base/error.hpp>
#include <npt/transfer/settings.hpp>

TEST_CASE("what is left open is filled in from the weights' file, or by default") {
  const npt::TransferOptions file =
      npt::complete_options({}, {{"normalisation", "sphere"}, {"refine_radius", "0.1"}}, "w.safetensors");
  CHECK(file.network.normalisation == npt::Normalisation::sphere);
  CHECK(file.refine_radius == 0.1);
  const npt::TransferOptions none = npt::complete_options({}, {}, "w.safetensors");
  CHECK(none.network.normalisation == npt::Normalisation::centre);
  CHECK(none.refine_radius == npt::default_refine_radius);
  const npt::TransferOptions told =
      npt::complete_options({.network = {.normalisation = npt::Normalisation::none}, .refine_radius = 0.2},
                            {{"normalisation", "sphere"}, {"refine_radius", "0.1"}}, "w.safetensors");
  CHECK(told.network.normalisation == npt::Normalisation::none);
  CHECK(told.refine_radius == 0.2);
  CHECK(npt::names_metres({{"unit", "metre"}}));
  CHECK_FALSE(npt::names_metres({{"unit", "the meshes' own"}}));
  CHECK_FALSE(npt::names_metres({}));
}

TEST_CASE("metadata that can't be is an error that names file and key") {
  CHECK_THROWS_WITH_AS(npt::complete_options({}, {{"refine_radius", "11"}}, "w.safetensors"),
                       "w.safetensors: metadata refine_radius: found '11', expected a number above 0, at most 10",
                       npt::Error);
  CHECK_THROWS_WITH_AS(npt::complete_options({}, {{"refine_radius", "wide"}}, "w.safetensors"),
                       "w.safetensors: metadata refine_radius: found 'wide', expected a finite number", npt::Error);
  CHECK_THROWS_WITH_AS(npt::complete_options({}, {{"normalisation", "cube"}}, "w.safetensors"),
                       "w.safetensors: metadata normalisation: found 'cube', expected sphere, centre or none",
                       npt::Error);
}

TEST_CASE("options that can't be are errors") {
  CHECK_THROWS_WITH_AS(npt::check_options({.network = {.pairings = 0}}, true), "pairings: found 0, expected at least 1",
                       npt::Error);
  CHECK_THROWS_WITH_AS(npt::check_options({.network = {.pairing = npt::Pairing::as_given, .pairings = 2}}, true),
                       "pairings: found 2 with vertices paired as given, expected 1: only random pairings differ",
                       npt::Error);
  CHECK_NOTHROW(npt::check_options({.network = {.pairing = npt::Pairing::as_given, .pairings = 2}}, false));
  CHECK_THROWS_AS(npt::check_options({.import = {.unit = -1.0}}, true), npt::Error);
  CHECK_THROWS_AS(npt::check_options({.import = {.unit = 1e9}}, true), npt::Error);
}
