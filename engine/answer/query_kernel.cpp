#include "engine/answer/query_kernel.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "engine/answer/attributes.h"
#include "engine/answer/crossing_kernels.h"
#include "engine/answer/lists.h"
#include "engine/answer/made_questions.h"
#include "engine/answer/point_parts.h"
#include "engine/answer/sums_there.h"
#include "engine/core/interruption.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

/// Returns the variant whose kernel configuration query kernels take.
Variant variant_for(const DeviceInfo& device, bool wide, const OwnText& own = {}) {
  const Method& method = find_method(wide ? "bvh8" : "while-while");
  const NumericMode& numeric = find_numeric(own.numeric);
  Knobs knobs = {{"launch", "plain"}};
  if (own.included) knobs["stack"] = "private";  // shared memory is the program's
  return {&method, &numeric, Want::Nearest, kernel_config_for(method, numeric, device, knobs)};
}

/// The same for a tree whose arrays may need another way to read them.
Variant variant_for(const DeviceInfo& device, bool wide, const OwnText& own, const DeviceTree& tree) {
  Variant variant = variant_for(device, wide, own);
  variant.config.fetch = tree.fitting_fetch(variant.config.fetch);
  return variant;
}

/// Returns the source of a kernel that is a variant of these. Rays that ask for crossings often begin behind their
/// origins, where minima of integers cull no box (shaders/lib/numeric/box.glsl).
KernelSource source_of(const std::string& name, Variant variant, const DeviceInfo& device, const TreeFacts& tree,
                       const Defines& defines) {
  if (name == "crossings" && variant.config.minmax == MinMax::Integer) variant.config.minmax = MinMax::Builtin;
  KernelSource source = kernel_source(variant, device, tree);
  source.file = "query/" + name + ".comp";
  source.name = "query." + name + (tree.far ? " far=1" : "") + (tree.top_depth ? " instances=1" : "") +
                (tree.large ? " large=1" : "") + (tree.shapes ? fmt::format(" shapes={}", tree.shapes) : "");
  for (const auto& [define, value] : defines) {
    source.name += fmt::format(" {}={}", define, value);
    source.defines.emplace_back(define, value);
  }
  return source;
}

void take_text(KernelSource& source, const OwnText& own) {
  if (!own.text.empty()) source.text = own.text, source.name = own.name, source.robust = true;
  if (!own.included) return;
  source.defines.emplace_back("CALLED_STACK", source.constants.at(SPEC_STACK_SIZE));
  const auto top = source.constants.find(SPEC_TOP_STACK);
  if (top != source.constants.end()) source.defines.emplace_back("CALLED_TOP_STACK", top->second);
  source.constants.clear();
}

constexpr std::uint64_t kFewOnCpu = 64;  // invocations of a user's text, which may take long

const BuildSettings kWhole{.builder = BuilderId::Balanced};

/// Returns true if some triangle lies in several leaves.
bool has_splits(const Bvh& bvh) { return bvh.stats.references + bvh.stats.degenerate != bvh.stats.triangles; }

}  // namespace

bool is_made_from(const KernelSource& a, const KernelSource& b) {
  return a.defines == b.defines && a.constants == b.constants;
}

KernelSource query_source(const std::string& name, const DeviceInfo& device, const TreeFacts& tree,
                          const Defines& defines, bool wide) {
  return source_of(name, variant_for(device, wide), device, tree, defines);
}

KernelSource own_source(const std::string& name, const DeviceInfo& device, const TreeFacts& tree,
                        const Defines& defines, const OwnText& own) {
  KernelSource source = source_of(name, variant_for(device, false, own), device, tree, defines);
  take_text(source, own);
  return source;
}

