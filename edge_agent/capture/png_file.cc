#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "edge_agent/capture/image_codec.h"
#include "edge_agent/capture/image_file.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr size_t kMaxChunk_bytes = size_t{8} << 20;

void keepError(png_structp png, png_const_charp message) {
  char* text = static_cast<char*>(png_get_error_ptr(png));
  std::snprintf(text, 128, "%s", message);
  png_longjmp(png, 1);
}

void ignoreWarning(png_structp, png_const_charp) {}

// libpng leaves its functions by longjmp. So each call into it sits in a method of its own that has no local with a
// destructor, and all memory is owned by this object, outside of the jump.
class PngReader {
 public:
  explicit PngReader(codec_detail::Bytes bytes) : bytes_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, error_, keepError, ignoreWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool readHeader() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, readBytes);
    png_set_user_limits(png_, kMaxImageEdge_px, kMaxImageEdge_px);
    png_set_chunk_malloc_max(png_, kMaxChunk_bytes);
    png_read_info(png_, info_);
    return true;
  }
  uint32_t width() const { return png_get_image_width(png_, info_); }
  uint32_t height() const { return png_get_image_height(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_); }
  int colourType() const { return png_get_color_type(png_, info_); }
  const char* error() const { return error_; }

  bool asRgb8() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_expand(png_);
    png_set_scale_16(png_);
    png_set_gray_to_rgb(png_);
    png_set_strip_alpha(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return png_get_rowbytes(png_, info_) == size_t{width()} * 3;
  }
  bool asGrey16() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return png_get_rowbytes(png_, info_) == size_t{width()} * 2;
  }
  bool readRows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

 private:
  static void readBytes(png_structp png, png_bytep target, size_t count) {
    auto* self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (count > self->bytes_.size() - self->position_) png_error(png, "the file ends too early");
    std::memcpy(target, self->bytes_.data() + self->position_, count);
    self->position_ += count;
  }

  codec_detail::Bytes bytes_;
  size_t position_ = 0;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  char error_[128] = "out of memory";
};

// As PngReader; the file is closed by the owner.
class PngWriter {
 public:
  PngWriter() {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, error_, keepError, ignoreWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  const char* error() const { return error_; }

  bool write(std::FILE* file, int width, int height, int bits, int colour_type, png_bytepp rows) {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_init_io(png_, file);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, colour_type,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png_, 3);
    png_set_filter(png_, 0, bits == 16 ? PNG_FILTER_UP : PNG_FILTER_SUB);
    png_write_info(png_, info_);
    if (bits == 16) png_set_swap(png_);
    png_write_image(png_, rows);
    png_write_end(png_, nullptr);
    return true;
  }

 private:
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  char error_[128] = "out of memory";
};

template <class T>
std::vector<png_bytep> rowsOf(Image<T>& image) {
  std::vector<png_bytep> rows(static_cast<size_t>(image.height()));
  for (int y = 0; y < image.height(); ++y) rows[static_cast<size_t>(y)] = reinterpret_cast<png_bytep>(image.row(y));
  return rows;
}

template <class T>
Result<void> writePng(const std::string& path, const Image<T>& image, int bits, int colour_type) {
  if (image.empty()) return Error{ErrorCode::kWrongUse, path + ": an empty picture cannot be written"};
  if (auto free = checkReplaceable(path, FileKind::kPng); !free) return free;
  std::error_code ignored;
  const auto there = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
    return Error{ErrorCode::kUnreachable, path + ": is no regular file"};
  const std::string temporary = path + ".part";
  std::FILE* file = std::fopen(temporary.c_str(), "wb");
  if (file == nullptr) return Error{ErrorCode::kUnreachable, path + ": cannot be created: " + std::strerror(errno)};
  auto rows = rowsOf(const_cast<Image<T>&>(image));  // libpng's rows are not const, yet it only reads them here
  PngWriter writer;
  const bool written = writer.write(file, image.width(), image.height(), bits, colour_type, rows.data());
  const int why = errno;  // libpng knows only that it could not write
  if (std::fclose(file) != 0 || !written || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error{ErrorCode::kUnreachable,
                      path + ": cannot be written: " +
                          (written ? std::string(std::strerror(errno))
                                   : std::string(writer.error()) + " (" + std::strerror(why) + ")")};
    std::remove(temporary.c_str());
    return error;
  }
  return {};
}

Error damaged(const std::string& name, const PngReader& reader) {
  return {ErrorCode::kBadData, name + ": is a truncated or damaged PNG: " + reader.error()};
}

}  // namespace

namespace codec_detail {

Result<ColourImage> decodeColourPng(Bytes bytes, const std::string& name) {
  PngReader reader(bytes);
  if (!reader.readHeader()) return damaged(name, reader);
  if (auto size = checkSize(reader.width(), reader.height(), name); !size) return size.error();
  if (!reader.asRgb8()) return damaged(name, reader);
  ColourImage image(static_cast<int>(reader.width()), static_cast<int>(reader.height()));
  auto rows = rowsOf(image);
  if (!reader.readRows(rows.data())) return damaged(name, reader);
  return image;
}

Result<DepthImage> decodeDepthPng(Bytes bytes, const std::string& name) {
  PngReader reader(bytes);
  if (!reader.readHeader()) return damaged(name, reader);
  if (auto size = checkSize(reader.width(), reader.height(), name); !size) return size.error();
  if (reader.bits() != 16 || reader.colourType() != PNG_COLOR_TYPE_GRAY) {
    return Error{ErrorCode::kBadData, name + ": has " + std::to_string(reader.bits()) +
                                          "-bit samples and colour type " + std::to_string(reader.colourType()) +
                                          ", expected 16-bit grey (colour type 0) for depth"};
  }
  if (!reader.asGrey16()) return damaged(name, reader);
  DepthImage image(static_cast<int>(reader.width()), static_cast<int>(reader.height()));
  auto rows = rowsOf(image);
  if (!reader.readRows(rows.data())) return damaged(name, reader);
  return image;
}

}  // namespace codec_detail

Result<void> writeColourPng(const std::string& path, const ColourImage& image) {
  return writePng(path, image, 8, PNG_COLOR_TYPE_RGB);
}

Result<void> writeDepth16Png(const std::string& path, const DepthImage& image) {
  return writePng(path, image, 16, PNG_COLOR_TYPE_GRAY);
}

}  // namespace comap
