#include "mapping_core/ferns/fern_book.h"

#include <gtest/gtest.h>

#include <set>

namespace comap {
namespace {

TEST(FernBook, oneSeedIsOneBook) {
  const FernBook a(7, 500, 400, 5000), b(7, 500, 400, 5000);
  EXPECT_EQ(a.hash(), b.hash());
  ASSERT_EQ(a.ferns().size(), b.ferns().size());
  for (size_t i = 0; i < a.ferns().size(); ++i) {
    EXPECT_EQ(a.ferns()[i].x, b.ferns()[i].x);
    EXPECT_EQ(a.ferns()[i].y, b.ferns()[i].y);
    EXPECT_EQ(a.ferns()[i].r, b.ferns()[i].r);
    EXPECT_EQ(a.ferns()[i].g, b.ferns()[i].g);
    EXPECT_EQ(a.ferns()[i].b, b.ferns()[i].b);
    EXPECT_EQ(a.ferns()[i].depth_mm, b.ferns()[i].depth_mm);
  }
}

TEST(FernBook, whateverMakesCodesIncomparableChangesTheHash) {
  const std::set<uint64_t> hashes{FernBook(7, 500, 400, 5000).hash(), FernBook(8, 500, 400, 5000).hash(),
                                  FernBook(7, 499, 400, 5000).hash(), FernBook(7, 500, 300, 5000).hash(),
                                  FernBook(7, 500, 400, 6000).hash(), FernBook::standard().hash()};
  EXPECT_EQ(hashes.size(), 6u);
}

TEST(FernBook, drawsStayInsideTheImageAndTheDepthRange) {
  const FernBook book(3, 5000, 400, 5000);
  std::set<int> xs, ys;
  for (const Fern& fern : book.ferns()) {
    EXPECT_GE(fern.x, 0);
    EXPECT_LT(fern.x, kFernImageWidth);
    EXPECT_GE(fern.y, 0);
    EXPECT_LT(fern.y, kFernImageHeight);
    EXPECT_GE(fern.depth_mm, 400);
    EXPECT_LE(fern.depth_mm, 5000);
    xs.insert(fern.x);
    ys.insert(fern.y);
  }
  EXPECT_EQ(xs.size(), static_cast<size_t>(kFernImageWidth)) << "the whole image is used";
  EXPECT_EQ(ys.size(), static_cast<size_t>(kFernImageHeight));
}

}  // namespace
}  // namespace comap
