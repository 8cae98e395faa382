/// npt_accuracy: how far transfers are from the ground truth, on named sets of pairs, and whether that is within
/// bounds.txt. What `--help` prints says how to call it.
#include "bounds.hpp"
#include "sets.hpp"

#include <npt/base/default_executor.hpp>
#include <npt/base/error.hpp>
#include <npt/lab/evaluation.hpp>
#include <npt/mesh/mesh_view.hpp>
#include <npt/transfer/pose_transfer.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace {

using accuracy::Method, accuracy::Outcome, accuracy::Set;

constexpr const char* usage =
    R"(npt_accuracy: the errors of transfers on named sets of pairs, held against tests/accuracy/bounds.txt
usage: npt_accuracy [--part made|shared] [--only SET] [--quick] [--threads N] [--pairs] [--table] [--write-bounds]
  --part made|shared   only the sets that npt makes itself, or only those from ../shared/data
  --only SET           only this set
  --quick              one pair each of three sets, which must not be wrong; the default under sanitizers
  --threads N          pairs at a time (default: as many as the process may use)
  --pairs              also print each pair's error
  --table              print a table in Markdown instead, as the guides show it; nothing is checked
  --write-bounds       print what bounds.txt would say of today's errors instead; nothing is checked
Exit status: 0 within the bounds, 1 not, 2 for wrong arguments, 77 where ../shared/data is asked for and missing.
)";

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#elif defined(__has_feature)
constexpr bool sanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool sanitized = false;
#endif

constexpr int skipped = 77;

struct Options {
  std::string part, only;
  bool quick = sanitized, pairs = false, table = false, write_bounds = false;
  int threads = 0;
};

using Transfer = std::function<void(const npt::EvaluationPair&, std::span<float>)>;

/// The one place that names the library's entry point: weights and method, with default settings otherwise. Pairs run
/// side by side, each on one thread.
Transfer open_transfer(Method method) {
  if (method == Method::given)
    return
        [](const npt::EvaluationPair& pair, std::span<float> result) { std::ranges::copy(pair.pose, result.begin()); };
  npt::TransferOptions options;
  if (method == Method::network || method == Method::quadrupeds) options.method = npt::Method::network;
  const auto transfer =
      std::make_shared<const npt::PoseTransfer>(npt::PoseTransfer::open(accuracy::weights_file(method), options, 1));
  return [transfer](const npt::EvaluationPair& pair, std::span<float> result) {
    (*transfer)(npt::MeshView{pair.identity, pair.identity_triangles, "identity"},
                npt::MeshView{pair.pose, pair.pose_triangles, "pose"}, result);
  };
}

/// Errors of a set's pairs, named by their numbers, too; NaN where one is refused.
Outcome measure(const Set& set, const Transfer& transfer, const npt::DefaultExecutor& executor,
                const std::set<std::string>& wrong, std::size_t most) {
  const auto begin = std::chrono::steady_clock::now();
  npt::EvaluationSet pairs = set.make();
  pairs.count = std::min(pairs.count, most);
  Outcome outcome{.key = set.key, .title = set.title, .all = {}, .right = {}, .by_length = set.by_length};
  if (set.by_length)
    outcome.untouched = npt::evaluate(
        pairs,
        [](const npt::EvaluationPair& pair, std::span<float> result) {
          std::ranges::copy(pair.identity, result.begin());
        },
        executor);
  outcome.all = npt::evaluate(
      pairs,
      [&transfer](const npt::EvaluationPair& pair, std::span<float> result) {
        try {
          transfer(pair, result);
        } catch (const npt::Error&) {
          std::ranges::fill(result, std::numeric_limits<float>::quiet_NaN());
        }
      },
      executor);
  for (std::size_t i = 0; i < pairs.count; ++i) {
    npt::PairErrors& pair = outcome.all.pairs[i];
    if (!pair.name.starts_with("pair ")) pair.name = "pair " + std::to_string(i) + ", " + pair.name;
    if (!outcome.is_wrong(pair) && !wrong.contains(outcome.listed_name(pair))) outcome.right.pairs.push_back(pair);
  }
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return outcome;
}

/// The head of a set's table, where it is another one than the last row's. Rows of animals by length have a table of
/// their own, of PMD x 1e-4 in squares of the longest side: median, mean, and the median of the identity as it is.
void print_head(const Set& set, const Set* before) {
  if (before != nullptr && before->by_length == set.by_length) return;
  if (before != nullptr) std::puts("");
  std::puts(set.by_length ? "| set | pairs | refused | median | mean | left as it is |\n|---|---|---|---|---|---|"
                          : "| set | pairs | wrong | mean, mm | median, mm | worst, mm | PMD x 1e-4 |\n"
                            "|---|---|---|---|---|---|---|");
}

/// A row of the table.
void print_row(const Outcome& outcome) {
  const npt::Evaluation& right = outcome.right;
  if (outcome.by_length) {
    std::printf("| %s | %zu | %zu | %.1f | %.1f | %.1f |\n", outcome.title.c_str(), outcome.all.pairs.size(),
                outcome.all.pairs.size() - right.pairs.size(), 1e4 * right.median_pmd(), 1e4 * right.pmd(),
                1e4 * outcome.untouched.median_pmd());
    return;
  }
  std::printf("| %s | %zu | %zu | %.1f | %.1f | %.1f | %.2f |\n", outcome.title.c_str(), outcome.all.pairs.size(),
              outcome.all.pairs.size() - right.pairs.size(), right.mean_mm(), right.median_mm(),
              npt::root_pmd_mm(right.worst_pmd()), 1e4 * right.pmd());
}

