#include "mapping_core/ferns/place_index.h"

#include <algorithm>

namespace comap {
namespace {

constexpr size_t kCodes = 16;

double dissimilarityOf(size_t joint, size_t equal, size_t ferns) {
  if (joint * 10 < ferns || joint == 0) return 1;
  return static_cast<double>(joint - equal) / static_cast<double>(joint);
}

size_t jointlyValid(const FernCode& a, const FernCode& b) {
  size_t joint = 0;
  for (size_t i = 0; i < a.codes.size(); ++i) joint += a.codes[i] != FernCode::kBad && b.codes[i] != FernCode::kBad;
  return joint;
}

}  // namespace

double dissimilarity(const FernCode& a, const FernCode& b) {
  if (a.book_hash != b.book_hash || a.codes.size() != b.codes.size()) return 1;
  size_t equal = 0;
  for (size_t i = 0; i < a.codes.size(); ++i) equal += a.codes[i] != FernCode::kBad && a.codes[i] == b.codes[i];
  return dissimilarityOf(jointlyValid(a, b), equal, a.codes.size());
}

bool PlaceIndex::add(uint32_t place, const FernCode& code) {
  if (places_.empty()) {
    book_hash_ = code.book_hash;
    slots_.assign(code.codes.size(), std::vector<std::vector<uint32_t>>(kCodes));
  }
  if (code.book_hash != book_hash_ || code.codes.size() != slots_.size()) return false;
  const uint32_t slot = static_cast<uint32_t>(places_.size());
  places_.push_back(place);
  codes_.push_back(code);
  for (size_t fern = 0; fern < code.codes.size(); ++fern)
    if (code.codes[fern] < kCodes) slots_[fern][code.codes[fern]].push_back(slot);
  return true;
}

std::vector<PlaceCandidate> PlaceIndex::query(const FernCode& code, size_t count,
                                              const std::function<bool(uint32_t)>& admit) const {
  if (places_.empty() || code.book_hash != book_hash_ || code.codes.size() != slots_.size()) return {};
  std::vector<uint32_t> equal(places_.size(), 0);
  for (size_t fern = 0; fern < code.codes.size(); ++fern)
    if (code.codes[fern] < kCodes)
      for (const uint32_t slot : slots_[fern][code.codes[fern]]) ++equal[slot];
  std::vector<PlaceCandidate> candidates;
  for (size_t slot = 0; slot < places_.size(); ++slot) {
    if (equal[slot] == 0 || !admit(places_[slot])) continue;
    const double d = dissimilarityOf(jointlyValid(code, codes_[slot]), equal[slot], code.codes.size());
    candidates.push_back({places_[slot], d});
  }
  const size_t keep = std::min(count, candidates.size());
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<long>(keep), candidates.end(),
                    [](const PlaceCandidate& a, const PlaceCandidate& b) {
                      return a.dissimilarity != b.dissimilarity ? a.dissimilarity < b.dissimilarity : a.place < b.place;
                    });
  candidates.resize(keep);
  return candidates;
}

}  // namespace comap