std::vector<KernelSource> query_sources(const DeviceInfo& device) {
  std::vector<KernelSource> sources;
  const TreeFacts near{.depth = 32, .largest_leaf = MAX_LEAF_TRIANGLES};
  TreeFacts far = near, instances = near;
  far.far = true;
  instances.top_depth = 24;
  for (const TreeFacts& tree : {near, far, instances}) {
    const Defines closest[] = {{{"BALLOT_SIDES", 0}, {"BALLOT_FILTERS", 0}},
                               {{"BALLOT_SIDES", 1}, {"BALLOT_FILTERS", 0}},
                               {{"BALLOT_SIDES", 0}, {"BALLOT_FILTERS", 1}},
                               {{"BALLOT_SIDES", 0}, {"BALLOT_FILTERS", 6}}};
    for (Defines defines : closest)
      for (const int blocks : {0, 1}) {
        defines.resize(2);
        defines.emplace_back("BALLOT_BLOCKS", blocks);
        sources.push_back(query_source("closest_point", device, tree, defines));
      }
    for (const int exact : {0, 1})
      for (const int listed : {0, 1})
        if (!listed || !tree.top_depth)
          sources.push_back(query_source("inside", device, tree, {{"BALLOT_EXACT", exact}, {"BALLOT_LISTED", listed}}));
    for (const std::uint32_t lists : {LISTS_NONE, LISTS_ROWS, LISTS_PLACES})
      for (const int filters : {0, 1, 6})
        for (const char* name : {"within", "overlap"})
          sources.push_back(
              query_source(name, device, tree, {{"BALLOT_LISTS", int(lists)}, {"BALLOT_FILTERS", filters}}));
    for (KernelSource& source : crossing_sources(device, tree)) sources.push_back(std::move(source));
    if (tree.top_depth) continue;
    sources.push_back(query_source("cells", device, tree, {{"BALLOT_EXACT", 0}}));
    sources.push_back(query_source("winding", device, tree));
  }
  for (KernelSource& source : column_sources()) sources.push_back(std::move(source));
  for (KernelSource& source : value_sources()) sources.push_back(std::move(source));
  for (KernelSource& source : sum_sources()) sources.push_back(std::move(source));
  sources.push_back(look_up_source());
  for (KernelSource& source : neighbour_sources()) sources.push_back(std::move(source));
  for (KernelSource& source : making_sources()) sources.push_back(std::move(source));
  for (const int of : {PLACES_LISTS, PLACES_APPENDED, PLACES_HITS}) sources.push_back(places_source(of));
  for (const std::uint32_t words : {2u, 4u})
    for (const bool of_long : {false, true}) sources.push_back(order_source(words, of_long));
  for (const bool widens : {false, true}) sources.push_back(pick_source(widens));
  return sources;
}

QueryKernel::QueryKernel(Context& gpu, DeviceTree& tree, std::string name, Defines defines, bool wide,
                         SpecConstants constants, OwnText own)
    : gpu_(gpu),
      tree_(tree),
      name_(std::move(name)),
      defines_(std::move(defines)),
      wide_(wide),
      constants_(std::move(constants)),
      own_(std::move(own)),
      numeric_(find_numeric(own_.numeric)),
      config_(variant_for(gpu.info(), wide, own_, tree).config),
      work_(gpu, 1, Access::Storage, "query work counter"),
      size_(own_.text.empty() ? LaunchSize() : LaunchSize(gpu.info().is_cpu() ? kFewOnCpu : LaunchSize::kLeast)) {}

std::uint32_t QueryKernel::most() const {
  return std::uint32_t(
      std::min<std::uint64_t>(std::uint64_t(gpu_.info().max_group_count_x) * config_.workgroup, 1u << 22));
}

void QueryKernel::prepare() {
  const Variant variant = variant_for(gpu_.info(), wide_, own_, tree_);
  KernelSource source_now = source_of(name_, variant, gpu_.info(), tree_.facts(), defines_);
  source_now.constants.insert(constants_.begin(), constants_.end());
  take_text(source_now, own_);
  const bool fresh = refresh(gpu_, kernel_, source_now);
  if (!fresh && generation_ == tree_.generation()) return;
  // The kernel is compiled for facts of the tree: another depth needs another stack size.
  if (!fresh && !is_made_from(source_, source_now)) kernel_ = std::make_unique<Kernel>(gpu_, source_now);
  source_ = std::move(source_now);
  config_ = variant.config;
  // Walks that the driver cut short are repeated from nodes that the host knows.
  const Source source =
      config_.loops_cut || wide_ ? Source::Host : tree_.source_of(TreeFormatId::Pair, numeric_.leaves);
  const TreeFormatId format = wide_ ? TreeFormatId::Bvh8 : TreeFormatId::Pair;
  arrays_ = {tree_, {format, numeric_.leaves, config_.tree_access(), !wide_, source}};
  arrays_.bind(*kernel_, config_.fetch);
  if (kernel_->wants(BIND_WORK)) kernel_->bind(BIND_WORK, work_);
  if (kernel_->wants(BIND_HITS)) kernel_->bind(BIND_HITS, work_);  // for kernels that write no hits
  generation_ = tree_.generation();
  gpu_.save_pipeline_cache();
}

void QueryKernel::bind_pushes(const TreePiece& from) {
  const TracePushes pushes = arrays_.pushes(tree_, from);
  if (!pushed_) pushed_.emplace(gpu_, 1, Access::Uniform, "what calls of a scene know of it");
  TracePushes before;
  pushed_->download(std::span(&before, 1));
  if (std::memcmp(&before, &pushes, sizeof pushes) != 0) pushed_->upload(std::span(&pushes, 1));
  kernel_->bind(BIND_PUSHED, *pushed_);
}