void print_pairs(const Outcome& outcome) {
  for (const npt::PairErrors& pair : outcome.all.pairs)
    std::printf("  %8.2f mm%s  %s\n", pair.root_mm(), outcome.is_wrong(pair) ? "  wrong" : "",
                outcome.listed_name(pair).c_str());
}

/// Prints what a set gives and whether it holds its bounds; the number of complaints.
std::size_t check(const Outcome& outcome, const std::map<std::string, accuracy::Bounds>& bounds,
                  const std::set<std::string>& wrong) {
  std::vector<std::string> complaints = complaints_of(outcome, bounds, wrong);
  for (const std::string& entry : stale_entries(outcome, wrong, false))
    complaints.push_back(entry + ": stands in wrong.txt, but there is no such pair");
  std::printf("%-14s %2zu pairs, mean %5.2f mm, median %5.2f mm, %zu wrong, %.1f s\n", outcome.key.c_str(),
              outcome.all.pairs.size(), outcome.right.mean_mm(), outcome.right.median_mm(),
              outcome.all.pairs.size() - outcome.right.pairs.size(), outcome.seconds);
  for (const std::string& entry : stale_entries(outcome, wrong, true))
    std::printf("  right now, to be taken out of wrong.txt: %s\n", entry.c_str());
  for (const std::string& complaint : complaints) std::printf("  FAILED %s\n", complaint.c_str());
  return complaints.size();
}

/// One pair of a set, which must not be wrong; the number of complaints.
std::size_t check_quickly(const Outcome& outcome) {
  print_pairs(outcome);
  return outcome.all.pairs.size() - outcome.right.pairs.size();
}

std::vector<Set> chosen_sets(const Options& o, bool shared) {
  std::vector<Set> sets = accuracy::made_sets();
  if (o.part == "shared") sets.clear();
  if (o.part != "made" && shared)
    for (Set& set : accuracy::shared_sets()) sets.push_back(std::move(set));
  std::erase_if(sets, [&](const Set& set) {
    if (o.quick) return set.key != "natural" && set.key != "clothes" && set.key != "network";
    return !o.only.empty() && set.key != o.only;
  });
  std::stable_partition(sets.begin(), sets.end(), [](const Set& set) { return !set.by_length; });
  return sets;
}

int run(const Options& o) {
  const bool shared = std::filesystem::is_directory(accuracy::shared_data(""));
  if (o.part == "shared" && (!shared || o.quick)) {
    std::puts(shared ? "SKIPPED: the quick check has no pairs of ../shared/data" : "SKIPPED: needs ../shared/data");
    return skipped;
  }
  const std::vector<Set> sets = chosen_sets(o, shared);
  if (sets.empty()) throw std::invalid_argument("no such set");
  const std::string folder = std::string(NPT_SOURCE_DIR) + "/tests/accuracy/";
  const auto bounds = accuracy::read_bounds(folder + "bounds.txt");
  const auto wrong = accuracy::read_wrong(folder + "wrong.txt");
  const npt::DefaultExecutor executor(o.threads);
  std::map<Method, Transfer> transfers;
  std::size_t complaints = 0;
  for (const Set& set : sets) {
    Transfer& transfer = transfers[set.method];
    if (!transfer) transfer = open_transfer(set.method);
    constexpr auto all = std::numeric_limits<std::size_t>::max();
    const Outcome outcome = measure(set, transfer, executor, wrong, o.quick ? 1 : all);
    if (o.table) {
      print_head(set, &set == &sets.front() ? nullptr : &set - 1);
      print_row(outcome);
    } else if (o.write_bounds) {
      std::puts(line_of(outcome).c_str());
    } else {
      complaints += o.quick ? check_quickly(outcome) : check(outcome, bounds, wrong);
    }
    if (o.pairs) print_pairs(outcome);
    std::fflush(stdout);
  }
  if (complaints > 0) std::printf("%zu FAILED\n", complaints);
  return complaints == 0 ? 0 : 1;
}

Options parse(std::span<char*> arguments) {
  Options o;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string_view name = arguments[i];
    const auto value = [&] {
      if (++i == arguments.size()) throw std::invalid_argument(std::string(name) + " wants a value");
      return std::string(arguments[i]);
    };
    if (name == "--help" || name == "-h") {
      std::fputs(usage, stdout);
      std::exit(0);
    } else if (name == "--part") {
      o.part = value();
    } else if (name == "--only") {
      o.only = value();
    } else if (name == "--threads") {
      o.threads = std::stoi(value());
    } else if (name == "--quick") {
      o.quick = true;
    } else if (name == "--pairs") {
      o.pairs = true;
    } else if (name == "--table") {
      o.table = true;
    } else if (name == "--write-bounds") {
      o.write_bounds = true;
    } else {
      throw std::invalid_argument("unknown argument '" + std::string(name) + "'");
    }
  }
  if (!o.part.empty() && o.part != "made" && o.part != "shared")
    throw std::invalid_argument("--part is made or shared");
  return o;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(parse(std::span(argv, static_cast<std::size_t>(argc)).subspan(1)));
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "npt_accuracy: %s (see --help)\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "npt_accuracy: %s\n", error.what());
    return 1;
  }
}
