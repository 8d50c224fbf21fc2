#include "mapping_core/ferns/place_index.h"

#include <algorithm>

namespace comap {
namespace {

constexpr size_t kCodes = 16;

double dissimilarityOf(size_t joint, size_t equal, size_t ferns) {
  if (joint * 10 < ferns || joint == 0) return 1;
  return static_cast<double>(joint - equal) / static_cast<double>(joint);
}

// Of 64 bits; in plain arithmetic, as processors without such an instruction call a function instead.
size_t ones(uint64_t x) {
  x -= (x >> 1) & 0x5555555555555555;
  x = (x & 0x3333333333333333) + ((x >> 2) & 0x3333333333333333);
  x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0f;
  return (x * 0x0101010101010101) >> 56;
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
    ferns_ = code.codes.size();
  }
  if (code.book_hash != book_hash_ || code.codes.size() != ferns_) return false;
  places_.push_back(place);
  const std::vector<Slice> slices = sliced(code);
  slices_.insert(slices_.end(), slices.begin(), slices.end());
  return true;
}

std::vector<PlaceCandidate> PlaceIndex::query(const FernCode& code, size_t count,
                                              const std::function<bool(uint32_t)>& admit,
                                              double max_dissimilarity) const {
  if (places_.empty() || code.book_hash != book_hash_ || code.codes.size() != ferns_) return {};
  const std::vector<Slice> asked = sliced(code);
  std::vector<PlaceCandidate> candidates;
  for (size_t slot = 0; slot < places_.size(); ++slot) {
    const Slice* stored = slices_.data() + slot * asked.size();
    size_t joint = 0, equal = 0;
    for (size_t i = 0; i < asked.size(); ++i) {
      const Slice &a = asked[i], &b = stored[i];
      joint += ones(a.valid & b.valid);
      equal += ones(
          a.code & b.code &
          ~((a.bits[0] ^ b.bits[0]) | (a.bits[1] ^ b.bits[1]) | (a.bits[2] ^ b.bits[2]) | (a.bits[3] ^ b.bits[3])));
    }
    if (equal == 0) continue;
    const PlaceCandidate candidate{places_[slot], dissimilarityOf(joint, equal, ferns_)};
    if (candidate.dissimilarity <= max_dissimilarity) candidates.push_back(candidate);
  }
  // The caller's question may cost more than the comparison: it is asked only of those that come next.
  const auto after = [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return a.dissimilarity != b.dissimilarity ? a.dissimilarity > b.dissimilarity : a.place > b.place;
  };
  std::make_heap(candidates.begin(), candidates.end(), after);
  std::vector<PlaceCandidate> found;
  while (found.size() < count && !candidates.empty()) {
    std::pop_heap(candidates.begin(), candidates.end(), after);
    if (admit(candidates.back().place)) found.push_back(candidates.back());
    candidates.pop_back();
  }
  return found;
}

std::vector<PlaceIndex::Slice> PlaceIndex::sliced(const FernCode& code) {
  std::vector<Slice> slices((code.codes.size() + 63) / 64);
  for (size_t fern = 0; fern < code.codes.size(); ++fern) {
    Slice& slice = slices[fern / 64];
    const uint64_t bit = uint64_t{1} << (fern % 64);
    const uint8_t value = code.codes[fern];
    if (value != FernCode::kBad) slice.valid |= bit;
    if (value >= kCodes) continue;
    slice.code |= bit;
    for (size_t i = 0; i < 4; ++i)
      if (value >> i & 1) slice.bits[i] |= bit;
  }
  return slices;
}

}  // namespace comap
