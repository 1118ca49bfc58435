#include "engine/gpu/shader.h"

#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <spirv-tools/optimizer.hpp>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "engine/core/cache_file.h"
#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/shader_texts.h"

namespace ballot {

namespace {

namespace fs = std::filesystem;

constexpr int kCacheVersion = 3;  // raise it when the options of the compiler below change

/// Returns the text of a shader: of a file or, for a relative path, of the texts inside the program.
std::string read_text(const fs::path& path) {
  if (path.is_relative()) {
    const std::string name = path.generic_string();
    const auto found = std::find_if(kShaderTexts, kShaderTexts + kShaderTextCount,
                                    [&](const ShaderText& s) { return s.file == name; });
    if (found == kShaderTexts + kShaderTextCount) fail(Failure::Work, "there is no shader {}", path.string());
    return std::string(found->text);
  }
  const auto bytes = read_file(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Resolves #include "x" relative to the file that includes it.
class Includer : public glslang::TShader::Includer {
 public:
  IncludeResult* includeLocal(const char* header, const char* includer, size_t) override {
    const fs::path path = (fs::path(includer).parent_path() / header).lexically_normal();
    try {
      auto* text = new std::string(read_text(path));
      return new IncludeResult(path.string(), text->data(), text->size(), text);
    } catch (const Error&) {
      return nullptr;  // glslang reports file and line of the #include
    }
  }
  void releaseInclude(IncludeResult* result) override {
    if (!result) return;
    delete static_cast<std::string*>(result->userData);
    delete result;
  }
};

struct GlslangProcess {
  GlslangProcess() { glslang::InitializeProcess(); }
  ~GlslangProcess() { glslang::FinalizeProcess(); }
};

/// Returns the limits that shaders may assume at compile time. The limits of the device are checked where they matter.
TBuiltInResource compile_limits() {
  TBuiltInResource r{};
  r.maxDrawBuffers = 8;
  r.maxComputeWorkGroupCountX = r.maxComputeWorkGroupCountY = r.maxComputeWorkGroupCountZ = 65535;
  r.maxComputeWorkGroupSizeX = r.maxComputeWorkGroupSizeY = 1024;
  r.maxComputeWorkGroupSizeZ = 64;
  r.limits.nonInductiveForLoops = r.limits.whileLoops = r.limits.doWhileLoops = true;
  r.limits.generalUniformIndexing = r.limits.generalAttributeMatrixVectorIndexing = true;
  r.limits.generalVaryingIndexing = r.limits.generalSamplerIndexing = true;
  r.limits.generalVariableIndexing = r.limits.generalConstantMatrixVectorIndexing = true;
  return r;
}

std::string preamble_of(const Defines& defines) {
  std::string text;
  for (const auto& [name, value] : defines) text += fmt::format("#define {} {}\n", name, value);
  return text;
}

/// Returns the stage by the file's extension: .vert, .frag, else compute.
EShLanguage stage_of(const fs::path& file) {
  if (file.extension() == ".vert") return EShLangVertex;
  if (file.extension() == ".frag") return EShLangFragment;
  return EShLangCompute;
}

struct ParsedShader {
  EShLanguage stage;
  std::string path, text, preamble;
  const char* text_pointer;
  const char* path_pointer;
  glslang::TShader shader;

  ParsedShader(const fs::path& file, const Defines& defines, const GivenText& given)
      : stage(stage_of(file)),
        path(file.string()),
        text(given.text.empty() ? read_text(file) : given.text),
        preamble(preamble_of(defines)),
        text_pointer(text.c_str()),
        path_pointer(path.c_str()),
        shader(stage) {
    shader.setStringsWithLengthsAndNames(&text_pointer, nullptr, &path_pointer, 1);
    shader.setPreamble(preamble.c_str());
    shader.setEnvInput(glslang::EShSourceGlsl, stage, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_2);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_5);
  }
};

constexpr EShMessages kMessages = EShMessages(EShMsgSpvRules | EShMsgVulkanRules);

/// Returns the names that the #include lines of a text give, those of branches that are not taken too.
std::vector<std::string_view> includes_of(std::string_view text) {
  constexpr std::string_view kStart = "#include \"";
  std::vector<std::string_view> names;
  for (std::size_t at = text.find(kStart); at != text.npos; at = text.find(kStart, at)) {
    at += kStart.size();
    const std::size_t end = text.find('"', at);
    if (end != text.npos) names.push_back(text.substr(at, end - at));
  }
  return names;
}

/// Returns the texts of a file and of all files that it may include, each once. Reading them takes less than a
/// millisecond; preprocessing them took 2 to 10, and 80 the first time.
std::string with_includes(const fs::path& file, const GivenText& given) {
  std::vector<fs::path> files{file.lexically_normal()};
  std::string all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::string text;
    try {
      text = i == 0 && !given.text.empty() ? given.text : read_text(files[i]);
    } catch (const Error&) {
      if (i == 0) throw;  // the compiler names the #include of another, if it is taken
    }
    for (const std::string_view name : includes_of(text)) {
      fs::path path = (files[i].parent_path() / name).lexically_normal();
      if (std::ranges::find(files, path) == files.end()) files.push_back(std::move(path));
    }
    all += fmt::format("{}\n{}", text.size(), text);
  }
  return all;
}

void start_compiler() { static const GlslangProcess process; }

std::vector<std::uint32_t> compile(const fs::path& file, const Defines& defines, const GivenText& given) {
  start_compiler();
  ParsedShader source(file, defines, given);
  const std::string named = given.text.empty() ? "shader " + file.string() : given.named;
  Includer includer;
  const TBuiltInResource limits = compile_limits();
  if (!source.shader.parse(&limits, 460, ENoProfile, false, false, kMessages, includer))
    fail(Failure::Work, "{} does not compile:\n{}", named, source.shader.getInfoLog());
  glslang::TProgram program;
  program.addShader(&source.shader);
  if (!program.link(kMessages)) fail(Failure::Work, "{} does not link:\n{}", named, program.getInfoLog());
  std::vector<unsigned int> words;
  glslang::SpvOptions options;
  options.disableOptimizer = true;
  glslang::GlslangToSpv(*program.getIntermediate(source.stage), words, &options);
  return {words.begin(), words.end()};
}

/// Returns a module with its functions inlined, and without loads of what was just stored; or as it is if that fails.
/// None of these passes folds or reorders arithmetic. Pass ssa-rewrite (phi nodes) is left out: it makes lavapipe's
/// code up to 12 % larger (22.3.6).
std::vector<std::uint32_t> inlined(const std::vector<std::uint32_t>& words) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  optimizer.SetMessageConsumer([](auto...) {});
  optimizer.RegisterPass(spvtools::CreateInlineExhaustivePass())
      .RegisterPass(spvtools::CreateEliminateDeadFunctionsPass())
      .RegisterPass(spvtools::CreateLocalSingleBlockLoadStoreElimPass())
      .RegisterPass(spvtools::CreateLocalSingleStoreElimPass())
      .RegisterPass(spvtools::CreateAggressiveDCEPass(true));  // buffers stay, as kernels bind them
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);
  std::vector<std::uint32_t> result;
  return optimizer.Run(words.data(), words.size(), &result, options) ? result : words;
}

