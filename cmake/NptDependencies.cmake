# What the headers need. xsimd's package of Debian 12 names -lxtl without finding it, hence xtl first.
find_package(xtl REQUIRED)
find_package(xtensor REQUIRED)
find_package(xsimd REQUIRED)
find_package(TBB REQUIRED)
find_package(tinyobjloader REQUIRED)
find_package(nlohmann_json REQUIRED)
