#include "mapping_core/service/store_file.h"

#include <gmock/gmock.h>

#include "mapping_core/store/map_store.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using testing::HasSubstr;

class StoreFileTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  const std::string path_ = folder_.path("map.comap"), log_ = path_ + "-wal", aside_ = folder_.path("aside");
  Result<MapStore> store_ = MapStore::open(path_, MapStore::Mode::kCreateOrOpen);
};

TEST_F(StoreFileTest, KnowsWhetherItsNameStillStandsForIt) {
  ASSERT_TRUE(store_);
  StoreFile file(store_->path());
  EXPECT_EQ(file.trouble(), "");
  ASSERT_TRUE(store_->setMeta("a", "b"));
  EXPECT_EQ(file.trouble(), "") << "writing is no trouble";
  std::filesystem::rename(path_, aside_);
  EXPECT_THAT(file.trouble(), HasSubstr(path_ + ": was deleted or moved away"));
  std::filesystem::copy_file(aside_, path_);
  EXPECT_THAT(file.trouble(), HasSubstr(path_ + ": another file has taken its place"));
  std::filesystem::rename(aside_, path_);
  EXPECT_EQ(file.trouble(), "") << "put back";
}

TEST_F(StoreFileTest, ItsLogCountsAsWell) {
  ASSERT_TRUE(store_);
  StoreFile file(store_->path());
  ASSERT_TRUE(store_->setMeta("a", "b"));
  EXPECT_EQ(file.trouble(), "");
  ASSERT_TRUE(std::filesystem::exists(log_));
  std::filesystem::remove(log_);
  EXPECT_THAT(file.trouble(), HasSubstr(log_ + ": was deleted or moved away"));
}

TEST_F(StoreFileTest, WhoOnlyLooksIsNoTrouble) {
  ASSERT_TRUE(store_);
  StoreFile file(store_->path());
  ASSERT_TRUE(store_->setMeta("a", "b"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(MapStore::open(path_, MapStore::Mode::kReadOnly));
  EXPECT_EQ(file.trouble(), "");
}

}  // namespace
}  // namespace comap
