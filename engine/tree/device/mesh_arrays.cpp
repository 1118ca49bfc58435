#include "engine/tree/device/mesh_arrays.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "engine/core/memory.h"
#include "engine/tree/formats/encoded_cache.h"
#include "engine/tree/formats/remains.h"
#include "engine/tree/host/padding.h"

namespace ballot {

std::uint64_t next_revision() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

void MeshArrays::replace(const Bvh& bvh, std::span<const Triangle> triangles, std::shared_ptr<DeviceBuild> built) {
  coming_.clear();
  pairs_.clear();
  spare_pairs_.clear();
  shapes_.clear();
  padded_boxes_.clear();
  root_.reset();
  cache_.clear();
  has_changed_ = bvh_ != nullptr;
  refer(bvh, triangles);
  host_.reset();
  built_ = std::move(built);
  has_moved_ = false;
  revision_ = next_revision();
}

void MeshArrays::moved(const Bvh& bvh, std::span<const Triangle> triangles) {
  coming_.clear();
  spare_pairs_ = std::exchange(pairs_, {});
  padded_boxes_.clear();
  cache_.clear();
  refer(bvh, triangles);
  host_.reset();
  has_moved_ = has_changed_ = true;
  revision_ = next_revision();
}

MeshArrays::Kept& MeshArrays::kept(NodeLayout layout, Padding padding) {
  const auto key = std::pair(layout, padding);
  if (const auto found = pairs_.find(key); found != pairs_.end()) return found->second;
  const Bvh& bvh = whole_bvh();
  if (padding == Padding::Tree && padded_boxes_.empty()) padded_boxes_ = padded_boxes(bvh, triangles_);
  const std::span<const Bounds> boxes = padding == Padding::Tree ? padded_boxes_ : std::span<const Bounds>();
  PairTree room;
  if (auto spare = spare_pairs_.extract(key)) room = std::move(spare.mapped().tree);
  PairTree made = encode_pairs(bvh, triangles_, layout, boxes, std::move(room));
  root_ = made.root;
  return pairs_.emplace(key, Kept{std::move(made)}).first->second;
}

MeshArrays::Kept& MeshArrays::any_kept() {
  return pairs_.empty() ? kept(NodeLayout::Interleaved, Padding::Ray) : pairs_.begin()->second;
}

std::uint32_t MeshArrays::root() {
  if (built_) return built_->built().root;
  return root_ ? *root_ : any_kept().tree.root;
}

void MeshArrays::let_go() {
  const auto runs = [](const auto& coming) {
    return coming.second.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
  };
  if (has_changed_ || std::ranges::any_of(coming_, runs)) return;
  std::erase_if(pairs_, [](const auto& pairs) { return !pairs.second.lent; });
  padded_boxes_ = {};
}

bool MeshArrays::may_go() const {
  constexpr std::size_t kLeast = 1 << 12;  // smaller ones are not worth the way
  return host_ && !has_changed_ && triangles_.size() >= kLeast && host_->copy->may_go();
}

void MeshArrays::let_host_go(const std::function<std::vector<glm::uvec4>()>& leaves) {
  const HostMesh host = *host_;
  if (built_) {
    host.copy->is_elsewhere([built = built_, to = host.triangles] { built->triangles().download(to); });
  } else {
    host.copy->is_elsewhere([host, leaves, remains = remains_of(*host.bvh, host.triangles)] {
      restore(remains, leaves(), *host.bvh, host.triangles);
    });
    release_pages(std::as_bytes(std::span(host.bvh->nodes)));
    release_pages(std::as_bytes(std::span(host.bvh->references)));
  }
  release_pages(std::as_bytes(host.triangles));
}

void MeshArrays::prepare(const NodesKey& key) {
  const TreeFormat& row = format_of(key.id);
  if (!row.collapsed() || coming_.contains(key)) return;
  const PairTree& from = kept(key.layout, key.padding).tree;
  coming_.emplace(key, std::async(std::launch::async, [&row, &from, cache = cache_] {
                    return encode_cached(row, from, FRONTIER_NODES, cache);
                  }));
}

Encoded MeshArrays::encode(const NodesKey& key) {
  if (auto coming = coming_.extract(key)) return Encoded(coming.mapped().get());
  const PairTree& from = kept(key.layout, key.padding).tree;
  if (key.id == TreeFormatId::Pair) return Encoded(std::span(from.nodes));
  return Encoded(encode_cached(format_of(key.id), from, FRONTIER_NODES, cache_));
}

Encoded MeshArrays::encode(const LeavesKey& key) {
  const PairTree& from = any_kept().tree;
  if (key.format == LeafFormat::Affine) return Encoded(make_affine_leaves(from));
  return Encoded(std::span(from.leaves));
}

std::size_t MeshArrays::pair_texels(NodeLayout layout) const {
  return std::size_t(built_->built().pairs) * PAIR_TEXELS(std::uint32_t(layout));
}

std::size_t MeshArrays::texels(const NodesKey& key, const BufferPart& pairs) {
  if (key.id == TreeFormatId::Pair) return pair_texels(key.layout);
  if (!format_of(key.id).collapsed()) return std::size_t(FRONTIER_NODES) * 2 * FRONTIER_OCTANTS;
  if (root() == END_OF_TREE) return 0;
  auto shape = shapes_.find(key);
  if (shape == shapes_.end()) shape = shapes_.emplace(key, built_->collapse(key.id, pairs)).first;
  return built_->encoder(key.id).texels(shape->second);
}

void MeshArrays::write_format(const NodesKey& key, const BufferPart& pairs, const BufferPart& to) {
  if (!format_of(key.id).collapsed())
    built_->write_frontier(key.layout, pairs, FRONTIER_NODES, to);
  else if (root() != END_OF_TREE)
    built_->encoder(key.id).write(shapes_.at(key), pairs, to);
}

}  // namespace ballot
