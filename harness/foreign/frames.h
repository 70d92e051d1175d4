#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "harness/foreign/foreign_tracker.h"

namespace nullmark {

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

/// Frames between the harness and a tracker's process; foreign.md lists what each holds.  All numbers are little-endian; arrays
/// of doubles begin at multiples of 8 bytes.
enum class FrameKind : std::uint32_t {
  hello = 1,      ///< harness: Greeting, then the parameters, a JSON object
  welcome = 2,    ///< tracker: Greeting, then what it says of itself, a JSON object
  ray = 3,        ///< harness: the ray of all samples until the next one; no answer
  theory = 4,     ///< harness: i32 quantity, i32 channel; answered by `values` of four numbers, or none
  sample = 5,     ///< harness: SampleRequest; answered by `result`
  lookup = 6,     ///< tracker: u32 n, u32 0, f64 t[n], u32 sample[n]; answered by `values`
  lookup_at = 7,  ///< tracker: u32 n, u32 0, f64 points[3 n], u32 sample[n]; answered by `values`
  uniform = 8,    ///< tracker: u32 n, u32 0, u32 sample[n]; answered by `values`
  next = 9,       ///< tracker: the same; answered by `values`: t[n], rate[n]
  step = 10,    ///< tracker: the same; `next`, then `lookup` of those that did not leave: t[n], rate[n], extinction[n * channels]
  values = 11,  ///< either: f64[]
  result = 12,  ///< tracker: see ResultLayout
  stop = 13,    ///< harness, instead of `values`: the cell ends; the tracker answers `stopped` and forgets the samples
  stopped = 14,  ///< tracker
  failed = 15,   ///< tracker, instead of any answer: a line of text
  ping = 16      ///< harness: any bytes; answered by `values` with the same bytes, so that the cost of an exchange is known
};

struct FrameHeader {
  FrameKind kind{};
  std::uint32_t bytes = 0;     ///< of the payload
  std::uint32_t sequence = 0;  ///< of this side's frames, from 0
  std::uint32_t shared = 0;    ///< 1: the payload is in this side's half of the shared memory, not in the stream
};
static_assert(sizeof(FrameHeader) == 16);

/// Smaller payloads are cheaper in the stream than in the shared memory.
inline constexpr std::size_t kLeastShared = 4096;

/// Both sides' first payload begins with it.
struct Greeting {
  static constexpr std::uint32_t kVersion = 1, kEndian = 0x01020304;
  char magic[8] = {'n', 'u', 'l', 'l', 'm', 'a', 'r', 'k'};
  std::uint32_t version = kVersion, endian = kEndian;
  std::uint32_t shared_bytes = 0;  ///< harness: size of the shared memory at descriptor 3, a half for each side; 0: none
  std::uint32_t reserved = 0;
};
static_assert(sizeof(Greeting) == 24);

struct SampleRequest {
  std::uint64_t key = 0, first = 0;
  std::int64_t count = 0;
  std::int32_t quantity = 0, reserved = 0;
};
static_assert(sizeof(SampleRequest) == 32);

/// The fixed part of a ray's frame; then f64 segment_end[s], rate[s], minimum[s * c], average[s * c], maximum[s * c], albedo[c].
struct RayHead {
  std::int32_t channels = 0, segments = 0, crossing = 0, reserved = 0;
  std::uint64_t id = 0;
  double origin[3] = {}, direction[3] = {}, begin = 0, end = 0;
};
static_assert(sizeof(RayHead) == 88);

/// Bytes of a result: f64 value[count * channels], or of free paths f64 distance[count], f64 weight[count * channels]; with a
/// medium of the tracker's own u64 lookups[count]; of free paths u8 event[count].
std::size_t result_bytes(std::size_t count, std::size_t channels, bool free_path, bool own_medium);

/// Copies a result's numbers to where `result` wants them; throws TrackerFailure for another number of bytes.
void read_result(std::span<const std::byte> payload, std::size_t count, std::size_t channels, nullmark_result& result);

/// A frame that does not fit the protocol.  Throws TrackerFailure.
[[noreturn]] void refuse_frame(const std::string& message);

/// Reads a payload from its begin; throws TrackerFailure past its end.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::byte> payload) : rest_(payload) {}

  template <class T>
  T one() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(&value, take(sizeof(T)), sizeof(T));
    return value;
  }
  template <class T>
  void many(T* out, std::size_t n) {
    if (n > 0) std::memcpy(out, take(n * sizeof(T)), n * sizeof(T));
  }
  template <class T>
  std::vector<T> many(std::size_t n) {
    expect(n * sizeof(T));
    std::vector<T> values(n);
    many(values.data(), n);
    return values;
  }
  std::string text() {
    const std::span<const std::byte> all = rest_;
    rest_ = {};
    return {reinterpret_cast<const char*>(all.data()), all.size()};
  }
  std::size_t left() const { return rest_.size(); }
  void expect_end() const;

 private:
  void expect(std::size_t bytes) const;
  const std::byte* take(std::size_t bytes) {
    expect(bytes);
    const std::byte* const at = rest_.data();
    rest_ = rest_.subspan(bytes);
    return at;
  }

  std::span<const std::byte> rest_;
};

/// Collects a payload.
class PayloadWriter {
 public:
  void clear() { bytes_.clear(); }
  template <class T>
  void one(const T& value) {
    many(&value, 1);
  }
  template <class T>
  void many(const T* values, std::size_t n) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (n == 0) return;
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n * sizeof(T));
    std::memcpy(bytes_.data() + at, values, n * sizeof(T));
  }
  void text(std::string_view text) { many(text.data(), text.size()); }
  /// Room for n numbers at the end, to be filled in place; valid until the next call.
  template <class T>
  T* room(std::size_t n) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n * sizeof(T));
    return reinterpret_cast<T*>(bytes_.data() + at);
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

void write_ray(const nullmark_ray& ray, PayloadWriter& out);

/// A ray as its frame tells it, with the memory that its pointers point to.
struct ReceivedRay {
  nullmark_ray ray = {};
  std::vector<double> numbers;
};
ReceivedRay read_ray(std::span<const std::byte> payload);

/// What a process says of itself.
struct Welcome {
  std::string name, summary, source, version;
  std::uint32_t quantities = 0;
  bool theory = false, shared = false;
  TrackerDescription grey, chromatic;
};
/// Throws TrackerFailure for another protocol, version, byte order, or a text that does not say what it should.
Welcome read_welcome(std::span<const std::byte> payload);
void write_welcome(const Welcome& welcome, PayloadWriter& out);

}  // namespace nullmark
