#include "engine/api/values.h"

#include <algorithm>

#include "engine/api/mesh_attributes.h"
#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/gpu/room.h"

namespace ballot::api {

namespace {

constexpr std::size_t kMadeAtOnce = 1 << 20;  // hits whose columns are made at a time

}  // namespace

MadeColumns::MadeColumns(const BallotHits& to, std::span<const WantedValues> values, SceneState& scene,
                         const RowOrder& order, std::size_t count)
    : scene_(scene), order_(order) {
  if (to.colors) to_.push_back({to.colors, 4, COLUMN_COLORS});
  if (to.shading_normals) to_.push_back({to.shading_normals, 3, COLUMN_SHADING_NORMALS});
  for (const WantedValues& v : values) {
    if (std::ranges::count(values, v.attribute, &WantedValues::attribute) > 1)
      refuse(fmt::format("values: attribute '{}' is wanted twice", v.attribute));
    const MeshAttribute* attribute = find_attribute(scene, v.attribute);
    if (!attribute)
      refuse(fmt::format("values: no mesh has an attribute '{}'; there are: {}", v.attribute, attribute_names(scene)));
    to_.push_back({v.data, attribute->components, ALL_COLUMNS, v.attribute});
  }
  if (!to_.empty()) hits_.resize(count);
}

void MadeColumns::add(std::size_t first, std::span<const Hit> hits) {
  copy_parallel(hits, std::span(hits_).subspan(first, hits.size()));
}

void MadeColumns::end(TraceTimes& times) {
  if (hits_.empty()) return;
  Context& gpu = *scene_.device->gpu;
  const PassScope scope(gpu);
  std::vector<Buffer<float>> there;
  for (const Column& c : to_)
    there.emplace_back(gpu, std::min(hits_.size(), kMadeAtOnce) * c.width, Access::Storage | Access::Host,
                       "values of hits");
  for (std::size_t first = 0; first < hits_.size(); first += kMadeAtOnce) {
    end_part(first, std::min(kMadeAtOnce, hits_.size() - first), there, times);
    check_interruption();
  }
}

void MadeColumns::end_part(std::size_t first, std::size_t count, std::vector<Buffer<float>>& there, TraceTimes& times) {
  Context& gpu = *scene_.device->gpu;
  Buffer<Hit>& found = buffer_for(answers_there(scene_).valued, gpu, count, "hits with values");
  found.upload(std::span(hits_).subspan(first, count));
  Targets targets;
  for (std::size_t k = 0; k < to_.size(); ++k)
    if (to_[k].column == ALL_COLUMNS)
      targets.values.push_back({to_[k].attribute, &there[k]});
    else
      targets.columns[to_[k].column] = &there[k];
  record_columns(scene_, {.found = found, .count = count}, targets, [&](double ms) { times.device_ms += ms; });
  gpu.finish();
  std::vector<float> read;
  for (std::size_t k = 0; k < to_.size(); ++k) {
    const std::size_t width = to_[k].width;
    read.resize(count * width);
    there[k].download(read);
    for_chunks(count, 1 << 13, [&](std::size_t begin, std::size_t end) {
      order_.for_runs(first + begin, end - begin, [&](std::size_t i, std::size_t place, std::size_t n) {
        std::copy_n(&read[(begin + i) * width], n * width, to_[k].data + place * width);
      });
    });
  }
}

}  // namespace ballot::api
