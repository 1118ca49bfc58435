// Reads and writes EXR files with OpenEXR 3: scanlines, ZIP compression, channels by name.
#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <set>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/parallel.h"
#include "engine/core/unset.h"
#include "engine/files/exr_header.h"
#include "engine/files/image.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

// Attributes that OpenEXR sets itself: a header where they are set by hand would not be readable.
constexpr std::string_view kReserved[] = {"type", "version", "chunkCount", "tiles", "name"};
// Attributes that every file has. They say nothing about the picture and are not read.
constexpr std::string_view kEveryFile[] = {"type", "name", "pixelAspectRatio", "screenWindowWidth"};

bool is_one_of(std::span<const std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

// OpenEXR swallows exceptions that are thrown while it writes the end of a file. OutputFile::close() reports those
// failures.
class Stream : public Imf::OStream {
 public:
  Stream(OutputFile& file, const std::string& name) : OStream(name.c_str()), file_(file) {}
  void write(const char bytes[], int count) override { file_.write(bytes, static_cast<std::size_t>(count)); }
  std::uint64_t tellp() override { return file_.tell(); }
  void seekp(std::uint64_t position) override { file_.seek(position); }

 private:
  OutputFile& file_;
};

/// Lets OpenEXR use all cores. Compression takes most of the time of writing and runs in blocks of lines.
void use_all_cores() {
  static const int count = std::clamp(int(std::thread::hardware_concurrency()), 1, 16);
  try {
    if (Imf::globalThreadCount() < count) Imf::setGlobalThreadCount(count);
  } catch (const std::exception&) {
    Imf::setGlobalThreadCount(0);  // the system has no threads left; the caller's own does it too
  }
}

Imf::PixelType exr_type(Pixel type) {
  if (type == Pixel::Half) return Imf::HALF;
  return type == Pixel::Float ? Imf::FLOAT : Imf::UINT;
}

void check_image(const fs::path& path, const Image& image, bool with_values = true) {
  const auto stop = [&](const std::string& reason) {
    fail(Failure::Work, "cannot write {}: {}", path.string(), reason);
  };
  constexpr std::uint32_t limit = std::numeric_limits<int>::max() / 2;  // OpenEXR's own
  if (image.width == 0 || image.height == 0 || image.width > limit || image.height > limit) {
    stop(fmt::format("an EXR cannot hold {} x {} pixels", image.width, image.height));
  }
  const std::size_t pixels = std::size_t{image.width} * image.height;
  std::set<std::string> names;
  for (const Channel& channel : image.channels) {
    if (channel.name.empty() || !names.insert(channel.name).second) {
      stop(fmt::format("channel name '{}' is empty or used twice", channel.name));
    }
    const std::size_t values = channel.type == Pixel::Uint ? channel.uints.size() : channel.floats.size();
    if (with_values && values != pixels) {
      stop(fmt::format("channel {} has {} values, expected {} x {}", channel.name, values, image.width, image.height));
    }
  }
  if (image.channels.empty()) stop("the image has no channels");
}

void insert_attribute(Imf::Header& header, const std::string& name, const Attribute& attribute) {
  if (is_one_of(kReserved, name)) throw std::invalid_argument("attribute name '" + name + "' is reserved");
  if (const auto* text = std::get_if<std::string>(&attribute)) {
    header.insert(name, Imf::StringAttribute(*text));
  } else if (const auto* number = std::get_if<float>(&attribute)) {
    header.insert(name, Imf::FloatAttribute(*number));
  } else if (const auto* count = std::get_if<int>(&attribute)) {
    header.insert(name, Imf::IntAttribute(*count));
  } else {
    const auto& m = std::get<std::array<float, 16>>(attribute);
    Imath::M44f matrix;
    std::memcpy(matrix.getValue(), m.data(), sizeof(m));
    header.insert(name, Imf::M44fAttribute(matrix));
  }
}

Imf::Header make_header(const Image& image) {
  const bool part = image.full_width > 0 && image.full_height > 0;
  Imf::Header header(static_cast<int>(part ? image.full_width : image.width),
                     static_cast<int>(part ? image.full_height : image.height));
  if (part) {
    const Imath::V2i lo(static_cast<int>(image.x), static_cast<int>(image.y));
    const Imath::V2i size(static_cast<int>(image.width), static_cast<int>(image.height));
    header.dataWindow() = Imath::Box2i(lo, lo + size - Imath::V2i(1, 1));
  }
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = 1;  // 0.77 times as long as the default, 4, and 3 % more bytes
  for (const Channel& channel : image.channels) {
    header.channels().insert(channel.name, Imf::Channel(exr_type(channel.type)));
  }
  for (const auto& [name, attribute] : image.attributes) insert_attribute(header, name, attribute);
  return header;
}

UnsetVector<half> to_halves(const std::vector<float>& floats) {
  UnsetVector<half> halves(floats.size());
  for_chunks(floats.size(), 1 << 15, [&](std::size_t begin, std::size_t end) {
    std::transform(floats.begin() + std::ptrdiff_t(begin), floats.begin() + std::ptrdiff_t(end),
                   halves.begin() + std::ptrdiff_t(begin),
                   [](float value) { return half(value != value ? value : std::clamp(value, -65504.0f, 65504.0f)); });
  });
  return halves;
}

/// Writes the rows of an image below those that the file has.
void write_rows(Imf::OutputFile& file, const Image& image) {
  Imath::Box2i window = file.header().dataWindow();
  window.min.y = file.currentScanLine();
  window.max.y = window.min.y + static_cast<int>(image.height) - 1;
  std::vector<UnsetVector<half>> halves(image.channels.size());  // alive until writePixels returns
  Imf::FrameBuffer frame;
  for (std::size_t i = 0; i < image.channels.size(); ++i) {
    const Channel& channel = image.channels[i];
    const void* values = channel.floats.data();
    if (channel.type == Pixel::Uint) values = channel.uints.data();
    if (channel.type == Pixel::Half) {
      halves[i] = to_halves(channel.floats);
      values = halves[i].data();
    }
    frame.insert(channel.name, Imf::Slice::Make(exr_type(channel.type), values, window));
  }
  file.setFrameBuffer(frame);
  file.writePixels(static_cast<int>(image.height));
}

/// Returns a text of OpenEXR as the end of a sentence: on one line, without the file's name and its full stop.
std::string tidy_reason(std::string text) {
  if (const auto end = text.find("\". "); text.starts_with("Cannot read image file") && end != std::string::npos)
    text.erase(0, end + 3);
  std::ranges::replace(text, '\n', ' ');
  while (text.ends_with('.') || text.ends_with(' ')) text.pop_back();
  return text;
}

// OpenEXR reads what was checked through the same descriptor: under the file's name there may be another by then.
class Input : public Imf::IStream {
 public:
  Input(std::FILE* file, const std::string& name) : IStream(name.c_str()), file_(file) {}
  bool read(char bytes[], int count) override {
    if (count > 0 && std::fread(bytes, 1, std::size_t(count), file_) != std::size_t(count))
      throw Iex::InputExc("it ends early");
    return true;
  }
  std::uint64_t tellg() override { return std::uint64_t(::ftello(file_)); }
  void seekg(std::uint64_t position) override { ::fseeko(file_, static_cast<off_t>(position), SEEK_SET); }

 private:
  std::FILE* file_;
};

void read_attributes(const Imf::Header& header, Image& image) {
  for (auto it = header.begin(); it != header.end(); ++it) {
    const std::string name = it.name();
    if (is_one_of(kEveryFile, name)) continue;
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute())) {
      image.attributes[name] = text->value();
    } else if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&it.attribute())) {
      image.attributes[name] = number->value();
    } else if (const auto* count = dynamic_cast<const Imf::IntAttribute*>(&it.attribute())) {
      image.attributes[name] = count->value();
    } else if (const auto* matrix = dynamic_cast<const Imf::M44fAttribute*>(&it.attribute())) {
      std::memcpy(image.attributes[name].emplace<std::array<float, 16>>().data(), matrix->value().getValue(),
                  16 * sizeof(float));
    }
  }
}

