// expect: the channels differ
static_assert(false, "something else");
