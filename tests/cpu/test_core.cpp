// Tests that files are written completely or not at all, and that errors name the file and the reason.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/json_limits.h"
#include "engine/core/memory.h"
#include "engine/core/progress.h"
#include "engine/files/image.h"
#include "engine/files/npy.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

class CoreFiles : public testing::Test {
 protected:
  static std::string text_of(const fs::path& path) {
    const auto bytes = read_file(path);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  template <class Call>
  static std::string error_of(Call call) {
    try {
      call();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Failure::Work);
      return error.what();
    }
    return "no error";
  }
  const test::TemporaryFolder kept_;
  const fs::path folder_ = kept_.path();
};

TEST_F(CoreFiles, BytesComeBack) {
  for (const std::size_t size : {0, 1, 65535, 65536, 300000}) {
    std::string text(size, 'x');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * 7);
    write_file(folder_ / "a", text);
    EXPECT_EQ(text_of(folder_ / "a"), text);
  }
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(CoreFiles, ReadErrorsNameFileAndReason) {
  EXPECT_EQ(error_of([&] { read_file(folder_ / "none"); }),
            "cannot read " + (folder_ / "none").string() + ": No such file or directory; check the path");
  EXPECT_EQ(error_of([&] { read_file(folder_); }), "cannot read " + folder_.string() + ": it is a folder");
}

TEST_F(CoreFiles, FilesWithoutSizeAreReadToTheirEnd) { EXPECT_GT(read_file("/proc/self/status").size(), 100u); }

TEST_F(CoreFiles, OnlyRegularFilesAreRead) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string no_device = "cannot read /dev/zero: it is a device; expected a regular file";
  const std::string no_pipe = "cannot read " + pipe.string() + ": it is a pipe; expected a regular file";
  EXPECT_EQ(error_of([&] { read_file("/dev/zero"); }), no_device);
  EXPECT_EQ(error_of([&] { read_argument("/dev/zero"); }), no_device);
  EXPECT_EQ(error_of([&] { read_rays("/dev/zero"); }), no_device);
  EXPECT_EQ(error_of([&] { read_exr("/dev/zero"); }), no_device);
  EXPECT_EQ(error_of([&] { read_file(pipe); }), no_pipe);
  EXPECT_EQ(error_of([&] { read_argument(pipe); }), no_pipe);
  EXPECT_EQ(error_of([&] { read_rays(pipe); }), no_pipe);
  EXPECT_EQ(error_of([&] { read_exr(pipe); }), no_pipe);
}

TEST_F(CoreFiles, AnOpenPipeIsReadOnlyIfTheUserNamesIt) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string name = "/dev/fd/" + std::to_string(ends[0]);
  EXPECT_NE(error_of([&] { read_file(name); }).find("it is a pipe"), std::string::npos);
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the reader has to wait
    EXPECT_EQ(::write(ends[1], "text", 4), 4);
    ::close(ends[1]);
  });
  const auto bytes = read_argument(name);
  writer.join();
  ::close(ends[0]);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), "text");
}

TEST_F(CoreFiles, JsonDepthCountsOpenBrackets) {
  const auto check = [](const std::string& text) { check_json("a.json", text); };
  const auto nested = [](int depth) { return std::string(depth, '[') + std::string(depth, '}'); };
  check(nested(kMaxJsonDepth));
  check(nested(200) + nested(200));
  check("\"" + nested(1000) + "\\\"" + nested(1000) + "\"");
  EXPECT_EQ(error_of([&] { check(nested(100000)); }),
            "a.json: its JSON nests deeper than 256 brackets at byte 256; expected at most that");
}

TEST_F(CoreFiles, JsonIsAskedForMemory) {
  std::string text = "[0";
  for (int i = 1; i < 1000; ++i) text += ",0";
  set_memory_limit(1);
  const std::string error = error_of([&] { check_json("a.json", text + "]"); });
  set_memory_limit(0);
  EXPECT_TRUE(error.starts_with("a.json: its JSON of 2001 bytes needs about 33.")) << error;  // 1000 values of 32 bytes
  check_json("a.json", text + "]");
}