/// Returns size, channels without values, and attributes.
Image header_of(const Imf::InputFile& file) {
  const Imath::Box2i window = file.header().dataWindow();
  Image image;
  image.width = static_cast<std::uint32_t>(window.max.x - window.min.x + 1);
  image.height = static_cast<std::uint32_t>(window.max.y - window.min.y + 1);
  const Imath::Box2i display = file.header().displayWindow();
  if (display != window && window.min.x >= 0 && window.min.y >= 0 && display.min == Imath::V2i(0, 0)) {
    image.x = static_cast<std::uint32_t>(window.min.x);
    image.y = static_cast<std::uint32_t>(window.min.y);
    image.full_width = static_cast<std::uint32_t>(display.max.x + 1);
    image.full_height = static_cast<std::uint32_t>(display.max.y + 1);
  }
  for (auto it = file.header().channels().begin(); it != file.header().channels().end(); ++it) {
    Channel& channel = image.channels.emplace_back();
    channel.name = it.name();
    channel.type = it.channel().type == Imf::HALF ? Pixel::Half : Pixel::Float;
    if (it.channel().type == Imf::UINT) channel.type = Pixel::Uint;
  }
  read_attributes(file.header(), image);
  return image;
}

Image read_pixels(Imf::InputFile& file) {
  const Imath::Box2i window = file.header().dataWindow();
  Image image = header_of(file);
  const std::size_t pixels = std::size_t{image.width} * image.height;
  Imf::FrameBuffer frame;
  for (Channel& channel : image.channels) {
    const bool uint = channel.type == Pixel::Uint;
    if (uint)
      channel.uints.resize(pixels);
    else
      channel.floats.resize(pixels);
    const void* values = uint ? static_cast<const void*>(channel.uints.data()) : channel.floats.data();
    frame.insert(channel.name, Imf::Slice::Make(uint ? Imf::UINT : Imf::FLOAT, values, window));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

const Channel& Image::channel(const std::string& name) const {
  std::vector<std::string> names;
  for (const Channel& channel : channels) {
    if (channel.name == name) return channel;
    names.push_back(channel.name);
  }
  fail(Failure::Arguments, "the image has no channel '{}'; there are: {}", name, fmt::join(names, ", "));
}

namespace {

/// Writes an EXR with the header of `whole`; `rows` writes its pixels.
void write_file_of(const fs::path& path, const Image& whole, Links links,
                   const std::function<void(Imf::OutputFile&)>& rows) {
  use_all_cores();
  const auto write = [&](OutputFile& out) {
    try {
      Stream stream(out, path.string());
      Imf::OutputFile file(stream, make_header(whole));
      rows(file);
    } catch (const Error&) {
      throw;
    } catch (const std::exception& error) {
      fail(Failure::Work, "cannot write {}: {}", path.string(), error.what());
    }
  };
  write_atomically(path, write, links);
}

bool same_channels(const Image& a, const Image& b) {
  return std::ranges::equal(a.channels, b.channels, [](const Channel& one, const Channel& other) {
    return one.name == other.name && one.type == other.type;
  });
}

}  // namespace

void write_exr(const fs::path& path, const Image& image, Links links) {
  check_image(path, image);
  write_file_of(path, image, links, [&](Imf::OutputFile& file) { write_rows(file, image); });
}

void write_exr_in_bands(const fs::path& path, const Image& whole, const std::function<Image()>& next, Links links) {
  check_image(path, whole, false);
  write_file_of(path, whole, links, [&](Imf::OutputFile& file) {
    for (std::uint32_t rows = 0; rows < whole.height;) {
      const Image band = next();
      check_image(path, band);
      if (band.width != whole.width || band.height > whole.height - rows || !same_channels(band, whole))
        fail(Failure::Work, "cannot write {}: a band of {} x {} pixels does not fit below {} rows of {} x {}",
             path.string(), band.width, band.height, rows, whole.width, whole.height);
      write_rows(file, band);
      rows += band.height;
    }
  });
}

const Channel& channel_in(const fs::path& file, const Image& image, const std::string& name) {
  for (const Channel& channel : image.channels)
    if (channel.name == name && channel.type != Pixel::Uint) return channel;
  fail(Failure::Work, "{}: has no channel {} of half or float; expected a picture with colours", file.string(), name);
}

namespace {

/// Opens an EXR that Ballot can read and returns what `read` makes of it. `whole`: all pixels must fit into the memory
/// that is left.
Image read_file_of(const fs::path& path, bool whole, Image (*read)(Imf::InputFile&)) {
  try {
    const InputStream opened = open_file(path);
    check_exr_header(opened.get(), path, whole, Imf::globalThreadCount());
    std::rewind(opened.get());
    Input stream(opened.get(), path.string());
    Imf::InputFile file(stream);
    return read(file);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::invalid_argument& error) {  // thrown above
    fail(Failure::Work, "cannot read {}: {}", path.string(), error.what());
  } catch (const Iex::BaseExc& error) {
    fail(Failure::Work, "cannot read {}: {}", path.string(), tidy_reason(error.what()));
  } catch (const std::exception&) {  // of a library: its text names a function
    fail(Failure::Work, "cannot read {}: it is damaged; write it again", path.string());
  }
}

}  // namespace

Image read_exr_header(const fs::path& path) {
  return read_file_of(path, false, [](Imf::InputFile& file) { return header_of(file); });
}

Image read_exr(const fs::path& path) { return read_file_of(path, true, read_pixels); }

}  // namespace ballot
