#include "harness/foreign/serve.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <memory>
#include <string>
#include <string_view>

#include "harness/foreign/frames.h"
#include "harness/foreign/library.h"
#include "harness/foreign/patience.h"

// The other side of process_tracker.cpp for a library.  Like the reader of volumes it is this executable over again, whatever
// that is, and an initialiser answers before main() begins.

namespace nullmark {
namespace {

/// Nobody is there any more.
struct Ended {};

/// Frames over two descriptors and the shared memory, if any.
class Stream {
 public:
  Stream(int input, int output) : input_(input), output_(output) {}

  void share(std::uint32_t bytes) {
    constexpr int kMemory = 3;
    if (bytes == 0) return;
    void* const at = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, kMemory, 0);
    if (at == MAP_FAILED) return;
    half_ = bytes / 2;
    theirs_ = static_cast<std::byte*>(at);
  }
  bool shares() const { return theirs_ != nullptr; }

  FrameKind receive() {
    FrameHeader header;
    read(&header, sizeof header);
    payload_.resize(header.bytes);
    if (header.shared)
      std::memcpy(payload_.data(), theirs_, header.bytes);
    else
      read(payload_.data(), header.bytes);
    return header.kind;
  }
  std::span<const std::byte> payload() const { return payload_; }

  void send(FrameKind kind, std::span<const std::byte> payload = {}) {
    FrameHeader header{kind, static_cast<std::uint32_t>(payload.size()), sent_++, 0};
    if (uses_shared_ && payload.size() >= kLeastShared && payload.size() <= half_) {
      std::memcpy(theirs_ + half_, payload.data(), payload.size());
      header.shared = 1;
      payload = {};
    }
    frame_.clear();
    frame_.one(header);
    frame_.many(payload.data(), payload.size());
    write(frame_.bytes());
    uses_shared_ = shares() && (kind == FrameKind::welcome || uses_shared_);
  }

 private:
  void read(void* to, std::size_t bytes) {
    for (auto* at = static_cast<std::byte*>(to); bytes > 0;) {
      const ssize_t n = ::recv(input_, at, bytes, uses_shared_ && patience_.asks_again() ? MSG_DONTWAIT : 0);
      if (n < 0 && (errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK)) continue;
      if (n <= 0) throw Ended{};
      patience_.answered();
      at += n;
      bytes -= static_cast<std::size_t>(n);
    }
  }
  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(output_, bytes.data(), bytes.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw Ended{};
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
  }

  int input_, output_;
  std::byte* theirs_ = nullptr;
  std::size_t half_ = 0;
  bool uses_shared_ = false;
  Patience patience_;
  std::uint32_t sent_ = 0;
  std::vector<std::byte> payload_;
  PayloadWriter frame_;
};

/// nullmark_harness by frames.
class RemoteHarness {
 public:
  explicit RemoteHarness(Stream& stream) : stream_(stream) {
    calls_.size = sizeof calls_;
    calls_.self = this;
    calls_.lookup = [](void* self, std::int64_t n, const std::uint32_t* sample, const double* t, double* values) {
      RemoteHarness& harness = *static_cast<RemoteHarness*>(self);
      return harness.ask(FrameKind::lookup, n, sample, t, 1, {values, harness.channels_});
    };
    calls_.lookup_at = [](void* self, std::int64_t n, const std::uint32_t* sample, const double* points, double* values) {
      RemoteHarness& harness = *static_cast<RemoteHarness*>(self);
      return harness.ask(FrameKind::lookup_at, n, sample, points, 3, {values, harness.channels_});
    };
    calls_.uniform = [](void* self, std::int64_t n, const std::uint32_t* sample, double* u) {
      return static_cast<RemoteHarness*>(self)->ask(FrameKind::uniform, n, sample, nullptr, 0, {u, 1});
    };
    calls_.next = [](void* self, std::int64_t n, const std::uint32_t* sample, double* t, double* rate) {
      return static_cast<RemoteHarness*>(self)->ask(FrameKind::next, n, sample, nullptr, 0, {t, 1}, {rate, 1});
    };
  }

  const nullmark_harness& begin(std::int32_t channels) {
    channels_ = static_cast<std::size_t>(channels);
    stopped_ = false;
    misuse_.clear();
    return calls_;
  }
  const std::string& misuse() const { return misuse_; }
  bool stopped() const { return stopped_; }

 private:
  /// Where numbers of an answer go: n times `each`.
  struct Numbers {
    double* to;
    std::size_t each;
  };

  std::int32_t ask(FrameKind kind, std::int64_t n, const std::uint32_t* sample, const double* at, std::size_t each, Numbers first,
                   Numbers second = {nullptr, 0}) noexcept {
    if (stopped_) return NULLMARK_STOP;
    if (n < 0) {
      misuse_ = fmt::format("it asks for {} numbers; expected at least 0", n);
      return NULLMARK_ERROR;
    }
    try {
      // A frame asks for no more than the other side allows.
      constexpr std::size_t kMost = 4096;
      for (std::size_t from = 0, all = static_cast<std::size_t>(n); from < all; from += kMost) {
        const std::size_t count = std::min(kMost, all - from);
        request_.clear();
        request_.one(static_cast<std::uint32_t>(count));
        request_.one(std::uint32_t{0});
        request_.many(at ? at + from * each : nullptr, count * each);
        request_.many(sample + from, count);
        stream_.send(kind, request_.bytes());
        if (stream_.receive() != FrameKind::values) {
          stopped_ = true;
          return NULLMARK_STOP;
        }
        PayloadReader reader(stream_.payload());
        reader.many(first.to + from * first.each, count * first.each);
        if (second.to) reader.many(second.to + from * second.each, count * second.each);
      }
      return NULLMARK_OK;
    } catch (...) {
      // Nobody is left to be told.
      ::_exit(0);
    }
  }

