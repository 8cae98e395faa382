/// Changes of a text that leave the rest of it as it is, to the byte.
#pragma once

#include <npt/config.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI::internal {

/// Invariants  ranges don't overlap; insertions at one place stand in the order in which they came
class TextEdits {
 public:
  void replace(std::size_t begin, std::size_t end, std::string text) {
    edits_.push_back({begin, end, std::move(text)});
  }
  void insert(std::size_t at, std::string text) { replace(at, at, std::move(text)); }

  std::string applied(std::string_view text) const {
    std::vector<const Edit*> order;
    std::size_t size = text.size();
    for (const Edit& edit : edits_) order.push_back(&edit), size += edit.text.size();
    std::stable_sort(order.begin(), order.end(), [](const Edit* a, const Edit* b) { return a->begin < b->begin; });
    std::string out;
    out.reserve(size);
    std::size_t at = 0;
    for (const Edit* edit : order) {
      out += text.substr(at, edit->begin - at);
      out += edit->text;
      at = edit->end;
    }
    return out += text.substr(at);
  }

 private:
  struct Edit {
    std::size_t begin, end;
    std::string text;
  };
  std::vector<Edit> edits_;
};

}  // namespace npt::inline NPT_ABI::internal