double QueryKernel::launch_ms() const { return gpu_.launch_ms() > 0 ? gpu_.launch_ms() : kInterruptibleLaunch; }

bool QueryKernel::can_record(std::uint32_t count) const {
  return gpu_.batches() && !config_.loops_cut && count <= most() && size_.is_known() &&
         count <= size_.most(launch_ms());
}

void QueryKernel::record(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times) {
  TracePushes pushes = arrays_.pushes(tree_, from);
  pushes.trace.ray_begin = first;
  pushes.trace.ray_end = first + count;
  gpu_.pass(
      kernel_->name(),
      [&](Commands& cmd) { kernel_->dispatch(cmd, groups_of(count, config_.workgroup), &pushes, push_bytes(tree_)); },
      [this, count, &times](double ms) {
        size_.add(count, ms);
        times.device_ms += ms;
        tree_.walked_s() += ms * 1e-3;
      });
  ++times.dispatches;
}

std::uint32_t QueryKernel::answer(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times,
                                  const std::function<void(std::uint32_t)>& launched) {
  if (!can_record(count)) return run(first, count, from, times, launched);
  record(first, count, from, times);
  return 0;
}

std::uint32_t QueryKernel::run(std::uint32_t first, std::uint32_t count, const TreePiece& from, TraceTimes& times,
                               const std::function<void(std::uint32_t)>& launched) {
  TracePushes pushes = arrays_.pushes(tree_, from);
  TracePush& push = pushes.trace;
  Work work{0, 0};
  if (config_.loops_cut) work_.upload(std::span(&work, 1));
  const double target_ms = launch_ms();
  for (std::uint32_t done = 0; done < count;) {
    const auto some = std::uint32_t(std::min<std::uint64_t>(count - done, size_.most(target_ms)));
    push.ray_begin = first + done;
    push.ray_end = push.ray_begin + some;
    gpu_.submit(kernel_->name(), [&](Commands& cmd) {
      kernel_->dispatch(cmd, groups_of(some, config_.workgroup), &pushes, push_bytes(tree_));
    });
    size_.add(some, gpu_.last_ms());
    times.device_ms += gpu_.last_ms();
    tree_.walked_s() += gpu_.last_ms() * 1e-3;
    ++times.dispatches;
    done += some;
    check_interruption();
    if (launched) launched(done);
  }
  if (config_.loops_cut) work_.download(std::span(&work, 1));
  return work.unfinished;
}

/// Makes a forest of the same instances, whose meshes have no spatial splits.
std::unique_ptr<Forest> WholeTree::whole_forest(const Forest& scene) {
  std::vector<MeshTree> meshes = scene.meshes();
  for (MeshTree& mesh : meshes)
    if (has_splits(*mesh.bvh)) mesh = make_mesh_tree(mesh.triangles, build_bvh(mesh.triangles, kWhole));
  std::vector<Placement> placements;
  InstanceNumbers numbers;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    placements.push_back({scene.mesh_of(i), scene.transforms()[i], kMeetsAll, scene.group_of(i)});
    numbers.prims.push_back(scene.first_of(i));
  }
  numbers.prims.push_back(std::uint32_t(scene.triangle_count()));
  return std::make_unique<Forest>(std::move(meshes), placements, std::move(numbers));
}

bool WholeTree::update() {
  if (generation_ == scene_.generation()) return false;
  const Forest* scene = scene_.forest();
  if (forest_ && scene && scene->exchanges() == exchanges_) {
    own_->move_instances(scene->transforms());
    generation_ = scene_.generation();
    return false;
  }
  dropped_ = dropped_ || own_;
  own_.reset();
  forest_.reset();
  exchanges_ = scene ? scene->exchanges() : 0;
  if (has_splits(scene_.bvh())) {
    ask_interruption();
    scene_.bring_triangles();  // and nodes: they stay on the host
  }
  if (scene && has_splits(scene_.bvh())) {
    forest_ = whole_forest(*scene);
    own_ = std::make_unique<DeviceTree>(gpu_, *forest_);
  } else if (has_splits(scene_.bvh())) {
    bvh_ = build_bvh(scene_.triangles(), kWhole);
    own_ = std::make_unique<DeviceTree>(gpu_, bvh_, scene_.triangles(), facts_of(bvh_));
  }
  generation_ = scene_.generation();  // last: a call that fails is followed by one that tries again
  return std::exchange(dropped_, false) || own_;
}

}  // namespace ballot