  Stream& stream_;
  nullmark_harness calls_ = {};
  std::size_t channels_ = 1;
  bool stopped_ = false;
  std::string misuse_;
  PayloadWriter request_;
};

/// A library's tracker behind a stream.
class LibraryServer {
 public:
  LibraryServer(Stream& stream, const char* path, const char* name) : stream_(stream), harness_(stream) {
    if (stream_.receive() != FrameKind::hello) refuse_frame("its first frame is no greeting");
    PayloadReader reader(stream_.payload());
    const auto greeting = reader.one<Greeting>();
    tracker_ = open_library(path, name, reader.text());
    session_ = tracker_->session();
    stream_.share(greeting.shared_bytes);
    Welcome welcome;
    welcome.name = tracker_->name;
    welcome.summary = tracker_->summary;
    welcome.source = tracker_->source;
    welcome.version = tracker_->version;
    welcome.quantities = tracker_->quantities;
    welcome.theory = tracker_->states_theory;
    welcome.shared = stream_.shares();
    const auto first = static_cast<std::int32_t>(tracker_->quantities & -tracker_->quantities);
    welcome.grey = tracker_->describe(first, 1);
    welcome.chromatic = tracker_->describe(first, 3);
    answer_.clear();
    write_welcome(welcome, answer_);
    stream_.send(FrameKind::welcome, answer_.bytes());
  }

  [[noreturn]] void run() {
    for (;;) {
      const FrameKind kind = stream_.receive();
      if (kind == FrameKind::ray) {
        ray_ = read_ray(stream_.payload());
        session_->begin_ray(ray_.ray);
      } else if (kind == FrameKind::theory) {
        tell_theory();
      } else if (kind == FrameKind::sample) {
        draw();
      } else if (kind == FrameKind::ping) {
        stream_.send(FrameKind::values, stream_.payload());
      } else {
        refuse_frame(fmt::format("found frame {}", static_cast<std::uint32_t>(kind)));
      }
    }
  }

 private:
  void tell_theory() {
    PayloadReader reader(stream_.payload());
    const auto quantity = reader.one<std::int32_t>(), channel = reader.one<std::int32_t>();
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    double told[4] = {kUnknown, kUnknown, kUnknown, kUnknown};
    answer_.clear();
    if (session_->theory(ray_.ray, quantity, channel, told)) answer_.many(told, 4);
    stream_.send(FrameKind::values, answer_.bytes());
  }

  void draw() {
    PayloadReader reader(stream_.payload());
    const auto request = reader.one<SampleRequest>();
    const auto count = static_cast<std::size_t>(request.count), channels = static_cast<std::size_t>(ray_.ray.channels);
    const bool free_path = request.quantity == NULLMARK_FREE_PATH;
    const bool own_medium = tracker_->describe(request.quantity, ray_.ray.channels).own_medium;
    answer_.clear();
    // Entries that the tracker leaves alone are not finite.
    auto* const numbers = answer_.room<double>((count * channels) + (free_path ? count : 0) + (own_medium ? count : 0));
    std::fill_n(numbers, count * channels + (free_path ? count : 0), std::numeric_limits<double>::quiet_NaN());
    events_.assign(count, NULLMARK_ESCAPED);
    lookups_.assign(count, 0);
    nullmark_result result = {};
    result.size = sizeof result;
    if (free_path) {
      result.distance = numbers;
      result.weight = numbers + count;
      result.event = events_.data();
    } else {
      result.value = numbers;
    }
    if (own_medium) result.lookups = lookups_.data();
    const std::int32_t code = session_->sample(ray_.ray, harness_.begin(ray_.ray.channels), request.key, request.first,
                                               request.count, request.quantity, result);
    if (!harness_.misuse().empty()) throw TrackerFailure("the tracker misuses the interface: " + harness_.misuse());
    if (harness_.stopped()) return stream_.send(FrameKind::stopped);
    if (code != NULLMARK_OK) throw TrackerFailure(fmt::format("the tracker ends with {} though nothing told it to stop", code));
    if (own_medium)
      std::memcpy(numbers + count * channels + (free_path ? count : 0), lookups_.data(), count * sizeof(std::uint64_t));
    if (free_path) answer_.many(events_.data(), count);
    stream_.send(FrameKind::result, answer_.bytes());
  }

  Stream& stream_;
  RemoteHarness harness_;
  std::shared_ptr<const ForeignTracker> tracker_;
  std::unique_ptr<TrackerSession> session_;
  ReceivedRay ray_;
  std::vector<std::uint8_t> events_;
  std::vector<std::uint64_t> lookups_;
  PayloadWriter answer_;
};

[[noreturn]] void serve(const char* path, const char* name) {
  // What the library prints goes to standard error, not between frames.
  const int output = ::dup(STDOUT_FILENO);
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
  Stream stream(STDIN_FILENO, output);
  try {
    try {
      LibraryServer(stream, path, name).run();
    } catch (const std::exception& error) {
      const std::string text = error.what();
      stream.send(FrameKind::failed, std::as_bytes(std::span(text)));
    }
  } catch (const Ended&) {
  }
  ::_exit(0);
}

/// The C library hands initialisers what it hands main().
[[gnu::constructor]] void serve_if_asked(int argc, char** argv, char**) {
  if (argc == 4 && std::string_view(argv[1]) == kServeLibrary) serve(argv[2], argv[3]);
}

}  // namespace
}  // namespace nullmark
