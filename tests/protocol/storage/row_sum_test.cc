#include "protocol/storage/row_sum.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <set>

#include "protocol/storage/database.h"

namespace comap {
namespace {

class RowSumTest : public ::testing::Test {
 protected:
  RowSumTest() : opened_(Database::open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE)), database_(*opened_) {}
  int64_t sumOf(const std::string& values) { return one("SELECT row_sum(" + values + ")"); }
  int64_t one(const std::string& sql) {
    auto query = database_.query(sql);
    EXPECT_TRUE(query) << query.error().text;
    EXPECT_TRUE(*query->step());
    return query->integer();
  }
  Result<Database> opened_;
  Database& database_;
};

int64_t crcOf(const std::string& bytes) {
  return static_cast<int64_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// As it is written down, so that others can check a file.
TEST_F(RowSumTest, IsTheCrcOfTheValuesOneBehindTheOther) {
  using namespace std::string_literals;
  EXPECT_EQ(sumOf(""), 0);
  EXPECT_EQ(sumOf("NULL"), crcOf("n"));
  EXPECT_EQ(sumOf("1, 'ab', x'00ff', 1.5"), crcOf("i\x01\0\0\0\0\0\0\0"s + "t\x02\0\0\0\0\0\0\0"s + "ab" +
                                                  "b\x02\0\0\0\0\0\0\0\0\xff"s + "r\0\0\0\0\0\0\xf8\x3f"s));
  EXPECT_EQ(sumOf("zeroblob(5000), 1"),
            crcOf("b\x88\x13\0\0\0\0\0\0"s + std::string(5000, '\0') + "i\x01\0\0\0\0\0\0\0"s));
}

TEST_F(RowSumTest, TellsValuesApart) {
  std::set<int64_t> sums;
  const char* different[] = {"0",    "1",    "0.0",      "NULL",     "''",       "x''",        "'0'", "x'30'",
                             "1, 2", "2, 1", "'a', 'b'", "'ab', ''", "'', 'ab'", "NULL, NULL", "-1",  "1e300"};
  for (const char* values : different) EXPECT_TRUE(sums.insert(sumOf(values)).second) << values;
}

// SQLite keeps a whole number in a REAL column as an integer, which has no negative zero.
TEST_F(RowSumTest, ARowFitsItsSumWhateverIsWritten) {
  ASSERT_TRUE(
      database_.execute("CREATE TABLE t (number INTEGER PRIMARY KEY, a REAL, b TEXT, c INTEGER, "
                        "checksum INTEGER NOT NULL AS (row_sum(number, a, b, c)) STORED, UNIQUE (b)) STRICT"));
  for (const char* sql :
       {"INSERT INTO t (a, b, c) VALUES (-0.0, 'x', 1), (7, 'y', 2), (NULL, NULL, NULL), (1e999, 'z', -5)",
        "INSERT INTO t (a, b, c) VALUES (3.5, 'x', 9) ON CONFLICT (b) DO UPDATE SET a = excluded.a",
        "UPDATE t SET c = 77 WHERE b = 'y'", "UPDATE t SET number = 100 WHERE b = 'z'"}) {
    ASSERT_TRUE(database_.execute(sql)) << sql;
    EXPECT_EQ(one("SELECT count(*) FROM t WHERE checksum IS NOT row_sum(number, a, b, c)"), 0) << sql;
  }
  EXPECT_EQ(one("SELECT count(*) FROM t"), 4);
}

}  // namespace
}  // namespace comap
