/// What a user should know of how a transfer was made, in words: a mesh that doesn't read as a person, or hardly.
#pragma once

#include <npt/base/error.hpp>
#include <npt/config.hpp>
#include <npt/transfer/body_interface.hpp>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace npt::inline NPT_ABI {

namespace internal {

inline std::string confidence_text(double confidence) { return std::to_string(std::lround(100 * confidence)) + " %"; }

}  // namespace internal

/// A sentence for each thing to know; none where all is well. `identity`, `pose`: what the meshes are called.
inline std::vector<std::string> method_notes(const TransferReport& report, const std::string& identity,
                                             const std::string& pose) {
  std::vector<std::string> notes;
  if (!report.read) return notes;
  const std::string& weaker = report.identity_confidence < report.pose_confidence ? identity : pose;
  if (report.method == Method::body) {
    for (const auto& [name, text] : {std::pair(identity, report.identity_notes), std::pair(pose, report.pose_notes)})
      if (!text.empty()) notes.push_back(name + ": " + text);
    if (report.confidence() < high_confidence)
      notes.push_back(weaker + " reads as a person with a confidence of only " +
                      internal::confidence_text(report.confidence()) + ": look at the result before using it");
    return notes;
  }
  notes.push_back(weaker + " doesn't read as a person (confidence " + internal::confidence_text(report.confidence()) +
                  ", asked " + internal::confidence_text(least_confidence) +
                  "): left to the pose transfer network, which was trained on people in few poses; "
                  "look at the result before using it");
  return notes;
}

/// The network's refusal of a pair that was read as bodies, with why the network was asked at all.
inline Error with_confidence(const Error& refusal, const TransferReport& report, const std::string& identity,
                             const std::string& pose) {
  if (!report.read || report.method != Method::network) return refusal;
  ErrorParts parts = refusal.parts();
  parts.expected += "; the network was asked since " +
                    (report.identity_confidence < report.pose_confidence ? identity : pose) +
                    " doesn't read as a person (confidence " + internal::confidence_text(report.confidence()) +
                    ", asked " + internal::confidence_text(least_confidence) + ")";
  return Error(parts);
}

}  // namespace npt::inline NPT_ABI
