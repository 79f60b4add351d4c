#include "tests/storage/sample_library.h"

#include <csignal>
#include <cstdio>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "kinespace/base/error.h"
#include "kinespace/base/file.h"
#include "kinespace/storage/bitstream.h"
#include "tests/storage/sample_stream.h"

namespace kinespace::test {
namespace {

Bytes blob_of(int number, std::size_t bytes) {
  BitstreamWriter writer("test");
  writer.set_option("number", std::int64_t{number});
  writer.add_section("data", Bytes(bytes, static_cast<std::byte>(number)));
  return writer.finish();
}

void require(bool holds, const std::string& what) {
  EXPECT_TRUE(holds) << what;
}

bool same_row(const ClipRow& a, const ClipRow& b) {
  return a.name == b.name && a.source == b.source && a.source_hash == b.source_hash && a.rate_hz == b.rate_hz &&
         a.frames == b.frames && a.labels == b.labels;
}

}  // namespace

ClipRow sample_row(int number, std::int64_t space, std::int64_t skeleton) {
  const std::string digits = std::to_string(number);
  ClipRow row{.space_id = space,
              .skeleton_id = skeleton,
              .name = "it's \"clip\": " + digits + " \xc3\xa9; DROP TABLE clips--",
              .source = "/motions of mine/clip " + digits + ".bvh",
              .source_hash = content_hash(to_bytes(digits)),
              .rate_hz = 30.0 + number % 3,
              .frames = 100 + number,
              .labels = {}};
  for (int i = 0; i < number % 4; ++i) row.labels.push_back("label, \"" + std::to_string(3 - i) + "\"");
  return row;
}

ClipBlobs sample_blobs(int number, std::size_t blob_bytes, std::size_t dimensions) {
  ClipBlobs blobs;
  blobs.vectors = blob_of(number, blob_bytes);
  blobs.warps = blob_of(number + 1, 40);
  blobs.retrieval.resize(dimensions);
  for (std::size_t i = 0; i < dimensions; ++i)
    blobs.retrieval[i] = static_cast<float>(number) + 0.5F * static_cast<float>(i);
  return blobs;
}

void fill_sample(Library& library, int clips, std::size_t blob_bytes, std::size_t dimensions) {
  Transaction together(library);
  library.set_metadata("units", "centimetres");
  const std::int64_t skeleton =
      library.add_skeleton({.name = "clip 0", .tree_hash = "tree", .blob = to_bytes("joints")});
  const std::int64_t space = library.put_space({.name = "all", .tree_hash = "tree", .blob = blob_of(0, 1000)});
  library.put_artifact("graph", "neighbours: 5", to_bytes("edges"));
  for (int i = 0; i < clips; ++i) {
    library.add_clip(sample_row(i, space, skeleton), sample_blobs(i, blob_bytes, dimensions));
  }
  together.commit();
}

int expect_sample(const Library& library) {
  EXPECT_EQ(library.metadata("units"), "centimetres");
  EXPECT_EQ(library.artifact("graph", "neighbours: 5"), to_bytes("edges"));
  const std::vector<SpaceRow> spaces = library.spaces();
  EXPECT_EQ(spaces.size(), 1U);
  if (spaces.size() != 1) return -1;
  EXPECT_EQ(library.space(spaces[0].id).blob, blob_of(0, 1000));
  const std::vector<ClipRow> clips = library.clips();
  const RetrievalMatrix matrix = library.retrieval_matrix(spaces[0].id);
  EXPECT_EQ(matrix.clip_ids.size(), clips.size());
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const int number = static_cast<int>(i);
    require(same_row(clips[i], sample_row(number, 0, 0)), "the row of clip " + clips[i].name);
    const Bytes vectors = library.clip_blob(clips[i].id, ClipBlob::vectors);
    const Bitstream stream = Bitstream::parse(vectors, clips[i].name);
    require(stream.integer_option("number", 0, 1 << 30) == number, "the blob of clip " + clips[i].name);
    static_cast<void>(stream.section("data"));
    require(matrix.values[i * matrix.dimensions] == static_cast<float>(number), "the vector of clip " + clips[i].name);
  }
  return static_cast<int>(clips.size());
}

void read_everything(const Library& library) {
  static_cast<void>(library.all_metadata());
  static_cast<void>(library.skeletons());
  for (const ClipRow& clip : library.clips()) {
    static_cast<void>(library.find_clip(clip.name));
    static_cast<void>(library.retrieval_vector(clip.id));
    static_cast<void>(library.skeleton(clip.skeleton_id));
  }
  for (const SpaceRow& space : library.spaces()) {
    const Bytes blob = library.space(space.id).blob;
    static_cast<void>(Bitstream::parse(blob, "space").section("data"));
    for (const ClipBlob which : {ClipBlob::vectors, ClipBlob::warps, ClipBlob::side}) {
      library.for_each_blob(space.id, which, [](std::int64_t, std::span<const std::byte> bytes) {
        if (!bytes.empty()) static_cast<void>(Bitstream::parse(bytes, "clip").section("data"));
      });
    }
    static_cast<void>(library.retrieval_matrix(space.id));
  }
  for (const std::string& key : library.artifact_keys("graph")) static_cast<void>(library.artifact("graph", key));
  static_cast<void>(library.totals());
  library.check();
}

bool survives(const std::filesystem::path& path) {
  try {
    read_everything(Library::open_read_only(path));
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    return false;
  }
}

void write_unflushed(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::filesystem::remove(path);  // some file systems flush a file that is overwritten
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_TRUE(out.good());
}

int in_child(const std::function<int()>& act) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    int status = 100;
    try {
      status = act();
    } catch (const Error& error) {
      status = static_cast<int>(error.kind());
    }
    ::_exit(status);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

Background::Background(const std::function<void(const std::function<void()>& ready)>& act) {
  int pipe[2] = {-1, -1};
  if (::pipe(pipe) != 0) return;
  child_ = ::fork();
  if (child_ == 0) {
    act([&pipe] { static_cast<void>(::write(pipe[1], "r", 1) == 1); });
    ::_exit(0);
  }
  ::close(pipe[1]);
  char ready = 0;
  EXPECT_EQ(::read(pipe[0], &ready, 1), 1) << "the process beside the test ended early";
  ::close(pipe[0]);
}

Background::~Background() {
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
}

}  // namespace kinespace::test
