// Tests of buffers, kernels, shaders and caches on a device. The choice of a device is tested without one, in
// tests/cli.
#include <malloc.h>

#include <fstream>

#include "engine/render/path/integrators.h"
#include "shaders/shared/render.h"
#include "tests/device/fixture.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

class Vulkan : public DeviceTest {
 protected:
  /// Returns the message of the error that `work` throws, or "no error".
  static std::string error_of(const std::function<void()>& work) {
    try {
      work();
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }
  /// A kernel of tests/device/shaders.
  static KernelSource source(const char* file, const Defines& defines = {}) {
    return {.name = file,
            .file = std::string("../tests/device/shaders/") + file,
            .defines = defines,
            .constants = {},
            .group_size = 1};
  }
};

// The driver must stay loaded between contexts: a process can load NVIDIA's driver no more than 30 times.
TEST(Contexts, ManyInOneProcess) {
  for (int i = 0; i < 40; ++i) {
    const Context gpu(ContextOptions{});
    EXPECT_FALSE(gpu.info().name.empty()) << i;
  }
}

// The validation layers keep the name of an object until it is taken back, also beyond the object's end.
TEST_F(Vulkan, NamesEndWithTheirObjects) {
  const auto make = [&](int count) {
    for (int i = 0; i < count; ++i)
      Buffer<std::uint32_t>(*gpu_, 4, Access::Storage, "a buffer whose name is too long to lie in the string itself");
  };
  constexpr int kCount = 2000;
  make(500);
  const std::size_t before = ::mallinfo2().uordblks;
  make(kCount);
  const std::size_t after = ::mallinfo2().uordblks;
  RecordProperty("bytes_a_buffer", int((after - std::min(before, after)) / kCount));
  EXPECT_LT(after, before + 16 * kCount);
}

TEST_F(Vulkan, BuffersRoundTrip) {
  for (const std::size_t n :
       {std::size_t(1), std::size_t(1000), (std::size_t(64) << 18) + 3}) {  // the last is larger than a staging chunk
    Buffer<std::uint32_t> buffer(*gpu_, n, Access::Storage, "numbers");
    std::vector<std::uint32_t> in(n), out(n);
    for (std::size_t i = 0; i < n; ++i) in[i] = std::uint32_t(i * 2654435761u);
    buffer.upload(in);
    buffer.download(out);
    EXPECT_EQ(in, out);
  }
}

// Memory of the host is used in place, from any place that a buffer may begin at.
TEST_F(Vulkan, BuffersOverMemoryOfTheHost) {
  if (gpu_->info().is_cpu()) {
    EXPECT_GT(gpu_->info().host_page, 0u);
  }
  if (!gpu_->info().host_page) GTEST_SKIP() << "the device cannot use memory of the host";
  std::vector<std::uint32_t> memory(100'000), seen(1000);
  for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = std::uint32_t(i);
  std::size_t first = 0;
  while (!RawBuffer::can_import(*gpu_, &memory[first])) ++first;
  const std::size_t step = gpu_->info().buffer_alignment / sizeof(std::uint32_t);
  Buffer<std::uint32_t> copy(*gpu_, seen.size(), Access::Storage, "copy");
  for (const std::size_t at : {first, first + step, first + 300 * step}) {
    Buffer<std::uint32_t> there(*gpu_, std::span(&memory[at], seen.size()), "memory of the host");
    copy.copy_from(there, 0, 0, seen.size());
    copy.download(seen);
    EXPECT_EQ(seen[0], at);
    EXPECT_EQ(seen.back(), at + seen.size() - 1);
    memory[at] = 77;
    there.copy_from(there, 0, 500, 1);  // the device writes there
    EXPECT_EQ(memory[at + 500], 77u);
    memory[at] = std::uint32_t(at), memory[at + 500] = std::uint32_t(at + 500);
  }
  EXPECT_THROW(Buffer<std::uint32_t>(*gpu_, std::span(&memory[first], 2), "too small"), Error);
  const std::span<std::uint32_t> askew(reinterpret_cast<std::uint32_t*>(reinterpret_cast<char*>(&memory[first]) + 4),
                                       9);
  EXPECT_THROW(Buffer<std::uint32_t>(*gpu_, askew, "askew"), Error);
}

TEST_F(Vulkan, EmptyAndMovedBuffers) {
  Buffer<Ray> empty(*gpu_, 0, Access::Storage | Access::Texel, "nothing");
  EXPECT_EQ(empty.size(), 0u);
  EXPECT_GE(empty.bytes(), 16u);
  Buffer<Ray> moved = std::move(empty);
  EXPECT_EQ(moved.name(), "nothing");
}

TEST_F(Vulkan, TooLargeABufferIsRefusedWithBothSizes) {
  const std::uint64_t limit = gpu_->info().max_storage_range;
  if (limit < (1ull << 32)) {
    const std::string text =
        error_of([&] { Buffer<glm::uvec4> b(*gpu_, limit / 16 + 1, Access::Storage, "bvh nodes"); });
    EXPECT_NE(text.find("buffer 'bvh nodes' needs "), std::string::npos) << text;
    EXPECT_NE(text.find(fmt::format("maxStorageBufferRange of {} is {:.1f} MiB", gpu_->info().name,
                                    double(limit) / (1 << 20))),
              std::string::npos)
        << text;
    if (limit / 16 < gpu_->info().max_texels)
      Buffer<glm::uvec4> texels(*gpu_, limit / 16 + 1, Access::Texel, "as texels it fits");
  }
  const std::string huge = error_of([&] { Buffer<glm::uvec4> b(*gpu_, 1ull << 40, Access::Texel, "leaves"); });
  EXPECT_NE(huge.find("maxTexelBufferElements"), std::string::npos) << huge;
  const std::string beyond = error_of([&] { Buffer<glm::uvec4> b(*gpu_, 1ull << 40, Access::Address, "leaves"); });
  EXPECT_NE(beyond.find("needs"), std::string::npos) << beyond;
}

TEST_F(Vulkan, CopiesBeyondTheEndAreRefused) {
  Buffer<std::uint32_t> buffer(*gpu_, 8, Access::Storage, "eight");
  std::vector<std::uint32_t> nine(9);
  EXPECT_NE(error_of([&] { buffer.upload(nine); }).find("buffer 'eight' of 32 bytes"), std::string::npos);
}

// C++ and GLSL agree on the layout of every record, byte for byte.
TEST_F(Vulkan, RecordsHaveTheSameBytes) {
  Kernel kernel(*gpu_, source("records.comp"));
  Buffer<Ray> rays(*gpu_, 2, Access::Storage, "rays");
  Buffer<Hit> hits(*gpu_, 2, Access::Storage, "hits");
  Buffer<BvhNode> nodes(*gpu_, 2, Access::Storage, "nodes");
  Buffer<FilmPixel> film(*gpu_, 2, Access::Storage, "film");
  kernel.bind(0, rays);
  kernel.bind(1, hits);
  kernel.bind(2, nodes);
  kernel.bind(3, film);
  gpu_->submit("records", [&](Commands& cmd) {
    kernel.dispatch(cmd, 1, nullptr, 0);
    cmd.barrier();
  });
  const auto expect = [&]<class T>(const Buffer<T>& buffer, const T& want) {
    T got{};
    buffer.download(std::span(&got, 1), 1);
    EXPECT_EQ(std::memcmp(&got, &want, sizeof(T)), 0) << buffer.name();
  };
  expect(rays, Ray{{1, 2, 3}, 4, {5, 6, 7}, 8});
  expect(hits, Hit{1, 2, 3, 4});
  expect(nodes, BvhNode{{1, 2, 3}, {4, 5, 6}, 7, 8});
  expect(film, FilmPixel{{1, 2, 3}, 4, 5, {6, 7, 8}, 9});
}

// Buffers of some sizes are allocated larger than requested (steady_size() in engine/gpu/buffer.cpp). Kernels must see
// the requested size, up to the largest that a buffer may have.
TEST_F(Vulkan, KernelsSeeWhatABufferWasMadeFor) {
  Kernel kernel(*gpu_, source("length.comp"));
  Buffer<std::uint32_t> seen(*gpu_, 4, Access::Storage, "seen");
  kernel.bind(1, seen);
  const std::uint64_t most = std::min<std::uint64_t>(gpu_->info().max_storage_range / 16 * 16, 1ull << 28);
  for (const std::uint64_t bytes : {16ull, 240ull, 256ull, 1000ull, 65536ull, 65792ull, 1ull << 20, most + 0ull}) {
    Buffer<std::uint32_t> numbers(*gpu_, bytes / 4, Access::Storage, "numbers");
    kernel.bind(0, numbers);
    gpu_->submit("length", [&](Commands& cmd) {
      kernel.dispatch(cmd, 1, nullptr, 0);
      cmd.barrier();
    });
    std::uint32_t length = 0;
    seen.download(std::span(&length, 1));
    EXPECT_EQ(length, bytes / 4);
  }
}

TEST_F(Vulkan, KernelsCheckTheirBindings) {
  Kernel kernel(*gpu_, source("records.comp"));
  Buffer<Ray> rays(*gpu_, 2, Access::Storage, "rays");
  EXPECT_NE(error_of([&] { kernel.bind(9, rays); }).find("kernel records.comp has no binding 9 for buffer 'rays'"),
            std::string::npos);
  kernel.bind(0, rays);
  const std::string missing =
      error_of([&] { gpu_->submit("records", [&](Commands& cmd) { kernel.dispatch(cmd, 1, nullptr, 0); }); });
  EXPECT_NE(missing.find("dispatched without binding 1"), std::string::npos) << missing;
}

TEST_F(Vulkan, PushConstantsMustHaveTheShadersSize) {
  Buffer<Ray> rays(*gpu_, 64, Access::Storage, "rays");
  Kernel kernel(*gpu_, primary_source(false, {.perspective = true}));
  kernel.bind(BIND_RAYS, rays);
  const std::uint32_t small = 0;
  const std::string text =
      error_of([&] { gpu_->submit("rays", [&](Commands& cmd) { kernel.dispatch(cmd, 1, small); }); });
  EXPECT_NE(text.find(fmt::format("wants {} bytes of push constants, not 4", sizeof(PrimaryPush))), std::string::npos)
      << text;
}

TEST_F(Vulkan, ABrokenShaderNamesFileAndLine) {
  const std::string text = error_of([&] { Kernel kernel(*gpu_, source("broken.comp")); });
  EXPECT_NE(text.find("broken.comp:4"), std::string::npos) << text;
  EXPECT_NE(text.find("does_not_exist"), std::string::npos) << text;
  EXPECT_NE(error_of([&] { Kernel kernel(*gpu_, source("absent.comp")); }).find("absent.comp"), std::string::npos);
}

// A persistent kernel must not rely on loops where the driver cuts them short. The tuning table limits its batches
// there. A loop that was cut shows in every loop behind it, which is how kernels notice (lib/frame/cut_loops.glsl).
TEST_F(Vulkan, TheTuningTableKnowsDriversThatCutLoops) {
  Kernel kernel(*gpu_, source("long_loop.comp"));
  Buffer<std::uint32_t> data(*gpu_, 4, Access::Storage, "loop");
  kernel.bind(0, data);
  const std::vector<std::uint32_t> in{100000, 0, 2, 0};
  data.upload(in);
  gpu_->submit("long loop", [&](Commands& cmd) {
    kernel.dispatch(cmd, 1, nullptr, 0);
    cmd.barrier();
  });
  std::vector<std::uint32_t> out(4);
  data.download(out);
  const KernelConfig f = kernel_config_for(kMethods[0], find_numeric(kDefaultNumeric), gpu_->info());
  EXPECT_TRUE(out[1] == 100000 || (f.batches <= 16u && f.loops_cut))
      << "the driver ran " << out[1] << " of 100000 iterations";
  EXPECT_EQ(out[1] == 100000, out[3] == 2) << "the driver ran " << out[3] << " of 2 iterations behind them";
}

/// Gives each test a cache folder of its own.
class ShaderCache : public testing::Test {
 protected:
  const test::TemporaryFolder kept_;
  const fs::path folder_ = kept_.path();
  const test::Variable cache_{"XDG_CACHE_HOME", folder_.string()};
  /// The files of the SPIR-V cache.
  std::vector<fs::path> files() const {
    std::vector<fs::path> all;
    for (const auto& e : fs::directory_iterator(folder_ / "ballot" / "spirv")) all.push_back(e.path());
    return all;
  }
};

TEST_F(ShaderCache, IsKeyedByContentAndDefines) {
  const Defines a = shading_source("eyelight", {}).defines, b = shading_source("normals", {}).defines;
  const Spirv cold = compile_shader("shade/shade.comp", a), warm = compile_shader("shade/shade.comp", a);
  EXPECT_FALSE(cold.from_cache);
  EXPECT_TRUE(warm.from_cache);
  EXPECT_EQ(cold.words, warm.words);
  EXPECT_FALSE(compile_shader("shade/shade.comp", b).from_cache);
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(ShaderCache, InlinedModulesHaveFewerFunctionsAndFilesOfTheirOwn) {
  const auto functions = [](const Spirv& spirv) {
    constexpr std::uint32_t kHeader = 5, kOpFunction = 54;
    std::size_t count = 0;
    for (std::size_t at = kHeader; at < spirv.words.size(); at += spirv.words[at] >> 16)
      count += (spirv.words[at] & 0xFFFF) == kOpFunction;
    return count;
  };
  const Defines defines = shading_source("eyelight", {}).defines;
  const auto compile = [&](Calls calls) { return compile_shader("shade/shade.comp", defines, true, calls); };
  const Spirv kept = compile(Calls::Kept), inlined = compile(Calls::Inlined);
  EXPECT_FALSE(inlined.from_cache);
  EXPECT_LT(functions(inlined), functions(kept));
  EXPECT_EQ(compile(Calls::Inlined).words, inlined.words);
  EXPECT_EQ(compile(Calls::Kept).words, kept.words);
  EXPECT_EQ(files().size(), 2u);
}

TEST_F(ShaderCache, InlinedModulesKeepTheirBuffers) {
  for (const Integrator& integrator : kIntegrators) {
    const KernelSource source =
        scatter_source(integrator, {.perspective = true, .orthographic = true}, Sky::Kind::None, false);
    const auto buffers = [&](Calls calls) {
      const Reflection r = reflect(compile_shader(source.file, source.defines, true, calls).words, source.name);
      return std::pair(r.storage_buffers, r.texel_buffers);
    };
    EXPECT_EQ(buffers(Calls::Inlined), buffers(Calls::Kept)) << source.name;
  }
}

TEST_F(ShaderCache, PipelinesAreStoredOnceTheyAreNew) {
  const auto stored = [&] { return fs::directory_iterator(folder_ / "ballot" / "pipelines")->path(); };
  const auto make = [] {
    Context gpu;
    pipeline_of(gpu, shading_source("eyelight", {}));
    gpu.save_pipeline_cache();
  };
  make();
  fs::last_write_time(stored(), fs::file_time_type::clock::now() - std::chrono::hours(1));
  const auto old = fs::last_write_time(stored());
  make();
  EXPECT_EQ(fs::last_write_time(stored()), old);
  fs::resize_file(stored(), fs::file_size(stored()) / 2);
  fs::last_write_time(stored(), old);
  make();
  EXPECT_GT(fs::last_write_time(stored()), old) << "a damaged file is written anew";
}

TEST_F(ShaderCache, ADamagedFileIsCompiledAnew) {
  const Defines a = shading_source("eyelight", {}).defines;
  const Spirv cold = compile_shader("shade/shade.comp", a);
  const fs::path file = files().at(0);
  fs::resize_file(file, fs::file_size(file) / 2);
  EXPECT_FALSE(compile_shader("shade/shade.comp", a).from_cache);
  {
    std::fstream f(file, std::ios::in | std::ios::out | std::ios::binary);
    f.seekp(100);
    f.put('\x55');
  }
  const Spirv again = compile_shader("shade/shade.comp", a);
  EXPECT_FALSE(again.from_cache);
  EXPECT_EQ(again.words, cold.words);
}

TEST_F(ShaderCache, AFolderThatCannotBeWrittenCostsNothingButTime) {
  fs::remove_all(folder_);
  std::ofstream(folder_).put('x');  // a file where the folder should be
  EXPECT_NO_THROW(compile_shader("rays/primary.comp", primary_source(false, {.perspective = true}).defines));
  fs::remove(folder_);
}

}  // namespace
}  // namespace ballot
