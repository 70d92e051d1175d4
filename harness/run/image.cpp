#include "harness/run/image.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <spng.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>

namespace nullmark {
namespace {

Real encoded(Real linear) { return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

}  // namespace

void write_png(const std::string& path, int width, int height, int channels, const std::vector<Real>& values, Real maximum,
               bool display) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height), n = static_cast<std::size_t>(channels);
  std::vector<std::uint8_t> pixels(w * h * 3);
  for (std::size_t y = 0; y < h; ++y)
    for (std::size_t x = 0; x < w; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        const Real value = values[((h - 1 - y) * w + x) * n + (n == 3 ? c : 0)] / maximum;
        const Real shown = std::min<Real>(1, std::max<Real>(0, value));
        pixels[(y * w + x) * 3 + c] = !std::isfinite(value)
                                          ? (c == 1 ? 0 : 255)
                                          : static_cast<std::uint8_t>(std::lround(255 * (display ? encoded(shown) : shown)));
      }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), &std::fclose);
  if (!file) throw std::runtime_error(path + ": cannot be written");
  const std::unique_ptr<spng_ctx, void (*)(spng_ctx*)> context(spng_ctx_new(SPNG_CTX_ENCODER), &spng_ctx_free);
  spng_ihdr header{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 8, SPNG_COLOR_TYPE_TRUECOLOR, 0, 0, 0};
  spng_set_png_file(context.get(), file.get());
  spng_set_ihdr(context.get(), &header);
  if (const int error = spng_encode_image(context.get(), pixels.data(), pixels.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE))
    throw std::runtime_error(path + ": " + spng_strerror(error));
  // A full disk may show only here.
  if (std::fflush(file.get()) != 0) throw std::runtime_error(path + ": cannot be written");
}

void write_exr(const std::string& path, int width, int height, const std::vector<Layer>& layers) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  std::vector<std::vector<float>> pixels;
  for (const Layer& layer : layers) {
    pixels.emplace_back(w * h);
    for (std::size_t y = 0; y < h; ++y)
      for (std::size_t x = 0; x < w; ++x) pixels.back()[y * w + x] = static_cast<float>(layer.values[(h - 1 - y) * w + x]);
  }
  for (std::size_t i = 0; i < layers.size(); ++i) {
    header.channels().insert(layers[i].name, Imf::Channel(Imf::FLOAT));
    frame.insert(layers[i].name,
                 Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels[i].data()), sizeof(float), w * sizeof(float)));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(frame);
  file.writePixels(height);
}

LayeredImage read_exr(const std::string& path) {
  Imf::InputFile file(path.c_str());
  const Imath::Box2i window = file.header().dataWindow();
  const auto extent = [](int low, int high) { return static_cast<std::int64_t>(high) - low + 1; };
  const std::int64_t width = extent(window.min.x, window.max.x), height = extent(window.min.y, window.max.y);
  constexpr std::int64_t kMostAcross = 1 << 16, kMost = 1 << 26;
  if (width < 1 || height < 1 || width > kMostAcross || height > kMostAcross || width * height > kMost)
    throw std::runtime_error(path + ": too large");
  LayeredImage image{static_cast<int>(width), static_cast<int>(height), {}};
  for (auto channel = file.header().channels().begin(); channel != file.header().channels().end(); ++channel) {
    if (channel.channel().type != Imf::FLOAT || channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
      throw std::runtime_error(
          path +
          ": channels are not 32-bit floats, one a pixel; write the image again as floats, because rounding to halves is a bias");
    image.layers.push_back({channel.name(), {}});
  }
  const auto w = static_cast<std::size_t>(image.width), h = static_cast<std::size_t>(image.height);
  if (image.layers.size() > static_cast<std::size_t>(kMost / (width * height))) throw std::runtime_error(path + ": too large");
  std::vector<std::vector<float>> pixels(image.layers.size(), std::vector<float>(w * h));
  Imf::FrameBuffer frame;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    frame.insert(image.layers[i].name, Imf::Slice::Make(Imf::FLOAT, pixels[i].data(), window, sizeof(float), w * sizeof(float)));
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    image.layers[i].values.resize(w * h);
    for (std::size_t y = 0; y < h; ++y)
      for (std::size_t x = 0; x < w; ++x) image.layers[i].values[(h - 1 - y) * w + x] = pixels[i][y * w + x];
  }
  return image;
}

}  // namespace nullmark
