// How many keyframes a store or an outbox holds, and how many its robots had made by then.
//   count_keyframes FILE    one line for each robot and session: robot session keyframes made
// An outbox does not know its robot's name: "-". `made` follows from the highest sequence.
#include <cinttypes>
#include <cstdio>

#include "protocol/storage/database.h"

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "count_keyframes FILE\n"), 2;
  auto file = comap::Database::open(argv[1], SQLITE_OPEN_READWRITE);
  const auto is_store = file ? file->integer("SELECT count(*) FROM sqlite_schema WHERE name = 'robots'")
                             : comap::Result<int64_t>(file.error());
  if (!is_store) return std::fprintf(stderr, "%s\n", is_store.error().text.c_str()), 3;
  auto query = file->query(
      *is_store > 0 ? "SELECT robot, session, count(*), max(sequence) + 1 FROM keyframes GROUP BY robot, session"
                    : "SELECT '-', session, count(*), max(sequence) + 1 FROM keyframes GROUP BY session");
  if (!query) return std::fprintf(stderr, "%s\n", query.error().text.c_str()), 3;
  for (;;) {
    const auto row = query->step();
    if (!row) return std::fprintf(stderr, "%s\n", row.error().text.c_str()), 3;
    if (!*row) return 0;
    const std::string robot = query->text();
    const int64_t session = query->integer(), keyframes = query->integer(), made = query->integer();
    std::printf("%s %" PRId64 " %" PRId64 " %" PRId64 "\n", robot.c_str(), session, keyframes, made);
  }
}