std::string cache_key(const std::string& texts, const Defines& defines, Calls calls) {
  const glslang::Version v = glslang::GetVersion();
  const std::string all = fmt::format("{} {} {}.{}.{}{}\n", kCacheVersion, preamble_of(defines), v.major, v.minor,
                                      v.patch, calls == Calls::Inlined ? " inlined" : "") +
                          texts;
  const XXH128_hash_t hash = XXH3_128bits(all.data(), all.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

/// Loads a cached module. A file holds the words and then their hash. Returns nothing if it is missing, truncated or
/// damaged.
std::vector<std::uint32_t> load_cached(const fs::path& path) {
  const auto bytes = read_cache(path);
  if (!bytes) return {};
  std::uint64_t hash = 0;
  const bool whole = bytes->size() >= 28 && bytes->size() % 4 == 0;
  if (whole) std::memcpy(&hash, bytes->data() + bytes->size() - 8, 8);
  if (!whole || hash != XXH3_64bits(bytes->data(), bytes->size() - 8)) {
    say_damaged_cache(path);
    return {};
  }
  std::vector<std::uint32_t> words(bytes->size() / 4 - 2);
  std::memcpy(words.data(), bytes->data(), words.size() * 4);
  return words;
}

void store_cached(const fs::path& path, std::vector<std::uint32_t> words) {
  const std::uint64_t hash = XXH3_64bits(words.data(), words.size() * 4);
  words.resize(words.size() + 2);
  std::memcpy(&words[words.size() - 2], &hash, 8);
  write_cache(path, std::as_bytes(std::span(words)));
}

}  // namespace

fs::path shader_folder() {
  std::error_code error;
  const auto holds_shaders = [&](const fs::path& folder) { return fs::exists(folder / "shared/layout.h", error); };
  if (const char* given = std::getenv("BALLOT_SHADERS")) {
    if (!holds_shaders(given))
      fail(Failure::Work, "BALLOT_SHADERS: {} holds no shared/layout.h; expected a copy of the folder shaders", given);
    return fs::absolute(given);
  }
  const fs::path source = BALLOT_SOURCE_SHADERS;
  return program_lies_in(source.parent_path()) && holds_shaders(source) ? source : fs::path();
}

std::string preprocessed_shader(const std::string& file, const Defines& defines, const GivenText& given) {
  start_compiler();
  ParsedShader source(shader_folder() / file, defines, given);
  Includer includer;
  const TBuiltInResource limits = compile_limits();
  std::string text;
  if (!source.shader.preprocess(&limits, 460, ENoProfile, false, false, kMessages, &text, includer))
    fail(Failure::Work, "{} does not pass the preprocessor:\n{}", given.named, source.shader.getInfoLog());
  return text;
}

std::string texts_of(const std::string& file) { return with_includes(shader_folder() / file, {}); }

Spirv compile_shader(const std::string& file, const Defines& defines, bool use_cache, Calls calls,
                     const GivenText& given) {
  const Timer timer;
  const fs::path path = shader_folder() / file;
  const fs::path cached = cache_folder() / "spirv" / (cache_key(with_includes(path, given), defines, calls) + ".spv");
  Spirv result;
  if (use_cache) result.words = load_cached(cached);
  result.from_cache = !result.words.empty();
  if (!result.from_cache) {
    result.words = compile(path, defines, given);
    if (calls == Calls::Inlined) result.words = inlined(result.words);
    if (use_cache) store_cached(cached, result.words);
  }
  result.ms = timer.ms();
  return result;
}

}  // namespace ballot