TEST_F(CoreFiles, WriteErrorsNameFileAndReason) {
  const fs::path lost = folder_ / "none" / "a";
  EXPECT_EQ(error_of([&] { write_file(lost, "x"); }),
            "cannot write " + lost.string() + ": there is no folder " + lost.parent_path().string());
  EXPECT_EQ(error_of([&] { write_file(folder_, "x"); }), "cannot write " + folder_.string() + ": it is a folder");
  write_file(folder_ / "file", "x");
  EXPECT_EQ(error_of([&] { write_file(folder_ / "file" / "a", "x"); }),
            "cannot write " + (folder_ / "file" / "a").string() + ": Not a directory");
  EXPECT_NE(error_of([&] { write_file("", "x"); }), "no error");
  EXPECT_NE(error_of([&] { write_file(folder_ / "none" / "", "x"); }), "no error");
  EXPECT_NE(error_of([&] { write_file(folder_ / std::string(300, 'n'), "x"); }).find("too long"), std::string::npos);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(CoreFiles, CheckWritableSaysTheSame) {
  const fs::path lost = folder_ / "none" / "a";
  EXPECT_EQ(error_of([&] { check_writable(lost); }), error_of([&] { write_file(lost, "x"); }));
  EXPECT_EQ(error_of([&] { check_writable(folder_); }), error_of([&] { write_file(folder_, "x"); }));
}

TEST_F(CoreFiles, CheckWritableTouchesNothing) {
  check_writable(folder_ / "a");
  EXPECT_EQ(file_count(), 0u);
  write_file(folder_ / "a", "old");
  const auto time = fs::last_write_time(folder_ / "a");
  check_writable(folder_ / "a");
  EXPECT_EQ(text_of(folder_ / "a"), "old");
  EXPECT_EQ(fs::last_write_time(folder_ / "a"), time);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(CoreFiles, LockedFolderIsRefused) {
  write_file(folder_ / "old", "x");
  ASSERT_EQ(::chmod((folder_ / "old").c_str(), 0444), 0);
  fs::permissions(folder_, fs::perms::owner_write, fs::perm_options::remove);
  const uid_t user = ::geteuid();
  const bool root = user == 0;  // root may write everywhere, so the test runs as nobody for a while
  ASSERT_EQ(root ? ::seteuid(65534) : 0, 0);
  const std::string written = error_of([&] { write_file(folder_ / "a", "x"); });
  const std::string checked = error_of([&] { check_writable(folder_ / "a"); });
  const std::string locked = error_of([&] { write_file(folder_ / "old", "x"); });
  ASSERT_EQ(root ? ::seteuid(user) : 0, 0);
  EXPECT_EQ(written, "cannot write " + (folder_ / "a").string() + ": Permission denied");
  EXPECT_EQ(checked, written);
  EXPECT_EQ(locked, "cannot write " + (folder_ / "old").string() + ": Permission denied");
}

TEST_F(CoreFiles, FailedWriteLeavesTheOldFileAndNothingElse) {
  write_file(folder_ / "a", "old");
  const auto broken = [](OutputFile& out) {
    out.write("half", 4);
    throw std::runtime_error("broken");
  };
  EXPECT_THROW(write_atomically(folder_ / "a", broken), std::runtime_error);
  EXPECT_EQ(text_of(folder_ / "a"), "old");
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(CoreFiles, TemporaryLiesBesideTheFile) {
  write_atomically(folder_ / "a", [&](OutputFile& out) {
    EXPECT_EQ(fs::directory_iterator(folder_)->path().extension(), ".tmp");
    EXPECT_FALSE(fs::exists(folder_ / "a"));
    out.write("new", 3);
  });
  EXPECT_EQ(text_of(folder_ / "a"), "new");
}

TEST_F(CoreFiles, LinkStaysAndItsFileIsReplaced) {
  fs::create_directory(folder_ / "real");
  write_file(folder_ / "real" / "a", "old");
  fs::create_symlink("real/a", folder_ / "link");
  fs::create_symlink("link", folder_ / "link2");
  write_file(folder_ / "link2", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "link2"));
  EXPECT_EQ(text_of(folder_ / "real" / "a"), "new");

  fs::create_symlink("real/later", folder_ / "dangling");
  write_file(folder_ / "dangling", "made");
  EXPECT_EQ(text_of(folder_ / "real" / "later"), "made");

  fs::create_symlink("loop", folder_ / "loop");
  EXPECT_NE(error_of([&] { write_file(folder_ / "loop", "x"); }).find("cannot write"), std::string::npos);
}

TEST_F(CoreFiles, ReplacedFileKeepsItsPermissions) {
  write_file(folder_ / "a", "old");
  ASSERT_EQ(::chmod((folder_ / "a").c_str(), 0640), 0);
  write_file(folder_ / "a", "new");
  EXPECT_EQ(static_cast<int>(fs::status(folder_ / "a").permissions()), 0640);
}

TEST_F(CoreFiles, RelativeNamesWork) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  write_file("plain", "x");
  check_writable("plain2");
  fs::current_path(before);
  EXPECT_EQ(text_of(folder_ / "plain"), "x");
}

TEST_F(CoreFiles, DevicesAreWrittenToAndStayDevices) {
  write_file("/dev/null", "x");
  check_writable("/dev/null");
  EXPECT_EQ(fs::status("/dev/null").type(), fs::file_type::character);
}

TEST_F(CoreFiles, MissingTemporaryFolderIsNamed) {
  const test::Variable temporary("TMPDIR", "/nowhere");
  const std::string text = error_of([&] { write_file("/dev/null", "x"); });
  EXPECT_EQ(text, "cannot write /dev/null: there is no folder for temporary files; set TMPDIR to one");
}

TEST_F(CoreFiles, FullDiskIsNoticed) {
  const std::string full = "cannot write /dev/full: No space left on device";
  const int device = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  EXPECT_EQ(error_of([&] { write_file("/dev/full", "x"); }), full);
  EXPECT_EQ(error_of([&] {
              OutputFile out(device, "/dev/full");
              out.write("x", 1);  // buffered, so only close() can notice the failure
              out.close();
            }),
            full);
  EXPECT_EQ(error_of([&] {
              OutputFile out(device, "/dev/full");
              try {
                out.write(std::string(1 << 20, 'x').data(), 1 << 20);
              } catch (const Error&) {  // swallowed, as by OpenEXR's destructors
              }
              out.close();
            }),
            full);
  ::close(device);
}

TEST_F(CoreFiles, ConcurrentWritersLeaveOneWholeFile) {
  std::vector<std::thread> writers;
  for (int w = 0; w < 4; ++w) {
    writers.emplace_back([&, w] {
      for (int i = 0; i < 50; ++i) write_file(folder_ / "a", std::string(10000, static_cast<char>('a' + w)));
    });
  }
  for (auto& writer : writers) writer.join();
  const std::string text = text_of(folder_ / "a");
  EXPECT_EQ(text, std::string(10000, text[0]));
  EXPECT_EQ(file_count(), 1u);
}

TEST(Core, CacheFolderFollowsTheEnvironment) {
  const test::Variable cache("XDG_CACHE_HOME", "/somewhere");
  EXPECT_EQ(cache_folder(), "/somewhere/ballot");
  cache.set("relative");  // a relative path must be ignored
  EXPECT_TRUE(cache_folder().is_absolute());
  cache.set({});
  EXPECT_TRUE(cache_folder().string().ends_with("/.cache/ballot"));
}

TEST(Core, ErrorCarriesTextAndExitCode) {
  try {
    fail(Failure::Arguments, "no method '{}'; there are: {}", "x", "packet");
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "no method 'x'; there are: packet");
    EXPECT_EQ(static_cast<int>(error.kind()), 2);
  }
}

TEST(Core, ProgressIsSilentWithoutATerminal) {
  testing::internal::CaptureStderr();
  {
    ProgressBar bar("working");
    for (int i = 0; i <= 10; ++i) {
      bar.update(i / 10.0);
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace ballot
