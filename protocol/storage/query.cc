// One run of a statement: values in and out.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/storage/database.h"
#include "protocol/storage/row_sum.h"

namespace comap {
namespace {

bool fits(int type, char wanted) {
  switch (wanted) {
    case 'i':
      return type == SQLITE_INTEGER;
    case 't':
      return type == SQLITE_TEXT;
    case 'b':
      return type == SQLITE_BLOB;
    default:
      return type == SQLITE_FLOAT || type == SQLITE_NULL;
  }
}

void addValue(sqlite3_value* value, int type, RowSum& sum) {
  const auto bytesOf = [&](const void* bytes) {
    return std::string_view(static_cast<const char*>(bytes), size_t(sqlite3_value_bytes(value)));
  };
  switch (type) {
    case SQLITE_INTEGER:
      return sum.add(int64_t{sqlite3_value_int64(value)});
    case SQLITE_FLOAT:
      return sum.add(sqlite3_value_double(value));
    case SQLITE_TEXT:
      return sum.addText(bytesOf(sqlite3_value_text(value)));
    case SQLITE_BLOB:
      return sum.addBlob(bytesOf(sqlite3_value_blob(value)));
    default:
      return sum.addNull();
  }
}

}  // namespace

Query::Query(Query&& other) noexcept
    : database_(other.database_), statement_(std::exchange(other.statement_, nullptr)) {}

// A column asked for by itself costs as much each time as its value's type, number and bytes together.
sqlite3_value* Query::at(int column) const {
  if (size_t(column) >= kept_.size()) return sqlite3_column_value(statement_, column);
  const uint32_t bit = uint32_t{1} << column;
  if ((known_ & bit) == 0) kept_[size_t(column)] = sqlite3_column_value(statement_, column);
  known_ |= bit;
  return kept_[size_t(column)];
}

Query::~Query() {
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

void Query::note(int code) {
  if (bind_code_ == SQLITE_OK) bind_code_ = code;
}

Query& Query::bind(int64_t value) {
  note(sqlite3_bind_int64(statement_, ++parameter_, value));
  return *this;
}

Query& Query::bind(double value) {
  note(sqlite3_bind_double(statement_, ++parameter_, value));
  return *this;
}

Query& Query::bind(const std::string& value) {
  note(sqlite3_bind_text64(statement_, ++parameter_, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Query& Query::bind(std::span<const uint8_t> bytes) {
  static constexpr uint8_t kNothing = 0;  // a null pointer would mean NULL, not an empty blob
  note(sqlite3_bind_blob64(statement_, ++parameter_, bytes.empty() ? &kNothing : bytes.data(), bytes.size(),
                           SQLITE_STATIC));
  return *this;
}

Query& Query::bind(const KeyframeId& id) {
  return bind(id.robot).bind(static_cast<int64_t>(id.session)).bind(static_cast<int64_t>(id.sequence));
}

Query& Query::bind(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) bind(value);
  for (int i = 0; i < 3; ++i) bind(pose.translation()(i));
  return *this;
}

Result<bool> Query::step() {
  if (bind_code_ != SQLITE_OK) return database_->error(bind_code_);
  if (auto read = values(); !read) return read.error();
  column_ = 0;
  known_ = 0;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_->error(code);
}

Result<void> Query::values() const {
  return damage_.empty() ? Result<void>() : Error{ErrorCode::kBadData, database_->path() + ": " + damage_};
}

Result<void> Query::run() {
  const Result<bool> stepped = step();
  if (!stepped) return stepped.error();
  return {};
}

bool Query::areOf(std::string_view types) const {
  int column = column_;
  return std::all_of(types.begin(), types.end(),
                     [&](char wanted) { return fits(sqlite3_value_type(at(column++)), wanted); });
}

RowState Query::rowState(std::string_view types) const {
  int column = column_;
  RowSum sum;
  for (const char wanted : types) {
    sqlite3_value* const value = at(column++);
    const int type = sqlite3_value_type(value);
    if (!fits(type, wanted)) return RowState::kMistyped;
    addValue(value, type, sum);
  }
  const bool same =
      sqlite3_value_type(at(column)) == SQLITE_INTEGER && sqlite3_value_int64(at(column)) == int64_t{sum.value()};
  return same ? RowState::kSound : RowState::kUnsound;
}

int64_t Query::integer() { return sqlite3_value_int64(at(column_++)); }

uint32_t Query::unsigned32() {
  const int64_t value = sqlite3_value_int64(at(column_));
  if (value < 0 || value > std::numeric_limits<uint32_t>::max()) {
    damage_ = std::string("column ") + sqlite3_column_name(statement_, column_) + " holds " + std::to_string(value) +
              ", expected 0 to 4294967295";
  }
  ++column_;
  return static_cast<uint32_t>(value);
}

double Query::real() {
  const int column = column_++;
  const double value = sqlite3_value_double(at(column));
  const bool none = value == 0 && sqlite3_value_type(at(column)) == SQLITE_NULL;
  return none ? std::numeric_limits<double>::quiet_NaN() : value;
}

std::string_view Query::textView() {
  const int column = column_++;
  const auto* text = reinterpret_cast<const char*>(sqlite3_value_text(at(column)));
  return text == nullptr ? std::string_view() : std::string_view(text, size_t(sqlite3_value_bytes(at(column))));
}

std::span<const uint8_t> Query::bytes() {
  const int column = column_++;
  const auto* bytes = static_cast<const uint8_t*>(sqlite3_value_blob(at(column)));
  return {bytes, bytes == nullptr ? 0 : size_t(sqlite3_value_bytes(at(column)))};
}

KeyframeId Query::keyframeId() {
  KeyframeId id;
  id.robot = text();
  id.session = static_cast<uint64_t>(integer());
  id.sequence = unsigned32();
  return id;
}

Pose Query::pose() {
  std::array<double, 7> numbers;
  for (double& value : numbers) value = real();
  return poseOf(numbers, damage_);
}

void Query::checked(const char* what) {
  if (const int64_t number = integer(); number >= 0) judged(RowState::kUnsound, what, number);
}

void Query::judged(RowState state, const char* what, int64_t number) {
  if (state == RowState::kSound) return;
  damage_ = std::string(what) + " " + std::to_string(number) + " is damaged: " +
            (state == RowState::kUnsound ? "its checksum is not that of its values"
                                         : "a value of it is of another type than its column");
}

Pose poseOf(std::span<const double, 7> v, std::string& wrong) {
  const Eigen::Quaterniond q(v[3], v[0], v[1], v[2]);
  const Eigen::Vector3d t(v[4], v[5], v[6]);
  if (std::all_of(v.begin(), v.end(), [](double value) { return std::isnan(value); })) return Pose(q, t);
  if (!t.allFinite() || !(std::abs(q.squaredNorm() - 1) <= 1e-6)) {
    wrong = t.allFinite() ? "a pose's quaternion has length " + std::to_string(q.norm()) + ", expected 1"
                          : "a pose's place is not finite";
  }
  return Pose(q, t);
}

}  // namespace comap
