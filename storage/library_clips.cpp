#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/detail/sqlite.h"
#include "kinespace/storage/library.h"

namespace kinespace {
namespace {

using sqlite::Database;
using sqlite::Statement;

constexpr const char* clip_columns = "SELECT id, space_id, skeleton_id, name, source, source_hash, rate_hz, frames ";

const char* table_of(ClipBlob which) {
  switch (which) {
    case ClipBlob::vectors:
      return "clip_vectors";
    case ClipBlob::warps:
      return "clip_warps";
    case ClipBlob::side:
      break;
  }
  return "clip_sides";
}

[[noreturn]] void no_clip(const Database& database, std::int64_t id) {
  throw Error(ErrorKind::bad_input, {.file = database.shown(), .found = "no clip with the id " + std::to_string(id)});
}

void validate(const ClipRow& row) {
  const auto refuse = [&row](std::string found, std::string expected) {
    throw Error(ErrorKind::usage, {.file = row.source, .found = std::move(found), .expected = std::move(expected)});
  };
  if (row.name.empty()) refuse("a clip without a name", "a name");
  if (!(row.rate_hz > 0) || !std::isfinite(row.rate_hz)) refuse("rate_hz = " + std::to_string(row.rate_hz), "above 0");
  if (row.frames < 1) refuse("frames = " + std::to_string(row.frames), "at least 1");
}

ClipRow clip_of(const Database& database, Statement& query) {
  ClipRow row{.id = query.integer(0),
              .space_id = query.integer(1),
              .skeleton_id = query.integer(2),
              .name = query.text(3),
              .source = query.text(4),
              .source_hash = query.text(5),
              .rate_hz = query.real(6),
              .frames = query.integer(7),
              .labels = {}};
  if (!(row.rate_hz > 0) || !std::isfinite(row.rate_hz) || row.frames < 1) {
    database.damaged("a damaged library: the rate or the frames of clip " + row.name);
  }
  return row;
}

std::optional<ClipRow> one_clip(Database& database, Statement& query) {
  if (!query.step()) return std::nullopt;
  ClipRow row = clip_of(database, query);
  Statement labels = database.prepare("SELECT label FROM clip_labels WHERE clip_id = ? ORDER BY position");
  labels.bind(1, row.id);
  while (labels.step()) row.labels.push_back(labels.text(0));
  return row;
}

std::vector<float> floats_of(const Database& database, Statement& query, int checksum_column, int vector_column) {
  const auto raw = query.blob(vector_column);
  if (raw.size() % sizeof(float) != 0 ||
      checksum64(raw) != static_cast<std::uint64_t>(query.integer(checksum_column))) {
    database.damaged("a damaged library: a retrieval vector's checksum differs");
  }
  std::vector<float> values(raw.size() / sizeof(float));
  if (!raw.empty()) std::memcpy(values.data(), raw.data(), raw.size());
  return values;
}

void put_blobs(Database& database, std::int64_t id, const ClipBlobs& blobs) {
  const auto put = [&](ClipBlob which, const Bytes& blob) {
    database.prepare(std::string("INSERT OR REPLACE INTO ") + table_of(which) + "(clip_id, blob) VALUES(?, ?)")
        .bind(1, id)
        .bind(2, blob)
        .run();
  };
  put(ClipBlob::vectors, blobs.vectors);
  put(ClipBlob::warps, blobs.warps);
  put(ClipBlob::side, blobs.side);
  const auto raw = std::as_bytes(std::span(blobs.retrieval));
  database.prepare("INSERT OR REPLACE INTO clip_retrieval(clip_id, checksum, vector) VALUES(?, ?, ?)")
      .bind(1, id)
      .bind(2, static_cast<std::int64_t>(checksum64(raw)))
      .bind(3, raw)
      .run();
}

}  // namespace

std::int64_t Library::add_clip(const ClipRow& row, const ClipBlobs& blobs) {
  validate(row);
  if (const std::optional<ClipRow> taken = find_clip(row.name)) {
    throw Error(ErrorKind::bad_input, {.file = row.source,
                                       .found = "a second clip named '" + row.name + "'",
                                       .expected = "names that differ (the first is from " + taken->source + ")",
                                       .remedy = "rename one of the files"});
  }
  Transaction together(*this);
  database_
      ->prepare(
          "INSERT INTO clips(space_id, skeleton_id, name, source, source_hash, rate_hz, frames) "
          "VALUES(?, ?, ?, ?, ?, ?, ?)")
      .bind(1, row.space_id)
      .bind(2, row.skeleton_id)
      .bind(3, row.name)
      .bind(4, row.source)
      .bind(5, row.source_hash)
      .bind(6, row.rate_hz)
      .bind(7, row.frames)
      .run();
  const std::int64_t id = database_->last_inserted_id();
  std::int64_t position = 0;
  for (const std::string& label : row.labels) {
    database_->prepare("INSERT INTO clip_labels(clip_id, position, label) VALUES(?, ?, ?)")
        .bind(1, id)
        .bind(2, position++)
        .bind(3, label)
        .run();
  }
  put_blobs(*database_, id, blobs);
  together.commit();
  return id;
}

void Library::replace_clip_blobs(std::int64_t id, const ClipBlobs& blobs) {
  static_cast<void>(clip(id));
  Transaction together(*this);
  put_blobs(*database_, id, blobs);
  together.commit();
}

void Library::remove_clip(std::int64_t id) {
  static_cast<void>(clip(id));
  database_->prepare("DELETE FROM clips WHERE id = ?").bind(1, id).run();
}

std::vector<ClipRow> Library::clips() const {
  std::vector<ClipRow> rows;
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips ORDER BY id");
  while (query.step()) rows.push_back(clip_of(*database_, query));
  // Both lists ascend by clip: one pass joins them.
  Statement labels = database_->prepare("SELECT clip_id, label FROM clip_labels ORDER BY clip_id, position");
  std::size_t at = 0;
  while (labels.step()) {
    const std::int64_t id = labels.integer(0);
    while (at < rows.size() && rows[at].id < id) ++at;
    if (at < rows.size() && rows[at].id == id) rows[at].labels.push_back(labels.text(1));
  }
  return rows;
}

std::optional<ClipRow> Library::find_clip(std::string_view name) const {
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips WHERE name = ?");
  query.bind(1, name);
  return one_clip(*database_, query);
}

ClipRow Library::clip(std::int64_t id) const {
  Statement query = database_->prepare(std::string(clip_columns) + "FROM clips WHERE id = ?");
  query.bind(1, id);
  std::optional<ClipRow> row = one_clip(*database_, query);
  if (!row) no_clip(*database_, id);
  return *std::move(row);
}

Bytes Library::clip_blob(std::int64_t id, ClipBlob which) const {
  Statement query = database_->prepare(std::string("SELECT blob FROM ") + table_of(which) + " WHERE clip_id = ?");
  if (!query.bind(1, id).step()) no_clip(*database_, id);
  const auto blob = query.blob(0);
  return {blob.begin(), blob.end()};
}

std::vector<float> Library::retrieval_vector(std::int64_t id) const {
  Statement query = database_->prepare("SELECT checksum, vector FROM clip_retrieval WHERE clip_id = ?");
  if (!query.bind(1, id).step()) no_clip(*database_, id);
  return floats_of(*database_, query, 0, 1);
}

void Library::for_each_blob(std::int64_t space_id, ClipBlob which,
                            const std::function<void(std::int64_t id, std::span<const std::byte> blob)>& visit) const {
  // CROSS JOIN keeps the blobs in front, so that they are read in the order they lie in.
  Statement query =
      database_->prepare(std::string("SELECT b.clip_id, b.blob FROM ") + table_of(which) +
                         " b CROSS JOIN clips c ON c.id = b.clip_id WHERE c.space_id = ? ORDER BY b.clip_id");
  query.bind(1, space_id);
  while (query.step()) visit(query.integer(0), query.blob(1));
}

RetrievalMatrix Library::retrieval_matrix(std::int64_t space_id) const {
  Statement query = database_->prepare(
      "SELECT r.clip_id, r.checksum, r.vector FROM clip_retrieval r CROSS JOIN clips c ON c.id = r.clip_id "
      "WHERE c.space_id = ? ORDER BY r.clip_id");
  query.bind(1, space_id);
  RetrievalMatrix matrix;
  while (query.step()) {
    const std::vector<float> values = floats_of(*database_, query, 1, 2);
    if (!matrix.clip_ids.empty() && values.size() != matrix.dimensions) {
      database_->damaged("a library whose retrieval vectors differ in length");
    }
    matrix.dimensions = values.size();
    matrix.clip_ids.push_back(query.integer(0));
    matrix.values.insert(matrix.values.end(), values.begin(), values.end());
  }
  return matrix;
}

}  // namespace kinespace
