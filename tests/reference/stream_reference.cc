#include "tests/reference/stream_reference.h"

#include <bit>

namespace comap::reference {

std::vector<Row> rowsOf(const StreamRows& streams) {
  std::vector<Row> rows;
  for (size_t i = 0; i < streams.places.size(); ++i) {
    const auto &place = streams.places[i], &shape = streams.shapes[i];
    const auto& look = streams.looks[i];
    Row row;
    row.position = {place[0], place[1], place[2]};
    row.confidence = place[3];
    row.normal = {shape[0], shape[1], shape[2]};
    row.radius = shape[3];
    row.colour = Eigen::Vector3f(static_cast<float>(look[0] & 0xffff), static_cast<float>(look[0] >> 16),
                                 static_cast<float>(look[1] & 0xffff)) /
                 256;
    row.observations = look[1] >> 16;
    row.owner = look[2];
    row.contributors = look[3];
    row.precision = std::bit_cast<float>(streams.records[i][0]);
    row.misses = streams.records[i][1] & 0xff;
    row.violations = streams.records[i][1] >> 8;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace comap::reference
